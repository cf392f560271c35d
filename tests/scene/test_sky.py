"""The clear sky and its sun, against published values."""

import math
import time
from datetime import datetime

import numpy as np
import pytest

import pica
from pica.scene.atmosphere import Atmosphere, atmosphere, sky_picture
from pica.scene.sun import parse_sun

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
DIFFUSE = {60: 15_200, 20: 9_900}
"""Lux of a clear sky: 800 + 15500 sin(elevation)^0.5; IES, Calculation of Daylight Availability, 1984 (RP-21)."""


def picture(elevation, azimuth=0.0, turbidity=2.0, albedo=0.3):
    return sky_picture(math.radians(elevation), math.radians(azimuth), turbidity, albedo)


def horizontal(sky):
    """Lux of the upper half on the ground."""
    rows = math.pi / 2 - (np.arange(64) + 0.5) / 128 * math.pi
    solid = np.sin(rows) * np.cos(rows) * (math.pi / 128) ** 2
    return float(((sky[:64] @ LUMINANCE) * solid[:, None]).sum())


def direct(elevation, turbidity=2.0):
    return atmosphere(turbidity, 0.3).sun_illuminance(math.radians(elevation))


@pytest.mark.parametrize("elevation", [60, 20])
def test_illuminance_of_a_clear_day(elevation):
    """The sun: 127500 exp(-0.21 m) lux of air mass m (the same source), about 100000 with the sky at 60 degrees."""
    rise = math.sin(math.radians(elevation))
    sun = float(direct(elevation) @ LUMINANCE)
    assert sun == pytest.approx(127_500 * math.exp(-0.21 / rise), rel=0.1)
    sky = horizontal(picture(elevation))
    assert sky == pytest.approx(DIFFUSE[elevation], rel=0.35)
    total = 127_500 * math.exp(-0.21 / rise) * rise + DIFFUSE[elevation]
    assert sky + sun * rise == pytest.approx(total, rel=0.05)


def test_luminance_at_the_zenith():
    """Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight", 1999, A.2: 5880 nits at turbidity 2."""
    assert float((picture(60)[0] @ LUMINANCE).mean()) == pytest.approx(5880, rel=0.3)


def test_a_low_sun_is_red_and_the_zenith_blue():
    high, low = direct(60), direct(5)
    assert low[0] / low[2] > 4 * high[0] / high[2] and low[0] > low[1] > low[2]
    red, green, blue = picture(60)[0].mean(0)
    assert blue > green > red


@pytest.mark.parametrize("elevation", [60, 20, 10, 5, 0, -3])
def test_the_sky_is_smooth_bright_at_the_horizon_and_not_green(elevation):
    sky = picture(elevation)[:64]
    assert np.isfinite(sky).all() and sky.min() > 0
    luminance = sky @ LUMINANCE
    assert luminance[-1].min() > 0.3 * np.median(luminance)
    # Between a yellow horizon and a blue zenith all channels are about equal.
    assert (sky[..., 1] < 1.08 * np.maximum(sky[..., 0], sky[..., 2])).all()
    away = luminance[:, :64]  # north is at column 64; the other half has the sun's aureole
    assert np.abs(np.diff(np.log(away[8:56]), axis=0)).max() < 0.35


def test_haze_dims_the_sun_and_whitens_the_sky():
    assert direct(40, 5).sum() < 0.8 * direct(40, 1.5).sum()
    clear, hazy = picture(40, 180, 1.5)[20, 64], picture(40, 180, 5)[20, 64]
    assert hazy[2] / hazy[0] < 0.8 * clear[2] / clear[0]


def test_the_ground_is_lit_by_sky_and_sun():
    sky = picture(60)
    total = horizontal(sky) + float(direct(60) @ LUMINANCE) * math.sin(math.radians(60))
    assert float(sky[-1, 0] @ LUMINANCE) == pytest.approx(0.3 / math.pi * total, rel=1e-3)


@pytest.mark.parametrize("azimuth", [0, 90, 200])
def test_the_light_comes_from_the_brightest_place(azimuth):
    environment, sun = pica.sky(math.radians(30), math.radians(azimuth))
    row, column = np.unravel_index((environment.radiance @ LUMINANCE).argmax(), (128, 256))
    polar, around = (row + 0.5) / 128 * math.pi, ((column + 0.5) / 256 - 0.5) * 2 * math.pi
    brightest = (math.sin(polar) * math.cos(around), math.cos(polar), math.sin(polar) * math.sin(around))
    # The light travels along -Z; the path to the horizon below the sun brightens the aureole's lower side.
    assert sun.transform[:3, 2] @ brightest > math.cos(math.radians(5))
    east, north = math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth))
    assert sun.transform[[0, 2], 2] == pytest.approx(np.array([east, -north]) * math.cos(math.radians(30)))
    assert np.asarray(sun.light.color) * sun.light.illuminance == pytest.approx(direct(30), rel=1e-5)
    assert sun.light.angular_diameter == pytest.approx(math.radians(0.53))


def test_the_sun_has_set():
    assert pica.sky(math.radians(-3))[1].light.illuminance == 0


@pytest.mark.parametrize(
    ("given", "fault"),
    [({"elevation": 2.0}, "elevation"), ({"turbidity": 0.5}, "turbidity"), ({"albedo": 1.5}, "albedo")],
)
def test_skies_that_are_none(given, fault):
    with pytest.raises(pica.SceneError, match=f"sky: {fault}"):
        pica.sky(**{"elevation": 0.5, **given})


def test_a_sky_is_made_at_once():
    start = time.process_time()
    Atmosphere(2.0, 0.3)
    picture(33)
    assert time.process_time() - start < 1.5  # 0.2 s on one core; slack for shared ones


@pytest.mark.parametrize(
    ("moment", "latitude", "longitude", "elevation", "azimuth"),
    [
        # Reda and Andreas, "Solar Position Algorithm for Solar Radiation Applications", NREL/TP-560-34302, table A5.1:
        # topocentric elevation before refraction, and azimuth.
        ("2003-10-17T12:30:30-07:00", 39.742476, -105.1786, 39.872046, 194.340241),
        # The sun's declination at the June solstice is 23.44 degrees, and it crosses Greenwich at 12:01:50 (Meeus, 28).
        ("2026-06-21T12:01:50Z", 51.4779, 0.0, 90 - 51.4779 + 23.44, 180.0),
    ],
)
def test_position_of_the_sun(moment, latitude, longitude, elevation, azimuth):
    found = pica.sun_position(datetime.fromisoformat(moment), latitude, longitude)
    assert np.degrees(found) == pytest.approx((elevation, azimuth), abs=0.1)
    assert parse_sun(f"{moment}@{latitude},{longitude}") == found


def test_texts_of_the_sun():
    assert np.degrees(parse_sun("-3,200")) == pytest.approx((-3, 200))
    for text in ("", "1", "1,2,3", "a,b", "noon@1,2", "2026-06-21@1", "2026-06-21T12:00Z@95,0", "@1,2"):
        with pytest.raises(pica.SceneError):
            pica.sky(*parse_sun(text))
