"""A record of the caches' content, so that a start knows what must be compiled.

It may be outdated if a cache was emptied: programs are then compiled at first use, one after the
other, or workers have nothing to do. Either costs time and nothing else.
"""

import hashlib
from collections.abc import Hashable, Iterable
from contextlib import suppress
from pathlib import Path

_BYTES = 16


class CompiledPrograms:
    """The programs that the caches in a folder have for a driver, by their content."""

    def __init__(self, file: Path | None, sources: Path, driver: str) -> None:
        """`sources`: the folder of the Slang files that programs are made of. `file` None: nothing is remembered."""
        self._file = file
        self._made_of = _digest(driver.encode() + _contents(sources))
        self._known: set[str] = set()
        if file is not None:
            with suppress(OSError, UnicodeDecodeError):
                self._known.update(file.read_text("ascii").split())

    @property
    def empty(self) -> bool:
        """Whether nothing at all has been compiled."""
        return not self._known

    def has(self, program: Hashable) -> bool:
        """Whether this program has been compiled. `program`: an object whose `repr` identifies it, except
        for the files of the package."""
        return self._key(program) in self._known

    def add(self, programs: Iterable[Hashable]) -> None:
        """Record these as cached."""
        new = {key for key in map(self._key, programs) if key not in self._known}
        self._known |= new
        if self._file is not None and new:
            with suppress(OSError), self._file.open("a", encoding="ascii") as file:  # one write: others append too
                file.write("".join(f"{key}\n" for key in sorted(new)))

    def _key(self, program: Hashable) -> str:
        return _digest(self._made_of.encode() + repr(program).encode())


def _contents(folder: Path) -> bytes:
    """A digest of all Slang files below a folder."""
    files = sorted(folder.rglob("*.slang"))
    return _digest(b"".join(str(file.relative_to(folder)).encode() + file.read_bytes() for file in files)).encode()


def _digest(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()[: 2 * _BYTES]
