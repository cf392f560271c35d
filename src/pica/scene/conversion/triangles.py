"""Polygons become triangles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def fans(counts: NDArray[Any]) -> NDArray[np.intp]:
    """(triangles, 3) rows of corners, from the number of corners of each polygon, whose corners follow one another.

    Each polygon is a fan about its first corner; those of fewer than three corners have no triangle.
    """
    counts = np.asarray(counts, np.intp)
    starts = np.cumsum(counts) - counts
    per_face = np.maximum(counts - 2, 0)
    first = np.repeat(starts, per_face)
    number = np.arange(len(first)) - np.repeat(np.cumsum(per_face) - per_face, per_face)
    return np.stack([first, first + number + 1, first + number + 2], axis=1)
