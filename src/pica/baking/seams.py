"""Makes light continuous between bricks of different levels."""

import numpy as np
from numpy.typing import NDArray

from pica.light_map.bricks import CELLS, LEVELS, NOWHERE, Bricks
from pica.light_map.light_map import HIDDEN, INSIDE, PARTS

_LEAST = 1e-6
"""Weight of valid probes of the coarser side below which a probe keeps its own light."""
_BESIDE = np.indices((2, 2, 2)).reshape(3, -1).T


def without_seams(
    bricks: Bricks, light: NDArray[np.float32], in_the_open: NDArray[np.bool_], seen: NDArray[np.uint8]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Light (probes, 9, 3) made continuous across faces between two levels, and which probes are in the open.

    Probes of the finer side alone on such a face take the interpolation of the coarser side: they are hanging nodes,
    constrained as in locally refined meshes. They count as in the open if the interpolation is valid.
    `in_the_open`, `seen`: as LightMap's.
    """
    light, in_the_open = light.copy(), in_the_open.copy()
    beside, level = _coarsest_beside(bricks)
    for coarse in reversed(range(1, LEVELS)):  # the coarser first: finer cells' corners may hang themselves
        step = CELLS**coarse
        hangs = np.flatnonzero((level == coarse) & (bricks.probes % step != 0).any(-1))
        if not len(hangs):
            continue
        brick = beside[hangs]
        place = (bricks.probes[hangs] - bricks.places[brick, :3].astype(np.int64) * CELLS) / step
        cell = np.minimum(place.astype(np.int64), CELLS - 1)
        within = place - cell
        part = np.minimum((within * PARTS).astype(np.int64), PARTS - 1)
        bits = seen[brick, _number(cell, CELLS) * PARTS**3 + _number(part, PARTS)]
        sums, weights = np.zeros((len(hangs), *light.shape[1:])), np.zeros(len(hangs))
        for number, corner in enumerate(_BESIDE[:, ::-1]):
            probe = bricks.probe_of[brick, _number(cell + corner, CELLS + 1)]
            open_share = np.where(bits >> number & 1, 1.0, HIDDEN)
            open_share = np.where(in_the_open[probe], open_share, INSIDE)
            weight = np.where(corner, within, 1 - within).prod(-1) * open_share
            sums += weight[:, None, None] * light[probe]
            weights += weight
        valid = weights > _LEAST  # no light through walls
        light[hangs[valid]] = sums[valid] / weights[valid, None, None]
        in_the_open[hangs[valid]] = True
    return light, in_the_open


def _coarsest_beside(bricks: Bricks) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(probes,) the coarsest of the bricks that count about each probe, and its level."""
    brick, coarsest = np.zeros(len(bricks.probes), np.int64), np.full(len(bricks.probes), -1)
    for shift in _BESIDE:
        place = (bricks.probes - shift) // CELLS
        inside = ((place >= 0) & (place < bricks.size)).all(-1)
        x, y, z = np.clip(place, 0, bricks.size - 1).T
        entry = bricks.finest_at[z, y, x].astype(np.int64)
        level = np.where(inside & (entry != NOWHERE), entry & 3, -1)
        brick = np.where(level > coarsest, entry >> 2, brick)
        coarsest = np.maximum(level, coarsest)
    return brick, coarsest


def _number(place: NDArray[np.int64], side: int) -> NDArray[np.int64]:
    """Of places (count, 3) in a cube of so many a side, x fastest."""
    return (place[:, 2] * side + place[:, 1]) * side + place[:, 0]
