"""The scene of the tests of pages, and what they see of it."""

import time

import numpy as np

import pica
from pica.scene.animation import Animation, Channel, Pose
from pica.scene.mesh import Mesh
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move
from tests.building import lambert, placed, scene_of, uniform

CANVAS = (96, 64)
CAMERA = pica.Camera.look_at((0, 1.5, 4), (0, 0.5, 0))


def scene() -> pica.Scene:
    """A red cube that may slide, on a grey floor."""
    cube = Node("cube", mesh=Mesh([box(1.0, lambert(0.8, 0.1, 0.1, name="red|paint"))], "cube"), pose=Pose())
    made = scene_of(placed(plane(20, 20, lambert(0.4)), name="floor"), cube, environment=uniform(1, 1, 1))
    times, places = np.array([0.0, 2.0]), np.array([[0, 0.5, 0], [2, 0.5, 0]])
    cube.transform = move(0, 0.5, 0)
    made.animations.append(Animation([Channel(cube, "translation", times, places)], name="slide"))
    return made


def is_whole(pixels: np.ndarray) -> bool:
    return pixels.shape == (64, 96, 3)


def redness(pixels: np.ndarray) -> np.ndarray:
    """(columns,) of red pixels, where the cube is."""
    red, green, blue = np.moveaxis(pixels.astype(int), -1, 0)
    return np.nonzero(red > 1.5 * np.maximum(green, blue) + 10)[1]


def until(condition, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)
