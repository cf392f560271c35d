"""Boxes round sections and round placed ones."""

import numpy as np
from numpy.typing import NDArray

Box = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Lowest and highest corner, (3,) each."""


def object_box(positions: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Centre (3,) of the box round (n, 3) points, n > 0, and from there to its corner (3,)."""
    low, high = positions.min(0), positions.max(0)
    return low / 2 + high / 2, high / 2 - low / 2  # halves first: the largest numbers have no sum


def world_box(to_world: NDArray[np.floating], centers: NDArray[np.floating], extents: NDArray[np.floating]) -> Box:
    """The bounds of (n,) boxes with `centers` and `extents` (n, 3), each under its own (3, 4) matrix."""
    with np.errstate(over="ignore", invalid="ignore"):
        placed = np.einsum("nij,nj->ni", to_world[:, :, :3], centers) + to_world[:, :, 3]
        reach = np.einsum("nij,nj->ni", abs(to_world[:, :, :3]), extents)
        low, high = (placed - reach).min(0).astype(np.float64), (placed + reach).max(0).astype(np.float64)
    if to_world.dtype == np.float32 and not np.isfinite([low, high]).all():
        return world_box(to_world.astype(np.float64), centers, extents)
    return low, high


def joined(a: Box, b: Box) -> Box:
    """The box round two."""
    return np.minimum(a[0], b[0]), np.maximum(a[1], b[1])
