"""Reflections over the depth buffer, where nothing traces rays."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, settings, sky, uniform

SIZE = (96, 64)
VIEW = Camera.look_at((0, 1.2, 3.4), (0, 0.5, 0), vertical_fov=np.radians(50))
PREFILTERED = {"visibility.primary": "raster", "shadows.mode": "off", "lighting.environment": "prefiltered"}
SCREEN = {**PREFILTERED, "reflections.mode": "screen_space"}


def metal(roughness, *color):
    return Material(base_color=(*(color or (0.9, 0.8, 0.7)), 1), metallic=1.0, roughness=roughness)


def rendered(device, scene, values, frames=32, camera=VIEW):
    return pica.Renderer(scene, size=SIZE, settings=settings(values), device=device).render(frames, camera=camera)


def lamps_on(floor):
    """Two boxes that shine on a floor, all of them in the picture."""
    red, white = lambert(0, emission=(4.0, 0.5, 0.5)), lambert(0, emission=(2.0, 2.0, 2.0))
    return scene_of(
        placed(plane(8, 8, floor)),
        placed(box((0.7, 0.5, 0.4), red), move(-0.6, 0.4, -0.6) @ rotate("y", 20)),
        placed(box((0.5, 0.8, 0.3), white), move(0.5, 0.4, -0.4)),
    )


# Of wide lobes light samples find the undersides of the boxes, too, which the picture does not show.
@pytest.mark.parametrize(("roughness", "unseen", "apart"), [(0.05, 0.05, 0.15), (0.4, 0.125, 0.25)])
def test_a_floor_shows_what_rays_find_where_that_is_in_the_picture(device, roughness, unseen, apart):
    scene = lamps_on(metal(roughness))
    frame = rendered(device, scene, SCREEN)
    by_rays = rendered(device, scene, {**SCREEN, "reflections.mode": "ray_traced", "reflections.rays": "quarter"})
    # All light of a metal floor, as rays share what shines with light samples.
    expected, found = by_rays.color, frame.color
    floor = frame.aov("instance") == 1
    assert expected[floor].mean() > 0.05
    assert found[floor].mean() == pytest.approx(expected[floor].mean(), rel=unseen)
    assert np.abs(found - expected)[floor].mean() < apart * expected[floor].mean()


def a_floor(height):
    floor = placed(plane(200, 200, metal(0.3)))
    return scene_of(floor, environment=sky()), Camera.look_at(
        (0, height, 3.4), (0, height / 2, 0), vertical_fov=np.radians(50)
    )


def a_ball():
    return scene_of(placed(sphere(0.8, metal(0.6)), move(0, 0.6, 0)), environment=sky()), VIEW


@pytest.mark.parametrize("scene", [lambda: a_floor(0.15), lambda: a_floor(1.2), a_ball], ids=["low", "high", "ball"])
def test_no_surface_meets_itself_and_misses_show_the_surroundings(device, scene):
    """What is alone mirrors the sky alone, as smoothly as without rays."""
    shown, camera = scene()
    renderer = pica.Renderer(shown, size=SIZE, settings=settings(SCREEN), device=device)
    renderer.debug = True
    frame = renderer.render(1, camera=camera)
    rays = frame.aov("debug.reflections.variance") >= 0
    assert rays.sum() > 800
    assert frame.aov("debug.reflections.distance")[rays].min() > 1e5
    expected = rendered(device, shown, {**PREFILTERED, "reflections.mode": "off"}, 1, camera).color
    assert np.abs(frame.color - expected).mean() < 0.03 * expected.mean()
    assert frame.color.mean() == pytest.approx(expected.mean(), rel=0.005)


def test_rays_that_pass_far_behind_something_do_not_meet_it(device):
    """A board that hangs near the camera, over the floor that is seen below it."""
    board = placed(box((3, 0.6, 0.02), lambert(0, emission=(9.0, 9.0, 9.0))), move(0, 1.15, 1.8))
    scene = scene_of(placed(plane(8, 8, metal(0.1))), board)
    frame = rendered(device, scene, SCREEN)
    behind = (frame.aov("instance") == 1) & (frame.aov("depth") > 3.0)
    assert behind.sum() > 500
    assert (frame.aov("reflections")[behind].max(-1) > 0.1).mean() < 0.01


def test_light_is_neither_made_nor_lost(device):
    """White metals below a white sky send on all that comes, whatever of it comes over others."""
    white = metal(0.3, 1, 1, 1)
    balls = [placed(sphere(0.4, white), move(x, 0.4, 0)) for x in (-0.5, 0.5)]
    wall = placed(plane(20, 4, white), move(0, 2, -1.5) @ rotate("x", 90))
    scene = scene_of(placed(plane(20, 20, white)), wall, *balls, environment=uniform(1, 1, 1))
    frame = rendered(device, scene, SCREEN)
    seen = frame.aov("instance") > 0
    assert frame.color[seen].mean() == pytest.approx(1, abs=0.02)
    assert frame.aov("reflections")[seen].mean() > 0.9


def test_what_shines_is_left_to_direct_light_where_lobes_are_wide(device):
    """Emissive triangles have one owner here too (docs/how-it-works/light-paths.md)."""
    scene = lamps_on(metal(0.9))
    frame = rendered(device, scene, SCREEN)
    floor = frame.aov("instance") == 1
    assert frame.aov("reflections")[floor].mean() < 0.02 * frame.color[floor].mean()
