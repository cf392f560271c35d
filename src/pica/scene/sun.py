"""The sun of a clear sky as a node, and its position by time and place."""

import math
from datetime import UTC, datetime
from typing import Any

import numpy as np

from pica.errors import SceneError
from pica.scene.atmosphere import SUN_DIAMETER, atmosphere, sky_picture
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight
from pica.scene.node import Node
from pica.scene.values import angle, checked, number

_ELEVATION = angle(-math.pi / 2, math.pi / 2)


def sky(
    elevation: float, azimuth: float = 0.0, turbidity: float = 2.0, albedo: float = 0.3
) -> tuple[Environment, Node]:
    """A clear sky and its sun, of elevation and azimuth in radians: `scene.environment, sun = pica.sky(0.5)`, then
    `scene.add(sun)`.

    The environment is in nits, (128, 256, 3), and lacks the sun's disk, which the node's directional light is, in lux:
    nothing counts twice. `azimuth`: from north (-Z) towards east (+X). `turbidity`: 1 for air without haze, 2 for a
    clear day, up to 10. `albedo`: of the ground, the picture's lower half, 0 to 1. Raises SceneError for other values.
    """

    def fit(name: str, check: Any, value: float) -> float:
        return float(checked(f"sky: {name}", check, value))

    elevation, azimuth = fit("elevation", _ELEVATION, elevation), fit("azimuth", number(), azimuth)
    turbidity, albedo = fit("turbidity", number(1, 10), turbidity), fit("albedo", number(0, 1), albedo)
    picture = sky_picture(elevation, azimuth, turbidity, albedo)
    lux = atmosphere(turbidity, albedo).sun_illuminance(elevation)
    # A light's colour multiplies its illuminance: this is the brightest channel's, and the colour is at most 1.
    brightest = float(lux.max())
    red, green, blue = (float(part) for part in lux / max(brightest, 1e-9))
    light = DirectionalLight((red, green, blue), brightest, SUN_DIAMETER, name="sun")
    sun = Node("sun", light=light)
    sun.transform = _rotation(elevation, azimuth)
    return Environment(picture.astype(np.float32), name="sky"), sun


def sun_position(time: datetime, latitude: float, longitude: float) -> tuple[float, float]:
    """Elevation (without refraction) and azimuth of the sun in radians, at degrees north and east.

    A time without a zone is UTC. Low accuracy algorithm of Meeus, "Astronomical Algorithms", 1998, chapter 25, as in
    NOAA's solar calculator: within 0.01 degrees between 1900 and 2100. Raises SceneError for places off the globe.
    """
    latitude = math.radians(checked("sun_position: latitude", number(-90, 90), latitude))
    longitude = checked("sun_position: longitude", number(-180, 180), longitude)
    moment = time.replace(tzinfo=UTC) if time.tzinfo is None else time
    days = (moment - datetime(2000, 1, 1, 12, tzinfo=UTC)).total_seconds() / 86400
    century = days / 36525
    mean = math.radians(357.52911 + century * (35999.05029 - 0.0001537 * century))
    center = (
        (1.914602 - century * (0.004817 + 0.000014 * century)) * math.sin(mean)
        + (0.019993 - 0.000101 * century) * math.sin(2 * mean)
        + 0.000289 * math.sin(3 * mean)
    )
    node = math.radians(125.04 - 1934.136 * century)
    true = 280.46646 + century * (36000.76983 + 0.0003032 * century) + center
    ecliptic = math.radians(true - 0.00569 - 0.00478 * math.sin(node))
    tilt = math.radians(23.439291 - 0.0130042 * century + 0.00256 * math.cos(node))
    ascension = math.atan2(math.cos(tilt) * math.sin(ecliptic), math.cos(ecliptic))
    declination = math.asin(math.sin(tilt) * math.sin(ecliptic))
    hour = math.radians(280.46061837 + 360.98564736629 * days + longitude) - ascension
    up = math.sin(latitude) * math.sin(declination) + math.cos(latitude) * math.cos(declination) * math.cos(hour)
    east = -math.cos(declination) * math.sin(hour)
    north = math.cos(latitude) * math.sin(declination) - math.sin(latitude) * math.cos(declination) * math.cos(hour)
    return math.asin(max(-1.0, min(1.0, up))), math.atan2(east, north) % (2 * math.pi)


def parse_sun(text: str) -> tuple[float, float]:
    """Elevation and azimuth in radians from "ELEVATION,AZIMUTH" in degrees or "TIME@LATITUDE,LONGITUDE".

    Raises SceneError.
    """
    time, at, place = text.rpartition("@")
    try:
        first, second = (float(part) for part in place.split(","))
        moment = datetime.fromisoformat(time) if at else None
        if moment is not None:
            return sun_position(moment, first, second)
    except (ValueError, OverflowError):
        raise SceneError(f"sun {text!r} is neither ELEVATION,AZIMUTH nor TIME@LATITUDE,LONGITUDE, in degrees") from None
    return math.radians(first), math.radians(second)


def _rotation(elevation: float, azimuth: float) -> Any:
    """(4, 4) of a node whose +Z points to the sun, so that its light leaves it along -Z."""
    sine, cosine = math.sin(azimuth), math.cos(azimuth)
    toward = np.array([sine * math.cos(elevation), math.sin(elevation), -cosine * math.cos(elevation)])
    right = np.array([-cosine, 0.0, -sine])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(toward, right), toward], 1)
    return matrix
