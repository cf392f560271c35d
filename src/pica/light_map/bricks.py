"""Where a light map's probes are: bricks of 4x4x4 cells, in levels, each 4 times as coarse as the one below."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError

CELLS = 4
"""Along a brick's side; a probe at each corner of each cell. light_map.slang: CELLS."""
LEVELS = 3
"""light_map.slang: a brick's level takes 2 bits."""
MOST_PLACES = 1 << 24
"""Of finest bricks that the box of a map may have room for."""
NOWHERE = 0xFFFFFFFF
"""light_map.slang: NOWHERE."""
CORNERS = CELLS + 1
"""Along a brick's side, a probe at each."""
_MARGIN = np.array([0.37, 0.31, 0.43])
"""In finest spacings below the scene's lowest corner: walls tend to have round coordinates, and neither should probes
be in their plane nor diagonals of cells meet their edges."""


@dataclass(frozen=True, eq=False)
class Bricks:
    """Bricks in a box. Every place of the box is in at least one; where several are, the finest counts."""

    origin: NDArray[np.float64]
    """(3,) metres, the box's lowest corner."""
    spacing: float
    """Metres between the finest probes."""
    size: NDArray[np.int32]
    """(3,) of the box, in finest bricks."""
    places: NDArray[np.int32]
    """(bricks, 4) lowest corner of each, in finest bricks: multiples of 4 to the power of the level; and the level."""

    @cached_property
    def _numbered(self) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
        """Adjacent bricks share probes, at all levels."""
        steps = np.indices((CORNERS,) * 3).reshape(3, -1)[::-1]
        scale = CELLS ** self.places[:, 3].astype(np.int64)
        first = self.places[:, :3].astype(np.int64) * CELLS
        sides = (first + (CELLS * scale)[:, None]).max(0, initial=0) + 1
        strides = np.array([sides[1] * sides[2], sides[2], 1])
        places = (first @ strides)[:, None] + scale[:, None] * (strides @ steps)
        keys, number_of = np.unique(places, return_inverse=True)
        probes = np.stack(np.unravel_index(keys, tuple(sides)), -1)
        return probes, number_of.reshape(places.shape).astype(np.uint32)

    @property
    def probes(self) -> NDArray[np.int64]:
        """(probes, 3) where each is, in finest spacings from the origin."""
        return self._numbered[0]

    @property
    def probe_of(self) -> NDArray[np.uint32]:
        """(bricks, 125) number of the probe at each corner, x fastest."""
        return self._numbered[1]

    @property
    def positions(self) -> NDArray[np.float32]:
        """(probes, 3) metres."""
        return (self.origin + self.spacing * self.probes).astype(np.float32)

    @cached_property
    def finest_at(self) -> NDArray[np.uint32]:
        """(z, y, x) of each finest brick's place: 4 times the number of the finest brick that covers it, plus that
        one's level; NOWHERE for none."""
        table = np.full(self.size[::-1], NOWHERE, np.uint32)
        for number in np.argsort(-self.places[:, 3], kind="stable"):
            x, y, z, level = self.places[number]
            side = CELLS**level
            table[z : z + side, y : y + side, x : x + side] = number << 2 | level
        return table


def bricks_around(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    spacing: float,
    occupied: NDArray[np.bool_],
    detailed: NDArray[np.bool_],
) -> Bricks:
    """Bricks for the box (3,) low to high: the finest where `detailed`, of the shape from `box_of`, is true, those
    of the next level where `occupied` is, and the coarsest elsewhere.
    """
    origin, size = box_of(low, high, spacing)
    places, selected = [_at(detailed, 0)], detailed
    for level in range(1, LEVELS):
        finer, inside = _blocks(selected), _blocks(np.ones_like(selected))
        covered = (finer | ~inside).all((1, 3, 5))
        selected = np.ones(covered.shape, bool) if level == LEVELS - 1 else np.asarray(_blocks(occupied).any((1, 3, 5)))
        # Coarser bricks that finer ones cover entirely would never be sampled.
        places.append(_at(selected & ~covered, level))
    return Bricks(origin, spacing, size, np.concatenate(places).astype(np.int32))


def box_of(
    low: NDArray[np.float64], high: NDArray[np.float64], spacing: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Lowest corner (3,) in metres and size (3,) in finest bricks of a map's box. Raises SceneError for too many."""
    origin = low - _MARGIN * spacing
    size = np.ceil((high - origin + _MARGIN * spacing) / (spacing * CELLS))
    if np.prod(size) > MOST_PLACES:
        raise SceneError(f"light map: {spacing:g} m between probes are too few for a scene of {np.max(high - low):g} m")
    return origin, size.astype(np.int32)


def _at(mask: NDArray[np.bool_], level: int) -> NDArray[np.int64]:
    """(count, 4) rows of Bricks.places."""
    places = np.argwhere(mask) * CELLS**level
    return np.concatenate([places, np.full((len(places), 1), level)], axis=1)


def _blocks(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(x / 4, 4, y / 4, 4, z / 4, 4) of (x, y, z), False beyond its sides."""
    padded = np.pad(mask, [(0, -length % CELLS) for length in mask.shape])
    x, y, z = (length // CELLS for length in padded.shape)
    return padded.reshape(x, CELLS, y, CELLS, z, CELLS)
