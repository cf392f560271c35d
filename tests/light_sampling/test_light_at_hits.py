"""Light samples at hits of rays."""

import numpy as np

import pica
from pica.scene.camera import Camera
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from tests.building import lambert, placed, scene_of

RAYS = "debug.global_illumination.raw"
LAMP = 10.0  # nits


def room_below_a_tube():
    """A closed white room with a luminous tube 2 cm below its ceiling."""
    white, glow = lambert(0.6), pica.Material(emission=(LAMP, LAMP, LAMP))
    walls = [
        placed(box((4, 0.1, 4), white), move(0, 2.55, 0)),
        placed(box((4, 0.1, 4), white), move(0, -0.05, 0)),
        *(placed(box((0.1, 2.5, 4), white), move(x, 1.25, 0)) for x in (-2.05, 2.05)),
        *(placed(box((4, 2.5, 0.1), white), move(0, 1.25, z)) for z in (-2.05, 2.05)),
    ]
    return scene_of(*walls, placed(box((0.08, 0.04, 1.5), glow), move(0, 2.46, 0)))


def test_rays_that_hit_a_surface_beside_a_lamp_are_no_fireflies(device):
    """Points on the lamp that are drawn by area bring light over distance squared: twenty times the lamp's own."""
    camera = Camera.look_at((0, 1, 1.9), (0, 0.9, -2), vertical_fov=np.radians(60))
    settings = pica.Settings().with_values({"debug.filters": False})  # without a cache of the light
    with pica.Renderer(room_below_a_tube(), size=(128, 72), settings=settings, device=device) as renderer:
        brightest = []
        for _ in range(32):
            renderer.advance(camera, capture=(RAYS,))
            brightest.append(renderer.captured[RAYS]().max())
    assert max(brightest) < 6 * LAMP
