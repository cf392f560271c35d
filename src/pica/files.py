"""Opening files for reading, where a name may lead anywhere: to a pipe, a device, or out of a folder."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from pica.errors import SceneError

# A pipe without a writer must not block open(); Windows has neither of the first two, and needs the last.
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_DIRECTORY = getattr(os, "O_DIRECTORY", 0)
_STEPWISE = os.open in os.supports_dir_fd and os.stat in os.supports_dir_fd and _NO_LINK != 0


def open_file(path: Path, what: str, below: Path | None = None) -> BinaryIO:
    """Open a regular file for reading. Raises SceneError, with the name `what`; never blocks.

    `below`: a folder that contains `path`, which must be `resolved`. The opened file is in that folder, even
    if symbolic links are placed into its path meanwhile.
    """
    with _faults_as_scene_errors(what):
        descriptor = _open(path, None, _FLAGS) if below is None else _open_below(path, below)
        return os.fdopen(descriptor, "rb")


def resolved(path: Path, what: str) -> Path:
    """The path from the root, without "..", and with all symbolic links followed. Raises SceneError."""
    with _faults_as_scene_errors(what):
        return Path(os.path.realpath(path))


def read(file: BinaryIO, length: int, what: str) -> bytes:
    """The next `length` bytes of an open file, or fewer at its end. Raises SceneError, with the name `what`."""
    with _faults_as_scene_errors(what):
        return file.read(length)


def read_file(path: Path, what: str) -> bytes:
    """The content of a regular file. Raises SceneError, with the name `what`."""
    with open_file(path, what) as file:
        return read(file, size_of(file), what)


def size_of(file: BinaryIO) -> int:
    """Bytes of an open file."""
    return os.fstat(file.fileno()).st_size


@contextmanager
def _faults_as_scene_errors(what: str) -> Iterator[None]:
    try:
        yield
    except FileNotFoundError:
        raise SceneError(f"{what}: no such file") from None
    except OSError as error:
        raise SceneError(f"{what}: cannot be read ({error.strerror or error})") from None
    except ValueError:  # a NUL, or half of a surrogate pair
        raise SceneError(f"{what}: cannot be the name of a file") from None
    except MemoryError:
        raise SceneError(f"{what}: takes more memory than there is") from None


def _open(name: str | Path, folder: int | None, flags: int) -> int:
    """The descriptor of a regular file. Raises OSError."""
    # Checked before opening, since opening some devices has effects; and after, in case it has been replaced.
    _check_regular(os.stat(name, dir_fd=folder, follow_symlinks=not flags & _NO_LINK))
    descriptor = os.open(name, flags, dir_fd=folder)
    try:
        _check_regular(os.fstat(descriptor))
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _check_regular(status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        raise OSError(None, "it is a folder, not a file" if stat.S_ISDIR(status.st_mode) else "it is not a file")


def _open_below(path: Path, folder: Path) -> int:
    """The descriptor of a regular file that is reached from the folder without a symbolic link. Raises OSError."""
    if not _STEPWISE:
        return _open(path, None, _FLAGS)
    *folders, name = path.relative_to(folder).parts or (".",)
    at = os.open(folder, _FLAGS | _DIRECTORY)
    try:
        for part in folders:
            above, at = at, os.open(part, _FLAGS | _DIRECTORY | _NO_LINK, dir_fd=at)
            os.close(above)
        return _open(name, at, _FLAGS | _NO_LINK)
    finally:
        os.close(at)
