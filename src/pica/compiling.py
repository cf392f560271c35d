"""Who is told while shaders are compiled: a frame may wait for that before it begins."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[int, int], None]
"""Called with (programs compiled, programs to compile), first with none of them."""

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Tell this one within the block, in this thread."""
    before = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(before)


def tell(done: int, total: int) -> None:
    """`done` of `total` programs that no cache had are compiled."""
    listener = _listener.get()
    if listener is not None:
        listener(done, total)
