"""The loops around Embree, with their machine code kept in pica's own place."""

import shutil
import warnings
from functools import cache
from types import ModuleType

import numba

from pica.caches.places import NUMBA, caches


@cache
def load() -> ModuleType:
    """The module embree_loops, compiled.

    Numba takes what it has kept without a check, and does not go on where it cannot keep anything: where that fails,
    what is there is removed, with a warning, and then nothing is kept.
    """
    folder = caches()
    fault = None
    for place in [""] if folder is None else [str(folder / NUMBA), str(folder / NUMBA), ""]:
        try:
            loops = _imported(place)
            break
        except Exception as error:
            fault = error
            if not place:
                raise
            shutil.rmtree(place, ignore_errors=True)
    if fault is not None:
        said = f"{type(fault).__name__}: {fault}"
        warnings.warn(f"Numba's cache failed ({said}) and was removed: loops are compiled anew", stacklevel=2)
    return loops


def _imported(place: str) -> ModuleType:
    """`place`: a folder to keep machine code in, or none where it is empty."""
    theirs, numba.config.CACHE_DIR = numba.config.CACHE_DIR, place  # read where functions are declared
    try:
        from pica.tracing import embree_loops

        return embree_loops
    finally:
        numba.config.CACHE_DIR = theirs
