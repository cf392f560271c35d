"""Cameras on an orbit, rotated in place, or moved ahead."""

import itertools
import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pica.scene.camera import Camera
from pica.scene.model import Scene

_SHARE = 0.95
"""Of the picture that a framed box may fill."""
_LEVEL = 1e-3
"""Length of the horizontal part of a direction, below which it is vertical."""


def pivot(scene: Scene, camera: Camera) -> NDArray[np.float64]:
    """(3,) centre of an orbit: the point on the camera's axis that is as far away as the scene's middle."""
    low, high = scene.subject_bounds()
    forward, eye = -camera.transform[:3, 2], camera.transform[:3, 3]
    depth = max(float(((low + high) / 2 - eye) @ forward), 0.1 * float(np.linalg.norm(high - low)))
    return eye + forward * depth


def orbited(camera: Camera, center: NDArray[np.float64], angle: float) -> Camera:
    """The camera rotated about the vertical axis through `center` (3,) by `angle` radians,
    counter-clockwise as seen from above."""
    rotation = np.eye(4)
    cosine, sine = math.cos(angle), math.sin(angle)
    rotation[:3, :3] = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    rotation[:3, 3] = center - rotation[:3, :3] @ center
    return replace(camera, transform=rotation @ camera.transform)


def turned(camera: Camera, angle: float) -> Camera:
    """The camera rotated about the vertical axis through itself by `angle` radians, in the direction of `orbited`."""
    return orbited(camera, camera.transform[:3, 3], angle)


def dollied(camera: Camera, distance: float) -> Camera:
    """The camera moved ahead by `distance` metres at constant height; a camera that looks straight up or down moves
    along its axis."""
    forward = -camera.transform[:3, 2]
    level = forward * (1, 0, 1)
    if np.linalg.norm(level) > _LEVEL:
        forward = level / np.linalg.norm(level)
    moved = camera.transform.copy()
    moved[:3, 3] += forward * distance
    return replace(camera, transform=moved)


def encloses(scene: Scene, camera: Camera) -> bool:
    """Whether the camera is inside the bounding box of the scene, where an orbit would go through its walls."""
    low, high = scene.bounds()
    eye = camera.transform[:3, 3]
    return bool(((low <= eye) & (eye <= high)).all())


def framing_all_round(low: NDArray[np.float64], high: NDArray[np.float64], aspect: float, steps: int = 64) -> Camera:
    """As Camera.framing, but far enough for the box to stay in the picture all the way round its middle."""
    camera = Camera.framing(low, high, aspect=aspect)
    center = (low + high) / 2
    corners = np.array(list(itertools.product(*np.transpose([low, high]))))
    slope = math.tan(camera.vertical_fov / 2) * _SHARE
    farther = 0.0
    for step in range(steps):
        view = orbited(camera, center, 2 * math.pi * step / steps).transform
        x, y, z = ((corners - view[:3, 3]) @ view[:3, :3]).T
        needed = np.maximum(np.abs(x) / (slope * aspect), np.abs(y) / slope) + z
        farther = max(farther, float(needed.max()))
    moved = camera.transform.copy()
    moved[:3, 3] += moved[:3, 2] * farther
    return replace(camera, transform=moved)
