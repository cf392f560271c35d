"""Cameras: position, orientation and projection."""

import itertools
import math
from dataclasses import KW_ONLY, dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.names import checked_names
from pica.scene.arrays import LARGEST_SIDE, affine, doubles
from pica.scene.checked_field import CheckedField, ReadOnlyCopies, described
from pica.scene.values import UnfitError, angle, checked, choice, number, optional, positive, text, vector, whole

_FRAMING_DIRECTION = np.array([0.45, 0.35, 1.0])
_FRAMING_SHARE = 0.9
"""Of the picture that a framed box may fill."""
_WIDEST = math.radians(100.0)
"""Of the views that `framing` uses if there is no room to move back."""


_NARROWEST = 1e-6
"""Radians of a field of view; less is nothing in 32-bit floats."""
_FOV = angle(_NARROWEST, math.pi - _NARROWEST)
_MOST_BLADES = 64
_MATRIX, _POINT = doubles(4, 4), doubles(3)
_MIDDLE = (0.5, 0.5)
Convention = Literal["opencv", "opengl"]
"""Conventions of camera axes: "opencv" looks along +Z with +Y down, "opengl" along -Z with +Y up."""
_CONVENTION = choice("opencv", "opengl")
_TO_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])


def _size(value: Any) -> tuple[int, int]:
    """Width and height of a picture."""
    one = whole(1, LARGEST_SIDE)
    width, height = vector(2)(value)
    return one(width if width % 1 else int(width)), one(height if height % 1 else int(height))


def _blades(value: Any) -> int:
    """Sides of an aperture."""
    count = whole(0, _MOST_BLADES)(value)
    if count in (1, 2):
        raise UnfitError(f"{count} blades are no aperture: 0 is round, 3 a triangle")
    return count


