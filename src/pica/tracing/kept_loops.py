"""The loops around Embree, with their machine code kept in pica's own place."""

import shutil
import warnings
from functools import cache
from types import ModuleType

import numba

from pica.caches.places import NUMBA, caches


@cache
def load() -> ModuleType:
    """The module embree_loops. Numba reads its cache without a check, so one that fails is removed, with a warning."""
    folder = caches()
    if folder is None:
        return _imported(None)
    try:
        return _imported(str(folder / NUMBA))
    except Exception as error:
        shutil.rmtree(folder / NUMBA, ignore_errors=True)
        loops = _imported(str(folder / NUMBA))
        warnings.warn(
            f"{folder / NUMBA} was damaged ({type(error).__name__}) and was removed: loops are compiled anew",
            stacklevel=2,
        )
        return loops


def _imported(folder: str | None) -> ModuleType:
    theirs, numba.config.CACHE_DIR = numba.config.CACHE_DIR, folder or ""  # read where functions are declared
    try:
        from pica.tracing import embree_loops

        return embree_loops
    finally:
        numba.config.CACHE_DIR = theirs
