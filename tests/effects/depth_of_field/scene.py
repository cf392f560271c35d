"""Three balls in a row before a wall with small lamps: in front of the focus, in it, and behind it. All show their
colours as they are, so that pictures differ by what the lens does alone."""

import math

import numpy as np

import pica
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import checkered, placed, scene_of, uniform

FOCUS = 4.5
"""Metres to the middle ball."""


def plain(red: float, green: float, blue: float, **more) -> pica.Material:
    return pica.Material(base_color=(red, green, blue, 1.0), unlit=True, **more)


def row() -> pica.Scene:
    board = pica.Texture(checkered(cells=16))
    lamps = [
        placed(sphere(0.06, plain(1, 0.8, 0.5)), move(x, y, -5.8))
        for x in np.linspace(-3.5, 3.5, 6)
        for y in (1.0, 2.2)
    ]
    return scene_of(
        placed(sphere(0.45, plain(0.05, 0.02, 0.01, base_color_texture=board)), move(-0.75, 0.1, 2.2)),
        placed(sphere(0.45, plain(0.02, 0.06, 0.02, base_color_texture=board)), move(0.05, 0.1, 0)),
        placed(sphere(0.45, plain(0.01, 0.02, 0.06, base_color_texture=board)), move(1.2, 0.1, -2.5)),
        placed(plane(14, 14, plain(0.05, 0.05, 0.05, base_color_texture=board)), move(0, 0.5, -6) @ rotate("x", 90)),
        placed(plane(14, 14, plain(0.03, 0.03, 0.03, base_color_texture=board)), move(0, -0.35, 0)),
        *lamps,
        environment=uniform(0.05),
    )


def camera(f_number: float | None, focus: float = FOCUS, blades: int = 0) -> pica.Camera:
    """4.5 m in front of the middle ball."""
    at = pica.Camera.look_at((0, 0.5, FOCUS), (0, 0.35, 0), vertical_fov=math.radians(40))
    return pica.Camera(
        at.transform,
        vertical_fov=at.vertical_fov,
        f_number=f_number,
        focus_distance=focus,
        sensor_height=0.1,
        aperture_blades=blades,
    )
