"""Light behind rough transmissive surfaces, kept in texture space."""

import math

import numpy as np
import pytest

import pica
from pica.quality.picture_errors import compare
from pica.quality.playback import last_frame
from pica.quality.sequences import sequence
from pica.scene.camera import Camera
from pica.scene.light import SphereLight
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import converged, lambert, placed, scene_of, shining, uniform
from tests.effects.transparency.test_transparency import glass
from tests.effects.transparency.trails import ghost_behind

SIZE = (96, 60)
CAMERA = Camera.look_at((0.3, 0.6, 2.4), (0, 0.35, 0), vertical_fov=math.radians(32))


def wall(color=(0.2, 0.4, 0.8)):
    return placed(plane(5, 3, lambert(*color)), move(0, 1.5, -1.2) @ rotate("x", 90))


def scene(*more):
    floor = placed(plane(5, 5, lambert(0.6, 0.5, 0.4)))
    ball = placed(sphere(0.34, glass(roughness=0.45), 48), move(-0.4, 0.35, 0))
    block = placed(box((0.4, 0.5, 0.3), glass((0.9, 0.95, 1.0), roughness=0.3)), move(0.45, 0.26, 0) @ rotate("y", 30))
    return scene_of(floor, ball, block, *more, environment=uniform(0.8, 0.8, 0.8))


def renderer(device, shown, texture_space, size=SIZE):
    return pica.Renderer(
        shown,
        size=size,
        settings=pica.Settings().with_values({"transparency.texture_space": texture_space}),
        device=device,
    )


@pytest.fixture(scope="module")
def expected(device):
    return converged(device, scene(wall()), 512, CAMERA, SIZE)


def inside(picture):
    """The ball and the block."""
    return np.concatenate([picture[20:40, 18:34].reshape(-1, 3), picture[24:38, 58:68].reshape(-1, 3)])


def test_maps_have_less_noise_in_motion_than_pixels(device, expected):
    errors = {}
    for texture_space in ("off", "rough"):
        with renderer(device, scene(wall()), texture_space) as view:
            orbit = sequence("orbit", view.scene, CAMERA, speed=1.0)
            picture = last_frame(view, orbit, range(-15, 1)).color
            errors[texture_space] = np.abs(inside(picture) - inside(expected)).mean() / expected.mean()
            assert inside(picture).mean() == pytest.approx(inside(expected).mean(), rel=0.03)
    assert errors["rough"] < 0.8 * errors["off"]


def test_maps_converge_to_the_path_tracer(device, expected):
    with renderer(device, scene(wall()), "rough") as view:
        picture = view.render(96, camera=CAMERA).color
    assert inside(picture).mean() == pytest.approx(inside(expected).mean(), rel=0.015)
    assert np.abs(inside(picture) - inside(expected)).mean() < 0.05 * inside(expected).mean()


def test_clear_solids_may_have_maps_too(device):
    """As sharp as texels are."""
    pictures = []
    for texture_space in ("off", "all"):
        block = placed(box((1.6, 1.0, 0.4), glass(absorption=(0.5, 1.0, 2.0))), move(0, 0.5, 0) @ rotate("y", 20))
        shown = scene_of(wall(), block, environment=uniform(0.8, 0.8, 0.8))
        with renderer(device, shown, texture_space) as view:
            pictures.append(view.render(32, camera=CAMERA).color)
            counted = view.count_rays(CAMERA)
        assert ("glass_map_rays" in counted) == (texture_space == "all")
    assert compare(*pictures).flip < 0.03


def test_paths_of_maps_are_no_more_than_texels(device):
    values = {"transparency.map_size": 64}
    with pica.Renderer(
        scene(wall()), size=(32, 20), settings=pica.Settings().with_values(values), device=device
    ) as view:
        view.render(4, camera=CAMERA)
        assert 0 < view.count_rays(CAMERA)["glass_map_rays"] <= 64 * 64


def test_maps_follow_what_changes_behind_them(device):
    behind = wall((0.9, 0.1, 0.1))
    with renderer(device, scene(behind), "rough", (48, 30)) as view:
        before = view.render(40, camera=CAMERA).color
        behind.mesh.sections[0].material.base_color = (0.1, 0.1, 0.9, 1.0)
        after = view.render(36, camera=CAMERA).color
        view.reset()
        settled = view.render(64, camera=CAMERA).color
    ball = np.s_[10:20, 8:20]
    change = (settled - before)[ball].mean((0, 1))
    left = np.abs((settled - after)[ball].mean((0, 1)))
    assert np.abs(change).max() > 0.1
    np.testing.assert_array_less(left, 0.12 * np.abs(change).max())


def test_light_off_rough_surfaces_is_filtered(device):
    """A lamp in a rough pane is specks otherwise."""
    noise = {}
    for filters in ("true", "false"):
        pane = placed(plane(1.6, 1.2, glass(thin_walled=True, roughness=0.4)), move(0, 0.6, 0.3) @ rotate("x", 90))
        lamp = shining(SphereLight(radiance=100.0, radius=0.1), move(0.5, 1.5, 1.5))
        shown = scene_of(wall(), pane, lamp, environment=uniform(0.2, 0.2, 0.2))
        values = {"debug.filters": filters, "transparency.texture_space": "off"}
        with pica.Renderer(shown, size=SIZE, settings=pica.Settings().with_values(values), device=device) as view:
            picture = view.render(1, camera=CAMERA).color[20:40, 30:66]
        noise[filters] = np.abs(np.diff(picture, axis=1)).mean() / picture.mean()
    assert noise["true"] < 0.5 * noise["false"]


def test_what_moves_behind_rough_glass_leaves_little(device):
    """Texels keep few values while it does, and antialiasing does not take the glass for a picture at rest."""
    values = pica.Settings().with_values({"transparency.map_size": "128"})
    assert ghost_behind(device, values, glass(roughness=0.3)) < 0.13
