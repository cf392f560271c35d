"""What a ball leaves behind where it has been."""

import math

import numpy as np

import pica
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, uniform


def trail_of(device: Device, material: Material, settings: pica.Settings) -> float:
    """The fraction of pixels that a ball has passed in 20 frames, before a wall at rest, and that are off by a tenth of
    the mean."""
    wall = placed(plane(5, 3, lambert(0.3, 0.45, 0.7)), move(0, 1, -0.8) @ rotate("x", 90))
    ball = placed(sphere(0.2, material, 32))
    scene = scene_of(wall, ball, environment=uniform(0.5, 0.5, 0.5))
    camera = Camera.look_at((0, 1, 3), (0, 1, 0), vertical_fov=math.radians(30))
    with pica.Renderer(scene, size=(96, 60), settings=settings, device=device) as renderer:
        for frame in range(20):
            ball.transform = move(0.05 * frame - 0.5, 1, 0)
            picture = renderer.render(1, camera=camera).color
        renderer.reset()
        expected = renderer.render(24, camera=camera).color
    left = np.abs(picture - expected)[:, :40].max(-1) > 0.1 * expected.mean()
    return float(left.mean())
