"""The folder of caches between runs, for SlangPy and for Mesa.

    slangpy-VERSION/shaders    what Slang-RHI makes of programs, a database
    slangpy-VERSION/modules    compiled Slang modules
    slangpy-VERSION/compiled   which programs are here (compiled_programs.py)
    mesa                       machine code that lavapipe makes of both
    vectors-128                all these for vectors of so many bits, where LP_NATIVE_VECTOR_WIDTH asks for them

If that folder is read-only, a private copy is used until the process ends, so that its content
is of use; if that is impossible too, there is no cache: starts are slow then, and nothing else.
"""

import atexit
import os
import shutil
import sys
import tempfile
import warnings
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

from pica.caches.shader_database import mend

if sys.platform != "win32":
    import resource

MODULES, SHADERS = (Path(f"slangpy-{version('slangpy')}", name) for name in ("modules", "shaders"))
MESA = Path("mesa")
"""Places in the folder."""
COMPILED = SHADERS.with_name("compiled")
"""A file in the folder."""
_ASKED = "PICA_CACHE"
_MESA_FOLDER = "MESA_SHADER_CACHE_DIR"
LONGEST = 128 << 20
"""Bytes of a file that must be possible: SlangPy's own limit of the one that shaders lie in, which is mapped too."""
_NEEDED = 16  # MiB that must be free: files that are mapped into memory end the process when a disk is full


def cache_folder() -> Path | None:
    """The configured folder, by PICA_CACHE or the system's default; None for a user without a home."""
    if os.environ.get(_ASKED):
        return Path(os.environ[_ASKED]).absolute()
    try:
        if sys.platform == "win32":
            return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "pica" / "cache"
        if sys.platform == "darwin":
            return Path.home() / "Library" / "Caches" / "pica"
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").absolute() / "pica"
    except RuntimeError:
        return None


def caches() -> Path | None:
    """The folder in use, with all its places: the configured one, a private copy or, with one warning, an empty
    private one; None: no place."""
    asked = cache_folder()
    folder = _usable(asked and _for_vectors(asked))
    if folder is not None:
        os.environ.setdefault(_MESA_FOLDER, str(folder / MESA))  # the driver reads it when a device is opened
    return folder


def _for_vectors(folder: Path) -> Path:
    """Neither Mesa nor Slang-RHI tells programs for vectors of one width from others, on which a process crashes."""
    width = os.environ.get("LP_NATIVE_VECTOR_WIDTH")
    name = f"vectors-{width}"
    return folder / name if width and folder.name != name else folder


@cache
def _usable(asked: Path | None) -> Path | None:
    fault = _fault(asked) if asked else "this user has no home"
    if not fault:
        return asked
    folder = _private()
    if asked and folder and _copy(asked, folder):
        return folder
    warnings.warn(
        f"compiled shaders cannot be kept{f' in {asked}' if asked else ''} ({fault}); "
        f"{f'{folder} stands in until the process ends' if folder else 'nor anywhere else'}, so starts are slow. "
        f"{_ASKED} in the environment can name another folder",
        stacklevel=3,
    )
    return folder


def _fault(folder: Path) -> str | None:
    """Why the places in a folder, made where they are not there, cannot be used; None: they can."""
    if longest_file() < LONGEST:
        return f"files may have {longest_file() >> 20} MiB here (ulimit -f), and {LONGEST >> 20} are needed"
    try:
        for place in (MODULES, SHADERS, MESA):
            (folder / place).mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder / place).close()  # only an attempt detects read-only file systems
        mend(folder / SHADERS)
        free = shutil.disk_usage(folder).free >> 20
    except OSError as error:
        return error.strerror or str(error)
    return None if free >= _NEEDED else f"{free} MiB are free, and {_NEEDED} are needed"


def longest_file() -> int:
    """Bytes that a file of this process may have: a write beyond the limit to one that is mapped ends the process."""
    if sys.platform == "win32":
        return sys.maxsize
    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    return sys.maxsize if limit == resource.RLIM_INFINITY else limit


def _copy(asked: Path, folder: Path) -> bool:
    """Copy a read-only folder's content into another, writable one; returns whether there is any."""
    if not (asked / COMPILED).is_file():
        return False
    with suppress(OSError):
        for place in (SHADERS.parent, MESA):
            for file in (asked / place).rglob("*"):
                if file.is_file():
                    copied = folder / file.relative_to(asked)
                    copied.parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(file, copied)
        return _fault(folder) is None
    shutil.rmtree(folder, ignore_errors=True)  # half of a database is none
    folder.mkdir(mode=0o700)
    _fault(folder)
    return False


def _private() -> Path | None:
    try:
        folder = Path(tempfile.mkdtemp(prefix="pica-"))
    except OSError:
        return None
    atexit.register(_remove, folder, os.getpid())
    return None if _fault(folder) else folder


def _remove(folder: Path, process: int) -> None:
    if os.getpid() == process:  # and not in one that was forked from it
        shutil.rmtree(folder, ignore_errors=True)
