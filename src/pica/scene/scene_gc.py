"""Collects dropped scenes.

Nodes refer to their parents, and only Python's garbage collector frees such cycles. It is triggered by the number of
objects, but a few nodes may hold gigabytes of pictures: so it is run explicitly before the next scene.
"""

import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING
from weakref import finalize

if TYPE_CHECKING:
    from pica.scene.model import Scene

_SHARE = 10  # maximum fraction of time for full collections: one in so many
_young = _old = False
"""Whether scenes have been dropped since the last collection: of the young generations, and of all."""
_due = 0.0


def watch(scene: "Scene") -> None:
    """Note the drop of a scene."""
    finalize(scene, _note).atexit = False


def collect() -> None:
    """Free dropped scenes: young ones at once, old ones unless a full collection was done recently."""
    global _young, _old, _due
    if _young:
        _young = False
        gc.collect(1)  # survivors count as old: they are not traversed again while a scene in use is young
    started = time.monotonic()
    if _old and started >= _due:
        _old = False
        gc.collect()
        now = time.monotonic()
        _due = now + _SHARE * (now - started)


@contextmanager
def paused() -> Iterator[None]:
    """Pause the garbage collector: it would traverse the objects of a large file repeatedly and in vain."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _note() -> None:
    global _young, _old
    _young = _old = True
