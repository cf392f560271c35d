"""Surfaces at rest over which light moves: the shadow of something, or its image in a mirror."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move
from tests.building import lambert, placed, scene_of, shining, uniform

SIZE, FRAMES = (128, 72), 16


def after(device, scene, thing, places, camera):
    """The picture while `thing` comes along `places`, its truth where it ends, and where it is seen there."""
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        for place in places:
            thing.transform = move(*place)
            moving = renderer.render(1, camera=camera).color
        still = renderer.render(32, camera=camera, cut=True, aovs=["instance"])
    return moving, still.color, still.aov("instance")


@pytest.mark.parametrize(
    ("step", "bound"), [(0.012, 0.0035), (0.05, 0.006)], ids=["half a pixel a frame", "two pixels a frame"]
)
def test_the_shadow_of_something_that_moves_leaves_neither_dots_nor_a_trail(device, step, bound):
    """As long as nothing but noise and static edges was expected on surfaces at rest, .0051 and .0085 of the floor was
    off."""
    ball = placed(sphere(0.3, lambert(0.8, 0.5, 0.1)))
    sun = shining(DirectionalLight(illuminance=5.0, angular_diameter=0.0093), aim((4, 6, 3), (0, 0, 0)))
    scene = scene_of(placed(plane(20, 20, lambert(0.5))), ball, sun, environment=uniform(0.3, 0.35, 0.5))
    camera = Camera.look_at((0, 1.7, 3.5), (0, 0.2, 0), vertical_fov=np.radians(45))
    places = [(step * (frame - FRAMES + 1), 0.5, 0) for frame in range(FRAMES)]
    moving, still, instance = after(device, scene, ball, places, camera)
    floor = instance == instance[-1, 0]
    off = np.abs(moving - still).max(-1) > 0.15 * still[floor].mean()
    assert off[floor].mean() < bound


def test_a_mirror_shows_what_moves_where_it_is(device):
    mirror = Material("mirror", base_color=(0.95, 0.95, 0.95, 1.0), metallic=1.0, roughness=0.01)
    blue = placed(box((0.5, 0.8, 0.05), lambert(0.1, 0.3, 0.8)))
    glass = placed(box((3, 1.8, 0.05), mirror), move(0, 0.9, -1))
    scene = scene_of(placed(plane(20, 20, lambert(0.5))), glass, blue, environment=uniform(0.8, 0.8, 0.8))
    camera = Camera.look_at((0, 1.2, 2.4), (0, 0.8, -1), vertical_fov=np.radians(45))
    places = [(0.05 * (frame - FRAMES) - 0.2, 0.6, 3.2) for frame in range(FRAMES)]
    moving, still, instance = after(device, scene, blue, places, camera)
    shown = instance == instance[SIZE[1] // 2, SIZE[0] // 2]
    off = np.abs(moving - still).max(-1) > 0.1
    assert off[shown].mean() < 0.015  # with the history of a mirror that nothing moves in, .020


@pytest.mark.parametrize("roughness", [0.3, 1.0], ids=["polished", "matt"])
def test_something_that_glows_takes_its_light_along(device, roughness):
    """A ball over a floor, default settings: histories of a fixed length held 1.6 times the light where it has been."""
    ball = placed(sphere(0.28, lambert(0, emission=(6.0, 1.0, 1.0))))
    floor = Material(base_color=(0.4, 0.4, 0.4, 1), metallic=0.0, roughness=roughness)
    scene = scene_of(placed(plane(20, 20, floor)), ball, environment=uniform(0.08, 0.08, 0.08))
    camera = Camera.look_at((0, 1.7, 3.5), (0, 0.2, 0), vertical_fov=np.radians(45))
    places = [(0.05 * (frame - FRAMES) + 0.5, 0.3, 0) for frame in range(FRAMES)]
    moving, still, _ = after(device, scene, ball, places, camera)
    glowing = np.argwhere(still.min(-1) > 0.9)
    (_, left), (bottom, _) = glowing.min(0), glowing.max(0)
    behind = np.s_[bottom - 6 : bottom + 4, left - 14 : left - 4]
    assert moving[behind].mean() < 1.2 * still[behind].mean()
