"""Cameras: where one stands, where it looks and how wide it sees."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError

_FRAMING_DIRECTION = np.array([0.45, 0.35, 1.0])
_FRAMING_SHARE = 0.9
"""Of the picture that a framed box may fill."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera in the world. It looks along its own -Z, +Y up, as in glTF."""

    transform: NDArray[np.float64]
    """(4, 4) camera to world, rotation and translation only."""
    vertical_fov: float = math.radians(45.0)
    """Radians from the picture's lower to its upper edge; ignored when orthographic_height is set."""
    near: float = 0.01
    """Metres along the view axis before which nothing is seen."""
    far: float = 1e4
    """Metres; only an orthographic camera's depth uses it, a perspective one sees for ever."""
    orthographic_height: float | None = None
    """Metres from the lower to the upper edge of an orthographic view; None: perspective."""
    name: str = ""

    @staticmethod
    def look_at(
        eye: ArrayLike,
        target: ArrayLike,
        fov: float = 45.0,
        up: ArrayLike = (0.0, 1.0, 0.0),
        name: str = "",
        near: float = 0.01,
    ) -> "Camera":
        """A perspective camera at `eye` that looks at `target`; `fov` is vertical, in degrees.

        Raises SceneError when eye and target coincide or fov is not between 0 and 180.
        """
        eye_point, target_point = np.asarray(eye, np.float64), np.asarray(target, np.float64)
        backward = eye_point - target_point
        distance = np.linalg.norm(backward)
        if not distance > 0:
            raise SceneError(f"camera {name!r}: eye and target are the same point {tuple(eye_point)}")
        if not 0 < fov < 180:
            raise SceneError(f"camera {name!r}: field of view {fov} is not between 0 and 180 degrees")
        backward /= distance
        right = np.cross(np.asarray(up, np.float64), backward)
        if np.linalg.norm(right) < 1e-6:  # looking along up: any other axis will do
            right = np.cross((0.0, 0.0, -1.0) if abs(backward[1]) > 0.9 else (0.0, 1.0, 0.0), backward)
        right /= np.linalg.norm(right)
        transform = np.eye(4)
        transform[:3, 0], transform[:3, 1], transform[:3, 2], transform[:3, 3] = (
            right,
            np.cross(backward, right),
            backward,
            eye_point,
        )
        return Camera(transform=transform, vertical_fov=math.radians(fov), name=name, near=near)

    @staticmethod
    def framing(low: ArrayLike, high: ArrayLike, aspect: float, fov: float = 40.0) -> "Camera":
        """A camera that shows the whole box from `low` to `high`, slightly from above and from the right.

        `aspect` is the picture's width over its height.
        """
        corners = np.array(list(itertools.product(*np.transpose([low, high]))), np.float64)
        center = corners.mean(0)
        radius = max(float(np.linalg.norm(corners[-1] - corners[0])) / 2, 1e-6)
        view = Camera.look_at(center + _FRAMING_DIRECTION, center, fov).transform[:3, :3]
        # In the camera's axes, a corner is inside the picture from the distance at which its slope is the edge's.
        offsets = (corners - center) @ view
        slope = math.tan(math.radians(fov) / 2) * _FRAMING_SHARE
        distance = max(
            float((np.abs(offsets[:, 0]) / (slope * aspect) + offsets[:, 2]).max()),
            float((np.abs(offsets[:, 1]) / slope + offsets[:, 2]).max()),
            radius * 1e-3,
        )
        eye = center + _FRAMING_DIRECTION / np.linalg.norm(_FRAMING_DIRECTION) * distance
        return Camera.look_at(eye, center, fov, name="framing", near=max((distance - radius) * 0.1, radius * 1e-3))