def _rigid(matrix: ArrayLike) -> NDArray[np.float64]:
    """A copy of a (4, 4) rigid matrix, which may mirror."""
    kept = _MATRIX(matrix).copy()
    affine(kept)
    axes = kept[:3, :3]
    if not np.abs(axes.T @ axes - np.eye(3)).max() <= 1e-3:
        raise UnfitError("is not rotation and translation alone")
    return kept


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Camera(ReadOnlyCopies):
    """A camera in the world. It looks along its own -Z, +Y up, as in glTF.

    Raises SceneError for values that are not finite or out of range.
    """

    transform: CheckedField[NDArray[np.float64]] = CheckedField(_rigid)
    """(4, 4) camera to world, rotation and translation only."""
    _: KW_ONLY
    vertical_fov: CheckedField[float] = CheckedField(_FOV, math.radians(45.0))
    """Radians from the lower to the upper edge of a picture with the axis in its middle, between 0 and pi; ignored when
    orthographic_height is set."""
    near: CheckedField[float] = CheckedField(number(0), 0.01)
    """Near distance in metres along the view axis; above 0 unless orthographic_height is set."""
    far: CheckedField[float] = CheckedField(positive(), 1e4)
    """Metres; only an orthographic camera's depth uses it, a perspective one has no far plane."""
    orthographic_height: CheckedField[float | None] = CheckedField(optional(positive()), None)
    """Metres from the lower to the upper edge of an orthographic view; None: perspective."""
    principal_point: CheckedField[tuple[float, float]] = CheckedField(vector(2), _MIDDLE)
    """The principal point: fractions of the picture's width and height, from its upper left corner."""
    pixel_aspect: CheckedField[float] = CheckedField(positive(), 1.0)
    """Width of a pixel over its height."""
    f_number: CheckedField[float | None] = CheckedField(optional(positive()), None)
    """Focal length over the diameter of the aperture, such as 2.8; None: all is in focus."""
    focus_distance: CheckedField[float | None] = CheckedField(optional(positive()), None)
    """Metres along the view axis at which all is in focus; needed with f_number."""
    sensor_height: CheckedField[float] = CheckedField(positive(), 0.024)
    """Metres; with the field of view it gives the focal length. Without effect unless f_number is set."""
    aperture_blades: CheckedField[int] = CheckedField(_blades, 0)
    """Sides of the aperture, a regular polygon with a corner on top; 0: it is round."""
    name: CheckedField[str] = CheckedField(text, "")

    def __post_init__(self) -> None:
        if self.orthographic_height is None and not self.near:
            raise SceneError(f"{described(self)}: near: is 0; a perspective camera's is above it")
        if self.orthographic_height is not None and not self.near < self.far:
            raise SceneError(f"{described(self)}: near: {self.near:g} does not lie before far, {self.far:g}")
        if self.f_number is not None and self.orthographic_height is not None:
            raise SceneError(f"{described(self)}: f_number: an orthographic camera has no aperture")
        if self.f_number is not None and self.focus_distance is None:
            raise SceneError(f"{described(self)}: f_number: needs a focus_distance")

    @property
    def half_height(self) -> float:
        """Half the picture's height: in metres if orthographic, else at distance 1."""
        return math.tan(self.vertical_fov / 2) if self.orthographic_height is None else self.orthographic_height / 2

    @property
    def focal_length(self) -> float:
        """Metres, of a lens with this field of view on a sensor of sensor_height; focusing does not change it."""
        return self.sensor_height / (2 * self.half_height)

    @property
    def aperture_radius(self) -> float:
        """Metres: half the focal length over f_number; 0 if all is in focus."""
        return 0.0 if self.f_number is None else self.focal_length / (2 * self.f_number)

    def focused_on(self, point: ArrayLike, f_number: float) -> "Camera":
        """A copy with this f-number that is in focus at a point, (3,) metres. Raises SceneError for one behind it."""
        position = checked(f"{described(self)}: point", _POINT, point)
        distance = -self.transform[:3, 2] @ (position - self.transform[:3, 3])
        if not distance > 0:
            raise SceneError(f"{described(self)}: point: is not in front of the camera")
        return replace(self, f_number=f_number, focus_distance=float(distance))

    def reach(self, aspect: float) -> tuple[float, float]:
        """How far a picture of that width over height reaches from the view axis, sideways and up or down, as far as it
        does in either direction; units of half_height."""
        x, y = (1 + abs(2 * at - 1) for at in self.principal_point)
        return self.half_height * aspect * self.pixel_aspect * x, self.half_height * y

    def intrinsics(self, size: tuple[int, int]) -> NDArray[np.float64]:
        """(3, 3) the matrix K of a picture of `size`, (width, height) in pixels, as OpenCV has it.

        K [R|t] maps points of the world to column and row; [R|t] is the inverse of `pose("opencv")`. Whole numbers
        are pixel centres: (0, 0) is that of the upper left pixel. Raises SceneError for an orthographic camera.
        """
        width, height = checked(f"{described(self)}: size", _size, size)
        if self.orthographic_height is not None:
            raise SceneError(f"{described(self)}: intrinsics: an orthographic camera has none")
        focal = height / (2 * self.half_height)
        x, y = self.principal_point
        return np.array([[focal / self.pixel_aspect, 0, x * width - 0.5], [0, focal, y * height - 0.5], [0, 0, 1]])

    def pose(self, convention: Convention) -> NDArray[np.float64]:
        """(4, 4) camera to world, for a camera that looks along +Z with +Y down ("opencv") or -Z with +Y up ("opengl").

        The world is pica's, +Y up, either way. Raises SceneError for another convention.
        """
        opencv = checked(f"{described(self)}: convention", _CONVENTION, convention) == "opencv"
        return self.transform @ _TO_OPENCV if opencv else self.transform.copy()

    @staticmethod
    def from_intrinsics(
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        size: tuple[int, int],
        pose: ArrayLike,
        *,
        convention: Convention = "opencv",
        near: float = 0.01,
        name: str = "",
    ) -> "Camera":
        """A calibrated camera without distortion, for pictures of `size`, (width, height) in pixels.

        `fx`, `fy`: focal lengths in pixels. `cx`, `cy`: principal point, column and row; whole
        numbers are pixel centres, as in OpenCV. If a file counts from the picture's corner instead, as
        COLMAP does, subtract 0.5 from both. `pose`: (4, 4) camera to world, with the axes of `convention`: the inverse
        of OpenCV's [R|t]. Raises SceneError for non-finite numbers, numbers not above 0, or poses that are not rigid.
        """
        camera = f"camera {shown(checked('camera: name', text, name))}"
        width, height = checked(f"{camera}: size", _size, size)
        focal = [checked(f"{camera}: {axis}", positive(), value) for axis, value in (("fx", fx), ("fy", fy))]
        middle = [checked(f"{camera}: {axis}", number(), value) for axis, value in (("cx", cx), ("cy", cy))]
        placed = checked(f"{camera}: pose", _rigid, pose)
        opencv = checked(f"{camera}: convention", _CONVENTION, convention) == "opencv"
        return Camera(
            placed @ _TO_OPENCV if opencv else placed,
            vertical_fov=2 * math.atan(height / (2 * focal[1])),
            near=near,
            principal_point=((middle[0] + 0.5) / width, (middle[1] + 0.5) / height),
            pixel_aspect=focal[1] / focal[0],
            name=name,
        )

    @staticmethod
    def look_at(
        eye: ArrayLike,
        target: ArrayLike,
        *,
        vertical_fov: float = math.radians(45.0),
        up: ArrayLike = (0.0, 1.0, 0.0),
        name: str = "",
        near: float = 0.01,
    ) -> "Camera":
        """A perspective camera at `eye` that looks at `target`; `vertical_fov` in radians.

        `up` points up in the picture; if it is parallel to the view, another direction is chosen. Raises SceneError if
        eye and target coincide, vertical_fov is not between 0 and pi, or a value is not finite.
        """
        camera = f"camera {shown(checked('camera: name', text, name))}"
        eye_point, target_point = checked(f"{camera}: eye", _POINT, eye), checked(f"{camera}: target", _POINT, target)
        upward = checked(f"{camera}: up", _POINT, up)
        backward = eye_point - target_point
        distance = np.linalg.norm(backward)
        if not distance > 0:
            raise SceneError(f"{camera}: eye and target are the same point {tuple(eye_point.tolist())}")
        vertical_fov = checked(f"{camera}: vertical_fov", _FOV, vertical_fov)
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
        return Camera(transform=transform, vertical_fov=vertical_fov, name=name, near=near)

    @staticmethod
    def framing(
        low: ArrayLike,
        high: ArrayLike,
        *,
        aspect: float,
        vertical_fov: float = math.radians(40.0),
        farthest: float | None = None,
    ) -> "Camera":
        """A camera that shows the whole box from `low` to `high`, slightly from above and from the right.

        `aspect` is the picture's width over its height, `vertical_fov` in radians. `farthest`: metres from the
        box's middle at most; where that is too near, the view is wider, up to 100 degrees, even if that leaves corners
        out. Raises SceneError as look_at does.
        """
        box = [checked(f"camera 'framing': {name}", _POINT, corner) for name, corner in (("low", low), ("high", high))]
        aspect = checked("camera 'framing': aspect", positive(), aspect)
        vertical_fov = checked("camera 'framing': vertical_fov", _FOV, vertical_fov)
        corners = np.array(list(itertools.product(*np.transpose(box))))
        center = corners.mean(0)
        radius = max(float(np.linalg.norm(corners[-1] - corners[0])) / 2, 1e-6)
        view = Camera.look_at(_FRAMING_DIRECTION, np.zeros(3)).transform[:3, :3]
        # In the camera's axes, a corner is inside the picture from the distance at which its slope is the edge's.
        offsets = (corners - center) @ view
        slope = math.tan(vertical_fov / 2) * _FRAMING_SHARE
        distance = max(
            float((np.abs(offsets[:, 0]) / (slope * aspect) + offsets[:, 2]).max()),
            float((np.abs(offsets[:, 1]) / slope + offsets[:, 2]).max()),
            radius * 1e-3,
        )
        farthest = checked("camera 'framing': farthest", optional(positive()), farthest)
        if farthest is not None and farthest < distance:
            distance = farthest
            depths = np.maximum(distance - offsets[:, 2], radius * 1e-3)
            slope = float((np.abs(offsets[:, :2]) / (aspect, 1) / depths[:, None]).max())
            vertical_fov = min(2 * math.atan(slope / _FRAMING_SHARE), max(vertical_fov, _WIDEST))
        eye = center + _FRAMING_DIRECTION / np.linalg.norm(_FRAMING_DIRECTION) * distance
        near = max((distance - radius) * 0.1, radius * 1e-3)
        return Camera.look_at(eye, center, vertical_fov=vertical_fov, name="framing", near=near)
