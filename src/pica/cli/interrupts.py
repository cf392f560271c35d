"""Ctrl-C ends the command line silently with exit code 130, at any moment."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager


def take_over() -> None:
    """Make Ctrl-C end this process at once, from its imports, which may not handle an exception, to its very end.

    Not if Ctrl-C is ignored, as in a shell's background, or has another handler already.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
        sys.unraisablehook = _end_if_lost


@contextmanager
def cleaning_up_first() -> Iterator[None]:
    """Make the first Ctrl-C within the block a KeyboardInterrupt; the second still ends the process at once."""
    if signal.getsignal(signal.SIGINT) is not _end:
        yield
        return
    signal.signal(signal.SIGINT, _raise)
    try:
        yield
    except Exception:
        if signal.getsignal(signal.SIGINT) is _end:  # a library has made another error of it
            raise KeyboardInterrupt from None
        raise
    finally:
        signal.signal(signal.SIGINT, _end)


def _end(*_: object) -> None:
    os._exit(130)  # the exit code of shells for SIGINT


def _raise(*_: object) -> None:
    signal.signal(signal.SIGINT, _end)
    raise KeyboardInterrupt


def _end_if_lost(lost: "sys.UnraisableHookArgs") -> None:
    """A KeyboardInterrupt that came where Python cannot raise it, such as in a destructor, still ends the process."""
    if isinstance(lost.exc_value, KeyboardInterrupt):
        _end()
    sys.__unraisablehook__(lost)
