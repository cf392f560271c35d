"""The mouse and the keys that move the camera of a window."""

import math
from typing import Any

import numpy as np
import slangpy as spy

from pica.viewer.camera_control import CameraControl
from pica.viewer.resolution import Size

_CLICK = 4.0
"""Pixels that the mouse may move between press and release of a click."""
_STEP = 0.9
"""Factor of the distance to the pivot for one step of the wheel."""
_KEYS = {
    spy.KeyCode.d: (1, 0, 0),
    spy.KeyCode.a: (-1, 0, 0),
    spy.KeyCode.e: (0, 1, 0),
    spy.KeyCode.q: (0, -1, 0),
    spy.KeyCode.w: (0, 0, 1),
    spy.KeyCode.s: (0, 0, -1),
}
"""Directions to the right, up and forward."""


class CameraInput:
    """Orbits with the left button, pans with the others, dollies with the wheel, and flies with W, A, S, D, Q, E."""

    def __init__(self) -> None:
        self._button: spy.MouseButton | None = None
        """That is held down."""
        self._at = np.zeros(2)
        """Where the mouse was last, in pixels."""
        self._moved = 0.0
        """Pixels since the button was pressed."""
        self._held: set[spy.KeyCode] = set()

    @property
    def is_active(self) -> bool:
        """Whether a button or a key of flight is held down."""
        return self._button is not None or bool(self._held)

    def mouse(self, event: "spy.MouseEvent | Any", size: Size, control: CameraControl) -> tuple[float, float] | None:
        """Follow an event in a window of (width, height) in pixels. For a click the place, 0 to 1 from the upper left
        to the lower right corner."""
        at = np.array([event.pos.x, event.pos.y])
        if event.is_scroll():
            control.dolly(_STEP**event.scroll.y)
        elif event.is_button_down() and self._button is None:
            self._button, self._at, self._moved = event.button, at, 0.0
        elif event.is_move() and self._button is not None:
            self._drag((at - self._at) / size[1], control)
            self._moved += float(np.abs(at - self._at).sum())
            self._at = at
        elif event.is_button_up() and event.button == self._button:
            is_click = self._button == spy.MouseButton.left and self._moved < _CLICK
            self._button = None
            return (at[0] / size[0], at[1] / size[1]) if is_click else None
        return None

    def press(self, key: spy.KeyCode) -> None:
        """A key goes down."""
        if key in _KEYS:
            self._held.add(key)

    def release(self, key: spy.KeyCode) -> None:
        """A key goes up."""
        self._held.discard(key)

    def fly(self, seconds: float, control: CameraControl) -> None:
        """Let so much time pass: in a second the camera moves as far as its pivot is away."""
        direction = np.sum([_KEYS[key] for key in self._held], axis=0) if self._held else np.zeros(3)
        if direction.any():
            control.fly(*(direction * control.distance * seconds))

    def _drag(self, moved: "np.ndarray[Any, Any]", control: CameraControl) -> None:
        """By fractions of the window's height, to the right and down: the scene goes with the mouse."""
        right, down = moved.tolist()
        if self._button == spy.MouseButton.left:
            control.orbit(-math.pi * right, math.pi * down)
        else:
            control.pan(-right, down)
