"""A camera that is moved by hand: around a point, sideways, towards it, or freely."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.frame.context import same_view
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.orbit import pivot

_STEEPEST = math.radians(89)
"""Of the view above or below the horizon in an orbit: at the pole there is no upright picture."""
_CLOSER = 0.5
"""Factor of the distance when a point is focused."""


class CameraControl:
    """The camera of one view, and the point that it moves around. Cameras are upright after an orbit."""

    def __init__(self, scene: Scene, aspect: float, camera: Camera | None = None) -> None:
        """`aspect`: width over height of the picture. `camera`: where it begins; None: the scene's default camera."""
        self._scene, self.aspect = scene, aspect
        self.first = camera or scene.default_camera(aspect)
        """The camera of `home`."""
        self.camera = self.first
        self.pivot = pivot(scene, self.camera)
        """(3,) metres: the centre of orbits, and of what is panned and dollied."""

    @property
    def distance(self) -> float:
        """Metres from the camera to the pivot."""
        return float(np.linalg.norm(self.pivot - self.camera.transform[:3, 3]))

    def orbit(self, right: float, up: float) -> None:
        """Move around the pivot, by radians to the right and up, as far as the poles."""
        eye, target = self.camera.transform[:3, 3], self.pivot
        x, y, z = eye - target
        radius = max(math.sqrt(x * x + y * y + z * z), 1e-9)
        azimuth = math.atan2(x, z) + right
        height = np.clip(math.asin(np.clip(y / radius, -1, 1)) + up, -_STEEPEST, _STEEPEST)
        level = math.cos(height)
        offset = np.array([level * math.sin(azimuth), math.sin(height), level * math.cos(azimuth)])
        self.look(target + radius * offset, target)

    def pan(self, right: float, up: float) -> None:
        """Move camera and pivot sideways, by fractions of the picture's height at the pivot."""
        height = 2 * self.camera.half_height
        if self.camera.orthographic_height is None:
            height *= self.distance
        self._shift(self.camera.transform[:3, :2] @ np.array([right, up]) * height)

    def dolly(self, factor: float) -> None:
        """Multiply the distance to the pivot, or the height of an orthographic picture."""
        if self.camera.orthographic_height is not None:
            self.camera = replace(self.camera, orthographic_height=self.camera.orthographic_height * factor)
            return
        moved = self.camera.transform.copy()
        moved[:3, 3] = self.pivot + (moved[:3, 3] - self.pivot) * factor
        self.camera = replace(self.camera, transform=moved)

    def fly(self, right: float, up: float, forward: float) -> None:
        """Move camera and pivot along the camera's axes, by metres."""
        self._shift(self.camera.transform[:3, :3] @ np.array([right, up, -forward]))

    def focus(self, point: ArrayLike) -> None:
        """Look at a point (3,), such as `Picked.position`, from half of its distance; it becomes the pivot."""
        target = np.asarray(point, np.float64)
        eye = self.camera.transform[:3, 3]
        self.look(target + (eye - target) * _CLOSER, target)

    def frame_all(self) -> None:
        """Show the whole scene, as it is now."""
        low, high = self._scene.subject_bounds()
        self.take(Camera.framing(low, high, aspect=self.aspect))
        self.pivot = (low + high) / 2

    def home(self) -> None:
        """Go back to the first camera."""
        self.take(self.first)

    def take(self, camera: Camera) -> None:
        """Another camera, such as one of the scene's."""
        self.camera = camera
        self.pivot = pivot(self._scene, camera)

    def place(self, transform: ArrayLike, vertical_fov: float, target: ArrayLike) -> None:
        """A pose (4, 4), camera to world with the axes of `Camera`, a field of view in radians and a pivot (3,), from a
        user interface that moves its camera itself. The rest of the lens stays."""
        placed = replace(self.camera, transform=np.asarray(transform, np.float64), vertical_fov=vertical_fov)
        self.pivot = np.asarray(target, np.float64)
        if not same_view(placed, self.camera):
            self.camera = placed

    def look(self, eye: ArrayLike, target: ArrayLike) -> None:
        """Look from one point (3,) at another, which becomes the pivot, upright, with the lens as it is."""
        start, end = np.asarray(eye, np.float64), np.asarray(target, np.float64)
        if np.linalg.norm(start - end) > 0:
            self.camera = replace(self.camera, transform=Camera.look_at(start, end).transform)
        self.pivot = end

    def widen(self, vertical_fov: float) -> None:
        """Another field of view, in radians."""
        self.camera = replace(self.camera, vertical_fov=vertical_fov)

    def _shift(self, offset: NDArray[np.float64]) -> None:
        moved = self.camera.transform.copy()
        moved[:3, 3] += offset
        self.camera, self.pivot = replace(self.camera, transform=moved), self.pivot + offset
