"""What user interfaces offer for a camera: buttons for moves, and inputs for its numbers."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pica.viewer.camera_control import CameraControl
from pica.viewer.viewer import Viewer


def camera_moves(viewer: Viewer) -> dict[str, Callable[[CameraControl], object]]:
    """What each does with a camera of the viewer, by the text of its button."""

    def focus(control: CameraControl) -> None:
        if (point := viewer.focus) is not None:
            control.focus(point)

    return {"Home": CameraControl.home, "Frame all": CameraControl.frame_all, "Focus what is selected": focus}


@dataclass(frozen=True)
class CameraNumbers:
    """Numbers of a camera that can be typed."""

    label: str
    get: Callable[[CameraControl], Any]
    """A number, or a tuple of three."""
    set: Callable[[CameraControl, Any], object]
    text: str


NARROWEST, WIDEST = 1.0, 170.0
"""Degrees of a field of view that can be typed."""


def camera_numbers() -> list[CameraNumbers]:
    """All of them."""
    return [
        CameraNumbers(
            "Position",
            lambda control: _rounded(control.camera.transform[:3, 3]),
            lambda control, value: control.look(value, control.pivot),
            "Where the camera is, in metres",
        ),
        CameraNumbers(
            "Target",
            lambda control: _rounded(control.pivot),
            lambda control, value: control.look(control.camera.transform[:3, 3], value),
            "What it looks at, and moves around, in metres",
        ),
        CameraNumbers(
            "Field of view",
            lambda control: round(math.degrees(control.camera.vertical_fov), 3),
            lambda control, value: control.widen(math.radians(min(max(value, NARROWEST), WIDEST))),
            "From the lower to the upper border, in degrees",
        ),
    ]


def _rounded(place: Any) -> tuple[float, ...]:
    return tuple(round(float(value), 4) for value in place)
