"""Progress of loading: large files take seconds, most of them for their pictures."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Lock

Listener = Callable[[int, int], None]
"""Called with (pictures decoded, pictures to decode), from any thread."""

_listener: ContextVar[Listener | None] = ContextVar("load_listener", default=None)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Report loads of this thread to this listener within the block."""
    before = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(before)


class LoadProgress:
    """So many pictures are decoded, in other threads too."""

    def __init__(self, total: int) -> None:
        self._done, self._total, self._lock = 0, total, Lock()
        self._listener = _listener.get()

    def advance(self) -> None:
        """One more is decoded."""
        with self._lock:
            self._done += 1
            if self._listener is not None:
                self._listener(self._done, self._total)
