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

    A link stays, what it points to is replaced. What runs that were killed while they wrote have left in the folder is
    removed, whichever files it was for. Raises PicaError when the file cannot be written.
    """
    with _told(path):
        target = _regular(path)
        with _beside(target) as temporary:
            write(temporary)
            os.replace(temporary, target)


def check_writable(path: Path) -> None:
    """Raise now the PicaError of a later `write_whole`, where its folder or what is there already is to blame."""
    with _told(path), _beside(_regular(path)):
        pass


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Turns errors of the system and of the libraries that write into a PicaError that names the file."""
    try:
        yield
    except (OSError, RuntimeError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else first_line(error)
        raise PicaError(f"{path}: cannot be written ({reason})") from None


def _regular(path: Path) -> Path:
    """Where a link leads in the end. Raises PicaError for what no picture can replace: a folder, a device, a pipe."""
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
    """An empty file beside the target for the length of the block, locked where that can be done."""
    _remove_abandoned(target.parent)
    while True:
        temporary = target.with_name(f".{target.stem}.pica-{uuid4().hex[:8]}{target.suffix}")
        file = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        try:
            with _locked(file):
                if temporary.exists():  # else another process has taken it for abandoned before it was locked
                    yield temporary
                    return
        finally:
            temporary.unlink(missing_ok=True)


def _remove_abandoned(folder: Path) -> None:
    """Remove the temporary files of processes that were killed while they wrote."""
    with os.scandir(folder) as entries:
        left = [each.path for each in entries if _TEMPORARY.fullmatch(each.name) and each.is_file()]
    for path in left:
        # Not there any more, if another run was faster, or another user's.
        with suppress(OSError), _locked(os.open(path, os.O_WRONLY)) as abandoned:
            if abandoned:
                os.unlink(path)


if sys.platform == "win32":

    @contextmanager
    def _locked(file: int) -> Iterator[bool]:
        """Close an open file, which could not be renamed there, and tell nothing about other processes."""
        os.close(file)
        yield False

else:
    import fcntl

    @contextmanager
    def _locked(file: int) -> Iterator[bool]:
        """Hold an open file for this process, then close it; False where another holds it or there are no locks.

        The system lets go however a process ends, and knows processes of other containers, unlike numbers in names.
        """
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            held = True
        except OSError:
            held = False
        try:
            yield held
        finally:
            os.close(file)
