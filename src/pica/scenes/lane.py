"""The robots' lane round a factory."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Lane:
    """A rounded rectangle on the floor, run counter-clockwise as seen from above."""

    center: tuple[float, float]
    """(x, z) metres."""
    straight: tuple[float, float]
    """Half the length of the straight sides along X and Z, metres."""
    radius: float
    """Of the corners, metres."""

    @property
    def length(self) -> float:
        """Metres once round."""
        return 4 * sum(self.straight) + 2 * np.pi * self.radius

    def at(self, distance: Floats) -> tuple[Floats, Floats]:
        """Positions (count, 3) and headings (count,) after `distance`, (count,) metres.

        A heading is in radians from +Z towards +X and grows by a full revolution a lap.
        """
        starts, corners, headings = self._pieces
        laps, rest = np.divmod(distance, self.length)
        piece = np.clip(np.searchsorted(starts, rest, "right") - 1, 0, 7)
        along = rest - starts[piece]
        round_corner = piece % 2 == 1
        heading = headings[piece] + np.where(round_corner, along / self.radius, 0)
        straight = corners[piece] + along[:, None] * _ahead(headings[piece])
        bent = corners[piece] + self.radius * (_left(headings[piece]) - _left(heading))
        flat = np.where(round_corner[:, None], bent, straight)
        places = np.stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]], -1)
        return places, heading + 2 * np.pi * laps

    @cached_property
    def _pieces(self) -> tuple[Floats, Floats, Floats]:
        """Where each side and corner begins: distance, (x, z) and heading."""
        (half_x, half_z), quarter = self.straight, np.pi / 2 * self.radius
        lengths = np.array([2 * half_x, quarter, 2 * half_z, quarter] * 2)
        headings = np.pi / 2 * np.array([1, 1, 2, 2, 3, 3, 4, 4])
        straight = lengths[::2, None] * _ahead(headings[::2])
        bent = self.radius * (_left(headings[1::2]) - _left(headings[1::2] + np.pi / 2))
        steps = np.stack([straight, bent], 1).reshape(8, 2)
        begin = np.array((self.center[0] - half_x, self.center[1] + half_z + self.radius))
        return np.cumsum(lengths) - lengths, begin + np.cumsum(steps, 0) - steps, headings


def _ahead(heading: Floats) -> Floats:
    return np.stack([np.sin(heading), np.cos(heading)], -1)


def _left(heading: Floats) -> Floats:
    return np.stack([np.cos(heading), -np.sin(heading)], -1)
