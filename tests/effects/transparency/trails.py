"""What a ball leaves behind where it has been."""

import math

import numpy as np
from numpy.typing import NDArray

import pica
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, uniform


def trail_of(device: Device, material: Material, settings: pica.Settings) -> float:
    """The fraction of pixels that a ball has passed in 20 frames, before a wall at rest, and that are off by a tenth of
    the mean."""
    picture, expected = passed_by(device, material, settings)
    left = np.abs(picture - expected)[:, :40].max(-1) > 0.1 * expected.mean()
    return float(left.mean())


def ghost_behind(device: Device, settings: pica.Settings, glass: Material) -> float:
    """What a ball that passes behind a block of glass at rest leaves where it was: its red, over the ball's own."""
    block = placed(box((3, 2, 0.3), glass), move(0, 1, 0.8))
    picture, expected = passed_by(device, lambert(0.9, 0.3, 0.2), settings, block)
    red, expected_red = (values[23:37, :, 0] - values[23:37, :, 2] for values in (picture, expected))
    ball = expected_red[5:9, 63:67].mean() - expected_red[:, :40].mean()
    return float((red - expected_red)[:, 28:54].mean() / ball)


def passed_by(device: Device, material: Material, settings: pica.Settings, *before: Node) -> tuple[NDArray, NDArray]:
    """The last of 20 frames in which a ball goes past a wall, and what it comes to at rest. `before`: what stands
    before the ball."""
    wall = placed(plane(5, 3, lambert(0.3, 0.45, 0.7)), move(0, 1, -0.8) @ rotate("x", 90))
    ball = placed(sphere(0.2, material, 32))
    scene = scene_of(wall, ball, *before, environment=uniform(0.5, 0.5, 0.5))
    camera = Camera.look_at((0, 1, 3), (0, 1, 0), vertical_fov=math.radians(30))
    with pica.Renderer(scene, size=(96, 60), settings=settings, device=device) as renderer:
        for frame in range(20):
            ball.transform = move(0.05 * frame - 0.5, 1, 0)
            picture = renderer.render(1, camera=camera).color
        renderer.reset()
        expected = renderer.render(24, camera=camera).color
    return picture, expected
