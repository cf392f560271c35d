"""The file of an asset, and other files that it names (2.8)."""

import os
from pathlib import Path, PureWindowsPath
from typing import BinaryIO
from urllib.parse import unquote

from pica.errors import SceneError, shown
from pica.files import open_file, read, resolved
from pica.scene.limits import Budget

_LONGEST_NAME = 4096
"""Characters, as many as Linux has bytes for a path."""


class AssetFiles:
    """Reads an asset's file, and files that it names: only regular ones, in its folder or below it.

    Its folder is that of the path as given, or that of the target of a symbolic link: in a cache
    of a model hub, links have the files' names and all contents are in one folder. `allow_outside` reads files from
    everywhere. The budget counts all reads.
    """

    def __init__(self, path: Path, budget: Budget, allow_outside: bool) -> None:
        self._path, self._budget, self._allow_outside = path, budget, allow_outside
        self._folders = resolved(path.parent, "the file"), resolved(path, "the file").parent

    def read_asset(self) -> bytes:
        """The asset's own file. Raises SceneError."""
        with open_file(self._path, "the file") as file:
            return self._content(file, -1, "the file")

    def read(self, uri: str, place: str, length: int = -1) -> bytes:
        """The first `length` bytes, all by default, of the file that a URI names. Raises SceneError, with `place`."""
        what, name = f"{place}: {shown(uri)}", unquote(uri)
        if len(name) > _LONGEST_NAME:
            raise SceneError(f"{what}: a name of {len(name)} characters is too long")
        windows = PureWindowsPath(name)
        if "://" in name or name.startswith(("/", "file:")) or windows.drive or windows.root or "\0" in name:
            raise SceneError(f"{what} is not a path relative to the file")
        with self._open(name, what) as file:
            return self._content(file, length, what)

    def read_relative(self, name: str, what: str) -> bytes:
        """The content of a file, by its path relative to the asset's folder. Raises SceneError."""
        with self._open(name, what) as file:
            return self._content(file, -1, what)

    def admit(self, name: str, what: str) -> None:
        """Check and count a file, by its path relative to the asset's folder, that a library is going to read. Raises
        SceneError."""
        with self._open(name, what) as file:
            status = os.fstat(file.fileno())
            try:
                self._budget.read_file((status.st_dev, status.st_ino), status.st_size)
            except SceneError as error:
                raise SceneError(f"{what}: {error}") from None

    def _open(self, name: str, what: str) -> BinaryIO:
        # A resolved path contains no links, so opening it without following any reaches the file that
        # was checked, even if the folder is changed in between.
        path = resolved(self._path.parent / name, what)
        if self._allow_outside:
            return open_file(path, what)
        for folder in self._folders:
            if path.is_relative_to(folder):
                return open_file(path, what, below=folder)
        raise SceneError(
            f"{what} lies outside the asset's folder; pica.load(…, allow_outside=True) or --allow-outside reads it"
        )

    def _content(self, file: BinaryIO, length: int, what: str) -> bytes:
        status = os.fstat(file.fileno())
        length = status.st_size if length < 0 else min(length, status.st_size)
        try:
            self._budget.read_file((status.st_dev, status.st_ino), length)
        except SceneError as error:
            raise SceneError(f"{what}: {error}") from None
        return read(file, length, what)
