"""Standard streams, which may be closed, full, read by nobody, or written to by libraries."""

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from pica.errors import PicaError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class UnreadError(Exception):
    """Whoever read the results has gone, such as `head`."""


def open_closed() -> None:
    """Lead streams that are closed nowhere: a file would get their numbers, and what libraries print would be in it."""
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, os.fdopen(number, mode, closefd=False))


@contextmanager
def results_alone_on_stdout() -> Iterator[None]:
    """Sends what native libraries print to stderr, so that stdout carries results only (--json must stay JSON).

    Raises PicaError or UnreadError when results cannot be written.
    """
    try:
        is_real = sys.stdout.fileno() == 1
    except (AttributeError, OSError, ValueError):  # none, or replaced by something that is no file
        is_real = False
    if not is_real:
        yield
        return
    sys.stdout.flush()
    saved = os.dup(1)
    given = sys.stdout
    sys.stdout = results = io.TextIOWrapper(
        io.BufferedWriter(_Results(os.dup(saved), "w")),
        encoding=given.encoding,
        errors="backslashreplace",  # a name that the encoding lacks is no reason to lose the rest
        line_buffering=given.isatty(),
    )
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout = given
        os.dup2(saved, 1)
        os.close(saved)
        results.close()


class _Results(io.FileIO):
    """stdout's file; what fails there is told apart from other errors of the system."""

    def write(self, data: "ReadableBuffer") -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            raise UnreadError from None
        except OSError as error:
            raise PicaError(f"standard output: cannot be written ({error.strerror})") from None


def say(line: str) -> None:
    """A line on stderr; dropped where that cannot be written, as then there is nobody to tell."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)


class Messages:
    """stderr as it is now, for libraries that write there: what cannot be written is dropped."""

    def __init__(self) -> None:
        self._stream = sys.stderr
        self.encoding = self._stream.encoding

    def write(self, text: str) -> int:
        """Write; the number of characters."""
        with suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Write what waits."""
        with suppress(OSError):
            self._stream.flush()

    def isatty(self) -> bool:
        """Whether somebody looks at it."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Its number, by which Rich finds the terminal's size."""
        return self._stream.fileno()
