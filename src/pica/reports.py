"""Whom long work in a thread reports to."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[int, int], None]
"""Called with (done, to do)."""


class Reports:
    """The listener of one kind of work, if this thread has one."""

    def __init__(self, name: str) -> None:
        self._listener: ContextVar[Listener | None] = ContextVar(name, default=None)

    @contextmanager
    def to(self, listener: Listener) -> Iterator[None]:
        """Report to this listener within the block, in this thread."""
        before = self._listener.set(listener)
        try:
            yield
        finally:
            self._listener.reset(before)

    @property
    def listener(self) -> Listener | None:
        """That of the innermost block."""
        return self._listener.get()
