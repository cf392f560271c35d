"""Noise of light in pictures whose surfaces are partly at rest."""

import numpy as np

import pica
from pica.scene.camera import Camera
from pica.scene.light import RectangleLight
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, shining, uniform

SIZE = (96, 64)
WALL = np.s_[14:50, 10:50]
"""Part of it in the picture, away from edges."""


def lamp(radiance, x, z):
    return shining(RectangleLight(radiance=radiance, width=0.8, height=0.8), move(x, 3.5, z) @ rotate("x", -90))


def noise_of_a_wall(device, speed):
    """Relative, of the 24th frame; a ball moves beside the wall, by so many metres a frame."""
    ball = placed(sphere(0.3, lambert(0.7, 0.2, 0.15)), move(0, 0.3, -0.6))
    scene = scene_of(
        placed(box((2.4, 3, 0.2), lambert(0.6)), move(-1.85, 1.5, 0)),
        placed(plane(8, 8, lambert(0.5))),
        placed(plane(8, 4, lambert(0.7)), move(0, 2, -3) @ rotate("x", 90)),
        ball,
        lamp(20, 0, -1.5),
        lamp(10, 1, 1.5),
        environment=uniform(0.2, 0.22, 0.25),
    )
    camera = Camera.look_at((0.5, 1.3, 3.2), (-0.4, 1.1, 0), vertical_fov=np.radians(40))
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        for frame in range(24):
            if speed:
                ball.transform = move(speed * frame, 0.3, -0.6)
            light = renderer.render(1, camera=camera).color.mean(axis=-1)
    around = np.pad(light, 2, mode="edge")
    shifted = [around[y : y + SIZE[1], x : x + SIZE[0]] for y in range(5) for x in range(5)]
    return (light / np.median(shifted, axis=0))[WALL].std()


def test_a_wall_at_rest_has_hardly_more_noise_while_something_moves_elsewhere(device):
    """A mean that is taken for changed where light is noisy begins anew, as a dark or bright speck."""
    assert noise_of_a_wall(device, 0.02) < 1.25 * noise_of_a_wall(device, 0)
