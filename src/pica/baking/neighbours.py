"""Filters light between neighbouring probes, against noise, and fills probes inside objects."""

import numpy as np
from numpy.typing import NDArray

from pica.light_map.bricks import CELLS, Bricks
from pica.light_map.light_map import PARTS

_Floats = NDArray[np.float32]
_REACH = 4
"""Probes."""


class Neighbours:
    """Probes that are next to each other along an axis."""

    def __init__(self, bricks: Bricks, seen: NDArray[np.uint8]) -> None:
        """`seen`: as LightMap.seen."""
        numbers = bricks.probe_of.reshape(-1, *(CELLS + 1,) * 3).astype(np.int64)
        parts = seen.reshape(-1, *(CELLS,) * 3, *(PARTS,) * 3)
        firsts, seconds, sighted = [], [], []
        for axis in range(3):  # x, y, z; arrays have x last
            ahead = [slice(axis == other, CELLS + (axis == other)) for other in (2, 1, 0)]
            far = [(PARTS - 1) * (axis == other) for other in (2, 1, 0)]
            firsts.append(numbers[:, :CELLS, :CELLS, :CELLS].reshape(-1))
            seconds.append(numbers[:, ahead[0], ahead[1], ahead[2]].reshape(-1))
            forth = parts[..., 0, 0, 0] >> (1 << axis)
            back = parts[..., far[0], far[1], far[2]]
            sighted.append((forth & back & 1).astype(bool).reshape(-1))
        self._first, self._second, self._sighted = map(np.concatenate, (firsts, seconds, sighted))

    def smooth(self, light: _Floats, variance: _Floats, in_the_open: NDArray[np.bool_]) -> _Floats:
        """Denoised light (probes, 9, 3) from its variance (probes,).

        Probes are averaged with visible neighbours, with weights that fall with differences beyond the noise: so light
        that varies between probes is preserved if its variance is low (non-local means, Buades, Coll
        and Morel 2005, with the variance of the estimates as in Rousselle, Knaus and Zwicker 2012).
        """
        useful = self._sighted & in_the_open[self._first] & in_the_open[self._second]
        first, second = self._first[useful], self._second[useful]
        # The variance is estimated from only two halves of the samples, so it is averaged over neighbours.
        sums, counts = variance.copy(), np.ones_like(variance)
        for to, by in ((first, second), (second, first)):
            np.add.at(sums, to, variance[by])
            np.add.at(counts, to, 1)
        variance = sums / counts
        for _ in range(_REACH):
            expected = variance[first] + variance[second]
            apart = np.square(light[first] - light[second]).mean(-1).sum(-1)
            weight = np.exp(-apart / np.maximum(expected, 1e-30)).astype(np.float32)
            sums, weights, spreads = light.copy(), np.ones_like(variance), variance.copy()
            for to, by in ((first, second), (second, first)):
                np.add.at(sums, to, weight[:, None, None] * light[by])
                np.add.at(weights, to, weight)
                np.add.at(spreads, to, weight**2 * variance[by])
            light, variance = sums / weights[:, None, None], spreads / weights**2
        return light

    def spread(self, light: _Floats, in_the_open: NDArray[np.bool_]) -> _Floats:
        """Light (probes, 9, 3), with probes inside objects filled by means of neighbours, from outside inwards."""
        valid = in_the_open.copy()
        light = np.where(valid[:, None, None], light, 0)
        for _ in range(_REACH):
            sums, counts = np.zeros_like(light), np.zeros(len(light), np.float32)
            for to, by in ((self._first, self._second), (self._second, self._first)):
                useful = valid[by] & ~valid[to]
                np.add.at(sums, to[useful], light[by[useful]])
                np.add.at(counts, to[useful], 1)
            came = counts > 0
            light[came] = sums[came] / counts[came, None, None]
            valid |= came
        return light
