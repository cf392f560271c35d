"""Standard streams, which may be closed, full, without a reader, or written to by libraries."""

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
    """The reader of the results, such as `head`, has ended."""


def open_closed() -> None:
    """Open closed streams on the null device: otherwise a file would get their numbers, and libraries' output."""
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, os.fdopen(number, mode, closefd=False))


def drop_unsaid() -> None:
    """Forget what cannot be written to stderr, at the end: Python's own attempt would change the exit code to 120."""
    try:
        sys.stderr.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 2)
        os.close(nowhere)


@contextmanager
def results_alone_on_stdout() -> Iterator[None]:
    """Redirects output of native libraries to stderr, so that stdout has results only (--json must stay JSON).

    Raises PicaError or UnreadError if results cannot be written.
    """
    try:
        is_real = sys.stdout.fileno() == 1
    except (AttributeError, OSError, ValueError):  # absent, or replaced by an object that is no file
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
    """stdout's file; its errors are distinguished from other errors of the system."""

    def write(self, data: "ReadableBuffer") -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            raise UnreadError from None
        except OSError as error:
            raise PicaError(f"standard output: cannot be written ({error.strerror})") from None


def say(line: str) -> None:
    """A line on stderr; dropped if that cannot be written."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)


class Messages:
    """The current stderr, for libraries that write there: output is dropped if it cannot be written."""

    def __init__(self) -> None:
        self._stream = sys.stderr
        self.encoding = self._stream.encoding

    def write(self, text: str) -> int:
        """Write; the number of characters."""
        with suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush the buffer."""
        with suppress(OSError):
            self._stream.flush()

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """Its number, by which Rich finds the terminal's size."""
        return self._stream.fileno()
