"""Where the pictures of a data set are taken from: each place depends on the number of the picture alone."""

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from pica.errors import PicaError, SceneError, shown
from pica.files import open_file, read
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.orbit import orbited, pivot
from pica.scene.values import checked, number, vector

Cameras = str | Path | Sequence[Camera]
"""ORBIT, SPHERE, the name of a .csv file, or cameras."""
ORBIT, SPHERE = "orbit", "sphere"
STEP = 1 / 30
"""Seconds over which surfaces move in the motion of viewpoints that follow no path."""
_DISTANCES = 0.7, 1.3
"""Of the first camera's distance, the range of random ones."""
_LOWEST = 0.05
"""Of a sphere's radius, the least height of a camera above its centre."""
_LARGEST_FILE = 100_000_000
"""Bytes."""
_COLUMNS = ("eye_x", "eye_y", "eye_z", "target_x", "target_y", "target_z")
_OPTIONAL = ("fov", "time")


@dataclass(frozen=True)
class Moment:
    """A camera and the scene's time in seconds."""

    camera: Camera
    time: float


@dataclass(frozen=True)
class Viewpoint:
    """The moment of a picture, and the one before it, since which surfaces have moved."""

    now: Moment
    before: Moment


class Viewpoints(Protocol):
    """The viewpoints of a data set."""

    def at(self, number: int) -> Viewpoint:
        """The viewpoint of a picture, from 0."""


def viewpoints(
    cameras: Cameras, scene: Scene, size: tuple[int, int], count: int | None, seed: int, first: Camera | None = None
) -> Viewpoints:
    """`count` viewpoints of pictures of `size`; None for ever more. `first`: the camera of an orbit's first picture,
    whose distance a sphere has; None: the scene's default camera. Raises PicaError for fewer cameras than `count`, or a
    file that cannot be read."""
    if cameras in (ORBIT, SPHERE):
        first = first or scene.default_camera(size[0] / size[1])
    elif first is not None:
        raise PicaError("camera: is for orbits and spheres; the cameras are given")
    if cameras == ORBIT and first is not None:
        if count is None:
            raise PicaError("cameras: an orbit needs a count of pictures")
        return _Orbit(scene, first, count)
    if cameras == SPHERE and first is not None:
        return _Sphere(scene, first, seed)
    if isinstance(cameras, str | Path):
        if Path(cameras).suffix.lower() != ".csv":
            raise PicaError(f"cameras: {shown(str(cameras))} is neither orbit nor sphere nor the name of a .csv file")
        moments, name = read_cameras(Path(cameras)), str(cameras)
    else:
        given = list(cameras)
        for camera in given:
            if not isinstance(camera, Camera):
                raise PicaError(f"cameras: {shown(camera)} is not a Camera")
        moments, name = [Moment(camera, 0.0) for camera in given], "cameras"
    if count is None or len(moments) < count:
        wanted = "pictures without end" if count is None else f"{count} pictures"
        raise PicaError(f"{name}: there are {len(moments)} cameras for {wanted}")
    return _Listed(moments)


class _Listed:
    def __init__(self, moments: list[Moment]) -> None:
        self._moments = moments

    def at(self, number: int) -> Viewpoint:
        return Viewpoint(self._moments[number], self._moments[max(number - 1, 0)])


class _Orbit:
    """Once round what the first camera looks at, while the animations play once."""

    def __init__(self, scene: Scene, first: Camera, count: int) -> None:
        self._camera, self._center = first, pivot(scene, first)
        self._count, self._duration = count, _duration(scene)

    def at(self, number: int) -> Viewpoint:
        return Viewpoint(self._moment(number), self._moment(number - 1))

    def _moment(self, number: int) -> Moment:
        turned = orbited(self._camera, self._center, 2 * math.pi * number / self._count)
        return Moment(turned, self._duration * max(number, 0) / self._count)


class _Sphere:
    """Random places on the upper half of a sphere about what the first camera looks at, at random times."""

    def __init__(self, scene: Scene, first: Camera, seed: int) -> None:
        self._camera, self._center = first, pivot(scene, first)
        self._distance = float(np.linalg.norm(self._camera.transform[:3, 3] - self._center))
        self._seed, self._duration = seed, _duration(scene)

    def at(self, number: int) -> Viewpoint:
        random = np.random.default_rng((self._seed, number))
        angle, height = random.uniform(0, 2 * math.pi), random.uniform(_LOWEST, 1)
        distance = self._distance * random.uniform(*_DISTANCES)
        time = random.uniform(0, self._duration)
        # Areas between parallels of a sphere are as their distance (Archimedes), so heights are uniform.
        across = math.sqrt(1 - height * height)
        direction = np.array([across * math.sin(angle), height, across * math.cos(angle)])
        placed = Camera.look_at(self._center + distance * direction, self._center)
        camera = replace(self._camera, transform=placed.transform)
        return Viewpoint(Moment(camera, time), Moment(camera, max(time - STEP, 0.0)))


def _duration(scene: Scene) -> float:
    return max((animation.duration for animation in scene.animations), default=0.0)


def read_cameras(path: Path) -> list[Moment]:
    """The cameras of a .csv file with a row of names: eye_x, eye_y, eye_z, target_x, target_y, target_z in metres, and
    perhaps fov in degrees, 45 without it, and time in seconds. Raises PicaError that names the file and the line."""
    with open_file(path, str(path)) as file:
        text = read(file, _LARGEST_FILE, str(path)).decode("utf-8-sig", "replace")
    rows = csv.DictReader(text.splitlines(), skipinitialspace=True)
    try:
        names = [name.strip() for name in rows.fieldnames or ()]
        rows.fieldnames = names
        if missing := [name for name in _COLUMNS if name not in names]:
            raise PicaError(f"{path}: line 1: no column {missing[0]}; there must be {', '.join(_COLUMNS)}")
        if unknown := [name for name in names if name not in (*_COLUMNS, *_OPTIONAL)]:
            raise PicaError(f"{path}: line 1: unknown column {shown(unknown[0])}; there may be {', '.join(_OPTIONAL)}")
        moments = [_moment(f"{path}: line {rows.line_num}", row) for row in rows]
    except csv.Error as error:
        raise PicaError(f"{path}: line {rows.line_num}: {error}") from None
    if not moments:
        raise PicaError(f"{path}: has no cameras")
    return moments


def _moment(where: str, row: dict[str, str]) -> Moment:
    values = {}
    for name in (*_COLUMNS, *_OPTIONAL):
        text = row.get(name) or {"fov": "45", "time": "0"}.get(name, "")
        try:
            values[name] = float(text)
        except ValueError:
            raise PicaError(f"{where}: {name}: {shown(text)} is not a number") from None
    eye, target = (checked(where, vector(3), [values[name] for name in part]) for part in (_COLUMNS[:3], _COLUMNS[3:]))
    fov = checked(f"{where}: fov", number(1e-3, 179), values["fov"])
    time = checked(f"{where}: time", number(-1e9, 1e9), values["time"])
    try:
        return Moment(Camera.look_at(eye, target, vertical_fov=math.radians(fov)), time)
    except SceneError as error:
        raise PicaError(f"{where}: {error}") from None
