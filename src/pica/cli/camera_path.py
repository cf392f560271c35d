"""Motion of the camera in a film: a turntable, or a path from a file."""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pica.errors import PicaError, SceneError, shown

if TYPE_CHECKING:
    from pica import Camera

ROUND = 8.0
"""Default duration of a turntable in seconds."""
_FOV = 45.0
_LARGEST_FILE = 100_000_000
"""Bytes."""


@dataclass(frozen=True)
class CameraPath:
    """Positions and targets of a camera at some times; smooth in between."""

    times: tuple[float, ...]
    """Seconds, ascending."""
    places: tuple[tuple[float, ...], ...]
    """At each time: eye and target in metres, and the vertical field of view in degrees."""

    def at(self, time: float) -> "Camera":
        """The camera at a time, in seconds; constant before the first and after the last."""
        import numpy as np

        import pica

        times, places = np.array(self.times), np.array(self.places)
        place = places[0]
        if len(times) > 1:
            # Cubic Hermite interpolation with slopes from the neighbours; Catmull-Rom's where times are even.
            slopes = np.gradient(places, times, axis=0)
            time = min(max(time, times[0]), times[-1])
            after = min(max(int(np.searchsorted(times, time)), 1), len(times) - 1)
            length = times[after] - times[after - 1]
            t = (time - times[after - 1]) / length
            place = (
                (1 + 2 * t) * (1 - t) ** 2 * places[after - 1]
                + t * (1 - t) ** 2 * length * slopes[after - 1]
                + t * t * (3 - 2 * t) * places[after]
                + t * t * (t - 1) * length * slopes[after]
            )
        camera = pica.Camera.look_at(place[:3], place[3:6])
        return replace(camera, vertical_fov=math.radians(min(max(place[6], 1e-3), 179.0)))


def read_camera_path(path: Path) -> CameraPath:
    """The path in a JSON file: [{"time": 0, "eye": [x, y, z], "target": [x, y, z], "fov": 45}, ...].

    Raises PicaError, one line that names the file and the place in it.
    """
    from pica.files import open_file, read
    from pica.scene.values import checked, number, vector

    with open_file(path, str(path)) as file:
        content = read(file, _LARGEST_FILE, str(path))
    try:
        entries = json.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError):
        raise PicaError(f"{path}: is no JSON") from None
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise PicaError(f'{path}: is not a list such as [{{"time": 0, "eye": [0, 1, 3], "target": [0, 0, 0]}}, ...]')

    def value(index: int, name: str, check: Any) -> Any:
        return checked(f"{path}: [{index}].{name}", check, entries[index].get(name))

    times, places = [], []
    for index, entry in enumerate(entries):
        if unknown := entry.keys() - {"time", "eye", "target", "fov"}:
            raise PicaError(f"{path}: [{index}]: {shown(min(unknown))} is none of time, eye, target and fov")
        times.append(value(index, "time", number()))
        if index and times[-1] <= times[-2]:
            raise PicaError(f"{path}: [{index}].time: {times[-1]:g} is not after the time before, {times[-2]:g}")
        fov = value(index, "fov", number(1e-3, 179)) if "fov" in entry else _FOV
        places.append((*value(index, "eye", vector(3)), *value(index, "target", vector(3)), fov))
    camera_path = CameraPath(tuple(times), tuple(places))
    for index, time in enumerate(times):
        try:
            camera_path.at(time)
        except SceneError as error:
            raise PicaError(f"{path}: [{index}]: {error}") from None
    return camera_path
