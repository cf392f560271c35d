"""Samples along curves: which control points each one has, and their weights (OpenUSD, UsdGeomBasisCurves)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.scene.usd.geometry import Rows

BASES = {
    "linear": np.array([[1, 0, 0, 0], [-1, 1, 0, 0]]),
    "bezier": np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]),
    "bspline": np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6,
    "catmullRom": np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]]) / 2,
}
"""Row i: weights of the four control points of a segment in the coefficient of t^i."""


class Samples(NamedTuple):
    """Places along all curves, curve after curve."""

    counts: Rows
    """(curves,) samples of each."""
    controls: Rows
    """(samples, 4) rows of control points, and their weights."""
    weights: NDArray[np.float64]
    ends: Rows
    """(samples, 2) rows of varying values at the ends of the segment, and the share of the second one."""
    share: NDArray[np.float64]

    @property
    def curves(self) -> Rows:
        """(samples,) the curve of each."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    def at(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(samples, components) of values at control points."""
        return np.einsum("sk,skc->sc", self.weights, values[self.controls])

    def between(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(samples, components) of varying values."""
        first, second = values[self.ends[:, 0]], values[self.ends[:, 1]]
        return first + (second - first) * self.share[:, None]


def segment_counts(counts: Rows, basis: str, wrap: str) -> Rows:
    """(curves,) segments of curves of so many control points; 0 for those with too few."""
    if wrap == "periodic":
        segments = counts // 3 if basis == "bezier" else counts
        return np.where(counts >= 3, segments, 0)
    if basis == "bezier":
        return np.maximum(counts - 1, 0) // 3
    return np.maximum(counts - (1 if basis == "linear" or wrap == "pinned" else 3), 0)


def varying_counts(segments: Rows, wrap: str) -> Rows:
    """(curves,) varying values of curves of so many segments."""
    return segments if wrap == "periodic" else np.where(segments > 0, segments + 1, 0)


def sampled(counts: Rows, basis: str, wrap: str, steps: int) -> Samples:
    """Samples of curves of so many control points, `steps` a segment and one at the end."""
    segments = segment_counts(counts, basis, wrap)
    of_curve = np.where(segments > 0, segments * steps + 1, 0)
    curve = np.repeat(np.arange(len(counts)), of_curve)
    number = np.arange(len(curve)) - np.repeat(np.cumsum(of_curve) - of_curve, of_curve)
    segment = np.minimum(number // steps, segments[curve] - 1)
    time = (number - segment * steps) / steps
    matrix = BASES[basis]
    weights = time[:, None] ** np.arange(len(matrix)) @ matrix
    first = segment * (3 if basis == "bezier" else 1)
    if wrap == "pinned" and basis in ("bspline", "catmullRom"):
        first -= 1
        _mirror_ends(weights, first, counts[curve])
    starts = np.cumsum(counts) - counts
    controls = starts[curve, None] + (first[:, None] + np.arange(4)) % counts[curve, None]
    values = varying_counts(segments, wrap)
    ends = (np.cumsum(values) - values)[curve, None] + (segment[:, None] + np.arange(2)) % values[curve, None]
    return Samples(of_curve, controls, weights, ends, time)


def _mirror_ends(weights: NDArray[np.float64], first: Rows, counts: Rows) -> None:
    """Replace the control points before and after a pinned curve: P[-1] = 2 P[0] - P[1], and so at the end."""
    for rows, lost, near, far in ((first < 0, 0, 1, 2), (first + 3 >= counts, 3, 2, 1)):
        weights[rows, near] += 2 * weights[rows, lost]
        weights[rows, far] -= weights[rows, lost]
        weights[rows, lost] = 0
