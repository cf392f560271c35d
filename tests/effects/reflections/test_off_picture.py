"""Indirect light of what the picture does not show: reflections and paths ask the surfels, or the light map."""

import numpy as np
import pytest

import pica
from pica.quality.effects import MeasuredEffect
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, settings

SIZE = (48, 32)
SHINES, REFLECTS = 0.25, 0.75
EYE = (0.3, 0.2, -0.2)
TOWARDS_THE_MIRROR = Camera.look_at(EYE, (0, 0, -1), vertical_fov=np.radians(80))
SURFELS = {"global_illumination.mode": "surfels", "global_illumination.surfels": "8000"}


def furnace():
    """A closed box whose walls send 1 nit: a quarter by themselves, and three quarters of what arrives. A mirror hides
    one wall, and shows the others."""
    shining = (SHINES,) * 3
    mirror = Material(base_color=(1, 1, 1, 1), metallic=1.0, roughness=0.0)
    walls = lambert(REFLECTS, emission=shining, double_sided=True)
    return scene_of(placed(box(2, walls)), placed(plane(1.98, 1.98, mirror), move(0, 0, -0.98) @ rotate("x", 90)))


@pytest.fixture(scope="module")
def baked(device):
    return pica.bake(furnace(), spacing=0.5, samples=512, device=device)


def in_the_mirror(device, values, light_map=None, look_about=0):
    """Mean light of the mirror's pixels, of all, and of what is behind the camera."""
    renderer = pica.Renderer(
        furnace(),
        size=SIZE,
        settings=settings({"reflections.mode": "ray_traced", **values}),
        device=device,
        light_map=light_map,
    )
    for towards in np.random.default_rng(1).normal(size=(look_about, 3)):
        renderer.advance(Camera.look_at(EYE, EYE + towards, vertical_fov=np.radians(80)))
    frame = renderer.render(16, camera=TOWARDS_THE_MIRROR)
    shown = frame.aov("metallic") > 0.5
    assert 0.4 < shown.mean() < 1
    behind = renderer.render(16, camera=Camera.look_at(EYE, (EYE[0], EYE[1], 1), vertical_fov=np.radians(80)))
    return frame.color[shown].mean(), frame.color.mean(), behind.color.mean()


@pytest.mark.parametrize("mode", ["light_map", "path_traced", "restir"])
def test_with_a_light_map_a_furnace_is_one_in_its_mirror_too(device, baked, mode):
    mirrored, whole, _ = in_the_mirror(device, {"global_illumination.mode": mode}, baked)
    assert mirrored == pytest.approx(1, abs=0.02)
    assert whole == pytest.approx(1, abs=0.02)


def test_surfels_that_have_been_seen_light_what_the_mirror_shows(device):
    """As if one turned about to look at it; surfels themselves are within 7 % here."""
    mirrored, whole, behind = in_the_mirror(device, SURFELS, look_about=80)
    assert mirrored == pytest.approx(behind, rel=0.03)
    assert behind == pytest.approx(1, abs=0.07)
    assert whole == pytest.approx(behind, rel=0.03)


def test_the_radiance_cache_lights_what_the_mirror_shows(device):
    """With few bounces too, once it has been filled."""
    values = {"global_illumination.mode": "path_traced", "global_illumination.bounces": 2}
    mirrored, whole, behind = in_the_mirror(device, values, look_about=80)
    assert mirrored == pytest.approx(behind, rel=0.03)
    assert mirrored == pytest.approx(1, abs=0.03)
    assert whole == pytest.approx(1, abs=0.03)


def test_where_no_cache_has_data_paths_go_on(device):
    """For `global_illumination.bounces` surfaces: beyond these, light is missing."""
    two, _, _ = in_the_mirror(device, {**SURFELS, "global_illumination.bounces": 2})
    sixteen, _, behind = in_the_mirror(device, {**SURFELS, "global_illumination.bounces": 16})
    assert SHINES * (1 + REFLECTS) < two < 0.8 * behind
    assert 0.9 < sixteen < 1.02


def test_other_global_illumination_is_asked_from_the_next_frame_on(device, baked):
    """Reflections are made anew where what they ask is of another kind, and keep their history elsewhere."""
    on = settings({"reflections.mode": "ray_traced", "global_illumination.mode": "light_map"})
    renderer = pica.Renderer(furnace(), size=SIZE, settings=on, device=device, light_map=baked)
    for values in (SURFELS, {"global_illumination.mode": "off"}, {"global_illumination.mode": "path_traced"}):
        renderer.configure(on.with_values(values))
        renderer.advance(TOWARDS_THE_MIRROR)
    kept = renderer._stages.reflections
    renderer.configure(on.with_values({"global_illumination.mode": "restir"}))
    assert renderer.render(16, camera=TOWARDS_THE_MIRROR).color.mean() == pytest.approx(1, abs=0.03)
    assert renderer._stages.reflections is kept


def test_the_reference_has_all_of_that_light_too(device, baked):
    on = settings({"reflections.mode": "ray_traced", "global_illumination.mode": "light_map"})
    renderer = pica.Renderer(furnace(), size=SIZE, settings=on, device=device, light_map=baked)
    shown = renderer.render(8, camera=TOWARDS_THE_MIRROR).aov("metallic") > 0.5
    measured = MeasuredEffect(renderer, "reflections")
    expected = measured.reference(256)["reflections"][shown]
    assert np.nanmean(expected) == pytest.approx(1, abs=0.02)
    assert measured.result()["reflections"][shown].mean() == pytest.approx(np.nanmean(expected), rel=0.03)
