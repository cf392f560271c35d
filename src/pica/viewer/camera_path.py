"""A path of cameras, recorded by hand, for `pica render --camera-path`."""

import json
import math
from typing import Any

from pica.viewer.camera_control import CameraControl

SECONDS = 2.0
"""Between two cameras."""


class RecordedPath:
    """Cameras in the order in which they were added; a film goes from each to the next."""

    def __init__(self) -> None:
        self._entries: list[dict[str, Any]] = []

    def __len__(self) -> int:
        return len(self._entries)

    def add(self, control: CameraControl) -> None:
        """Add the camera where it is. Its pivot is the target."""
        self._entries.append(
            {
                "time": SECONDS * len(self._entries),
                "eye": control.camera.transform[:3, 3].tolist(),
                "target": control.pivot.tolist(),
                "fov": math.degrees(control.camera.vertical_fov),
            }
        )

    def clear(self) -> None:
        """Forget all of them."""
        self._entries = []

    def file(self) -> bytes:
        """The content of the JSON file."""
        return json.dumps(self._entries, indent=1).encode()
