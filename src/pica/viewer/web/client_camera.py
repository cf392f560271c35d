"""Cameras of viser's clients, which they move themselves, and pica's.

viser's cameras look along +Z with +Y down (OpenCV), pica's along -Z with +Y up. Positions are the same, once viser's up
direction is +Y.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.scene.camera import Camera
from pica.viewer.camera_control import CameraControl
from pica.viewer.resolution import Size

if TYPE_CHECKING:
    import viser

_TO_OPENGL = np.diag([1.0, -1.0, -1.0])
_LEVEL = 1e-3
"""Height of the camera's right axis, below which it is upright."""


@dataclass(frozen=True)
class ClientPose:
    """The pose, lens and canvas of a client's camera, as its browser has sent them."""

    transform: NDArray[np.float64]
    """(4, 4) camera to world, with the axes of `Camera`."""
    vertical_fov: float
    """Radians."""
    target: NDArray[np.float64]
    """(3,) what it moves around."""
    canvas: Size
    """(width, height) of its picture on screen."""

    @staticmethod
    def of(camera: "viser.CameraHandle") -> "ClientPose | None":
        """What a client has sent; None if that is no camera."""
        canvas = camera.image_width, camera.image_height
        numbers = [*camera.wxyz, *camera.position, *camera.look_at, camera.fov]
        sound = np.isfinite(numbers).all() and np.linalg.norm(camera.wxyz) > 0 and 0 < camera.fov < math.pi
        if not sound or min(canvas) < 1:
            return None
        transform = np.eye(4)
        transform[:3, :3] = rotation_of(camera.wxyz) @ _TO_OPENGL
        transform[:3, 3] = camera.position
        return ClientPose(transform, float(camera.fov), np.array(camera.look_at, np.float64), canvas)

    def place(self, control: CameraControl) -> None:
        """Move the view's camera here."""
        control.place(self.transform, self.vertical_fov, self.target)


def show(control: CameraControl, camera: "viser.CameraHandle | viser.InitialCameraConfig | Any", up: str) -> None:
    """Move a client's camera to the view's, or that of new clients. `up`: the name of its up direction."""
    position, target = control.camera.transform[:3, 3], control.pivot
    camera.position = tuple(position.tolist())
    camera.look_at = tuple(target.tolist())
    setattr(camera, up, tuple(up_of(control.camera).tolist()))
    camera.fov = control.camera.vertical_fov


def up_of(camera: Camera) -> NDArray[np.float64]:
    """(3,) +Y for an upright camera, so that orbits stay level; else the camera's own."""
    upright = abs(camera.transform[1, 0]) < _LEVEL and camera.transform[1, 1] > 0
    return np.array([0.0, 1.0, 0.0]) if upright else camera.transform[:3, 1]


def rotation_of(wxyz: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) of a quaternion of any length, the real part first."""
    w, x, y, z = np.asarray(wxyz, np.float64) / np.linalg.norm(wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
