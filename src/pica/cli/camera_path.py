"""The motion of a camera from a file."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pica.errors import PicaError, SceneError, shown

if TYPE_CHECKING:
    from pica.scene.camera_path import CameraPath

_FOV = 45.0
_LARGEST_FILE = 100_000_000
"""Bytes."""


def read_camera_path(path: Path) -> "CameraPath":
    """The path in a JSON file: [{"time": 0, "eye": [x, y, z], "target": [x, y, z], "fov": 45}, ...].

    Raises PicaError, one line that names the file and the place in it.
    """
    from pica.files import open_file, read
    from pica.scene.camera_path import CameraPath
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
