"""Files that are written whole or not at all."""

import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from pica.errors import PicaError
from pica.text import first_line

_TEMPORARY = re.compile(r"\..*\.pica-[0-9a-f]{8}(\.[^.]*)?", re.DOTALL)
"""Names of the files that are renamed once they are whole."""


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Have `write` make the file beside `path`, then rename it, so that a killed run leaves no half file.

    A link stays, and its target is replaced. Temporary files of killed runs in the folder are
    removed, for any target. Raises PicaError if the file cannot be written.
    """
    with _told(path):
        target = _regular(path)
        with _beside(target) as temporary:
            write(temporary)
            os.replace(temporary, target)


def check_writable(path: Path) -> None:
    """Raises the PicaError of a later `write_whole` now, if its folder or an existing file is the cause."""
    with _told(path), _beside(_regular(path)):
        pass


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Turns errors of the system and of libraries into a PicaError with the file's name."""
    try:
        yield
    except (OSError, RuntimeError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else first_line(error)
        raise PicaError(f"{path}: cannot be written ({reason})") from None


def _regular(path: Path) -> Path:
    """The final target of a link. Raises PicaError if no picture can replace it: a folder, a device, a pipe."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise PicaError(f"cannot write {path}: it is a folder")
    if target.is_symlink():
        raise PicaError(f"cannot write {path}: it is a link to itself")
    if target.exists() and not target.is_file():
        raise PicaError(f"cannot write {path}: it is a device or a pipe")
    return target


@contextmanager
def _beside(target: Path) -> Iterator[Path]:
    """An empty file beside the target for the length of the block, locked if possible."""
    _remove_abandoned(target.parent)
    while True:
        temporary = target.with_name(f".{target.stem}.pica-{uuid4().hex[:8]}{target.suffix}")
        file = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        try:
            with _locked(file, wait=True):  # another run may hold it, about to remove the file as abandoned
                if temporary.exists():  # it was not removed before it was locked
                    yield temporary
                    return
        finally:
            temporary.unlink(missing_ok=True)


def _remove_abandoned(folder: Path) -> None:
    """Remove the temporary files of processes that were killed while they wrote."""
    with os.scandir(folder) as entries:
        leftovers = [entry.path for entry in entries if _TEMPORARY.fullmatch(entry.name) and entry.is_file()]
    for path in leftovers:
        # Not there any more, if another run was faster, or another user's.
        with suppress(OSError), _locked(os.open(path, os.O_WRONLY)) as abandoned:
            if abandoned:
                os.unlink(path)


if sys.platform == "win32":

    @contextmanager
    def _locked(file: int, wait: bool = False) -> Iterator[bool]:
        """Close the file, because Windows cannot rename open ones; without a lock, other processes are unknown."""
        os.close(file)
        yield False

else:
    import fcntl

    @contextmanager
    def _locked(file: int, wait: bool = False) -> Iterator[bool]:
        """Lock an open file, then close it; False if another process or thread has it, or there are no locks.

        `wait`: until the other one is done. The system releases locks however a process ends, and they work across
        containers, unlike process ids in names.
        """
        try:
            fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
            held = True
        except OSError:
            held = False
        try:
            yield held
        finally:
            os.close(file)
