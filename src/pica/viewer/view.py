"""One look at the scene: a camera, a size, and how far its picture is."""

from typing import TYPE_CHECKING

from pica.viewer.camera_control import CameraControl
from pica.viewer.resolution import Resolution, Size

if TYPE_CHECKING:
    from pica.viewer.comparison import SplitPicture

_REST = 0.3
"""Seconds without any change after which nothing moves."""


class View:
    """One camera, the size of its pictures, and how far the picture of the current state is."""

    def __init__(self, control: CameraControl, size: Size) -> None:
        self.control = control
        self.resolution = Resolution(size)
        self.frames = 0
        """Of the current picture, so far."""
        self.state: object = None
        """Everything that the newest picture depends on."""
        self.parts: SplitPicture | None = None
        """The two pictures that the newest one is made of; None: it is one."""
        self._changed_at = float("-inf")

    def resize(self, size: Size) -> None:
        """Pictures of another (width, height) in pixels."""
        self.resolution.full = size
        self.control.aspect = size[0] / size[1]

    def follow(self, state: object, now: float) -> None:
        """Choose the size of the next picture, at `now` seconds: that of one in motion after a change of `state`, and
        finer ones at rest. What moves again waits for the picture under way: so each is to take less time than the rest
        has lasted."""
        if state != self.state:
            self.state, self._changed_at, self.frames = state, now, 0
            self.resolution.move()
        elif not self.resolution.is_full and now - self._changed_at > max(_REST, self.resolution.finer_seconds):
            self.resolution.rest()
            self.frames = 0
