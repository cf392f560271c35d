"""Cameras: where one stands, where it looks and how wide it sees."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.scene.arrays import affine, doubles
from pica.scene.checked_field import CheckedField, described
from pica.scene.values import UnfitError, checked, number, optional, positive, text

_FRAMING_DIRECTION = np.array([0.45, 0.35, 1.0])
_FRAMING_SHARE = 0.9
"""Of the picture that a framed box may fill."""


_NARROWEST = 1e-6
"""Radians of a field of view; less is nothing in 32-bit floats."""
_FOV = number(_NARROWEST, math.pi - _NARROWEST)
_MATRIX, _POINT = doubles(4, 4), doubles(3)


def _degrees(value: float) -> float:
    """A field of view, in degrees."""
    found = number()(value)
    if not _NARROWEST <= math.radians(found) <= math.pi - _NARROWEST:
        raise UnfitError(f"{shown(found)} is not between 0 and 180 degrees")
    return found


def _rigid(matrix: ArrayLike) -> NDArray[np.float64]:
    """A copy of a (4, 4) matrix that turns and moves; mirrors may turn it over."""
    kept = _MATRIX(matrix).copy()
    affine(kept)
    axes = kept[:3, :3]
    if not np.abs(axes.T @ axes - np.eye(3)).max() <= 1e-3:
        raise UnfitError("is not rotation and translation alone")
    return kept


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera in the world. It looks along its own -Z, +Y up, as in glTF.

    Raises SceneError for what is not finite or out of its range.
    """

    transform: CheckedField[NDArray[np.float64]] = CheckedField(_rigid)
    """(4, 4) camera to world, rotation and translation only."""
    vertical_fov: CheckedField[float] = CheckedField(_FOV, math.radians(45.0))
    """Radians from the picture's lower to its upper edge, between 0 and pi; ignored when orthographic_height is set."""
    near: CheckedField[float] = CheckedField(number(0), 0.01)
    """Metres along the view axis before which nothing is seen; above 0 unless orthographic_height is set."""
    far: CheckedField[float] = CheckedField(positive(), 1e4)
    """Metres; only an orthographic camera's depth uses it, a perspective one sees for ever."""
    orthographic_height: CheckedField[float | None] = CheckedField(optional(positive()), None)
    """Metres from the lower to the upper edge of an orthographic view; None: perspective."""
    name: CheckedField[str] = CheckedField(text, "")

    def __post_init__(self) -> None:
        if self.orthographic_height is None and not self.near:
            raise SceneError(f"{described(self)}: near: is 0; a perspective camera's is above it")
        if self.orthographic_height is not None and not self.near < self.far:
            raise SceneError(f"{described(self)}: near: {self.near:g} does not lie before far, {self.far:g}")

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

        `up` points up in the picture; where it points along the view, another direction does. Raises SceneError when
        eye and target coincide, fov is not between 0 and 180, or anything is not finite.
        """
        camera = f"camera {shown(checked('camera: name', text, name))}"
        eye_point, target_point = checked(f"{camera}: eye", _POINT, eye), checked(f"{camera}: target", _POINT, target)
        upward = checked(f"{camera}: up", _POINT, up)
        backward = eye_point - target_point
        distance = np.linalg.norm(backward)
        if not distance > 0:
            raise SceneError(f"{camera}: eye and target are the same point {tuple(eye_point.tolist())}")
        degrees = checked(f"{camera}: fov", _degrees, fov)
        if not upward.any():
            raise SceneError(f"{camera}: up: has no length")
        backward /= distance
        upward = upward / np.abs(upward).max()
        right = np.cross(upward, backward)
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
        return Camera(transform=transform, vertical_fov=math.radians(degrees), name=name, near=near)

    @staticmethod
    def framing(low: ArrayLike, high: ArrayLike, aspect: float, fov: float = 40.0) -> "Camera":
        """A camera that shows the whole box from `low` to `high`, slightly from above and from the right.

        `aspect` is the picture's width over its height. Raises SceneError as look_at does.
        """
        box = [checked(f"camera 'framing': {name}", _POINT, corner) for name, corner in (("low", low), ("high", high))]
        aspect = checked("camera 'framing': aspect", positive(), aspect)
        fov = checked("camera 'framing': fov", _degrees, fov)
        corners = np.array(list(itertools.product(*np.transpose(box))))
        center = corners.mean(0)
        radius = max(float(np.linalg.norm(corners[-1] - corners[0])) / 2, 1e-6)
        view = Camera.look_at(_FRAMING_DIRECTION, np.zeros(3), fov).transform[:3, :3]
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
