"""Scenes and environments from the content of files that a page has sent."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from pica.errors import SceneError, shown
from pica.scene.environment import Environment
from pica.scene.limits import Budget, Limits
from pica.scene.loading import load, read_environment
from pica.scene.model import Scene

ENVIRONMENTS = (".hdr", ".exr", ".ktx2")
T = TypeVar("T")


def uploaded_scene(name: str, content: bytes, limits: Limits | None = None) -> Scene:
    """The scene of a .glb, which holds all that it needs. `name`: as the user knows the file. Raises SceneError."""
    return _read(name, content, (".glb",), lambda path: load(path, limits=limits))


def uploaded_environment(name: str, content: bytes, limits: Limits | None = None) -> Environment:
    """The environment of a .hdr, .exr or .ktx2. Raises SceneError."""
    return _read(name, content, ENVIRONMENTS, lambda path: read_environment(path, Budget(limits)))


def _read(name: str, content: bytes, suffixes: tuple[str, ...], read: Callable[[Path], T]) -> T:
    """Read the content as a file in a folder of its own, so that it can refer to no others."""
    suffix = Path(name).suffix.lower()
    if suffix not in suffixes:
        raise SceneError(f"{shown(name)}: the name must end in {' or '.join(suffixes)}")
    with TemporaryDirectory(prefix="pica-") as folder:
        path = Path(folder) / f"upload{suffix}"
        path.write_bytes(content)
        try:
            return read(path)
        except SceneError as error:
            raise SceneError(str(error).replace(str(path), shown(name))) from None
