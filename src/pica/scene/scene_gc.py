"""Has Python free scenes that are gone.

Nodes know their parents, and only Python's collector frees such circles. It goes by the number of objects, whatever
they hold, and a few nodes may hold gigabytes of pictures: so it is called for where the next scene comes.
"""

import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING
from weakref import finalize

if TYPE_CHECKING:
    from pica.scene.model import Scene

_SHARE = 10  # of the time, one part at most goes into looking through all objects
_young = _old = False
"""Whether scenes have gone since objects were last looked through: the young ones, and all."""
_due = 0.0


def watch(scene: "Scene") -> None:
    """Note when this one goes."""
    finalize(scene, _note).atexit = False


def collect() -> None:
    """Free the scenes that have gone: at once what is young, the others where that was not done a moment ago."""
    global _young, _old, _due
    if _young:
        _young = False
        gc.collect(1)  # whoever survives counts as old: not again while a scene in use is young
    started = time.monotonic()
    if _old and started >= _due:
        _old = False
        gc.collect()
        now = time.monotonic()
        _due = now + _SHARE * (now - started)


@contextmanager
def paused() -> Iterator[None]:
    """Python's collector rests: it would look again and again through the objects of a large file, none of which go."""
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
