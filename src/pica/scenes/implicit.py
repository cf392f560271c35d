"""Smooth surfaces of implicit functions, which are negative inside, as triangles."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Field = Callable[[Floats], Floats]
"""(count, 3) points in metres to (count,) values; about metres near 0, where the surface is."""

_STEP = 1e-4
"""Metres of central differences."""


def union(a: Floats, b: Floats, radius: float) -> Floats:
    """The smaller of two values with a fillet of about `radius` metres (Quilez, "Smooth minimum", quadratic)."""
    overlap = np.maximum(radius - np.abs(a - b), 0) / radius
    return np.minimum(a, b) - overlap * overlap * radius / 4


def intersection(a: Floats, b: Floats, radius: float) -> Floats:
    """The larger of two values with an edge rounded by about `radius` metres."""
    return -union(-a, -b, radius)


@dataclass(frozen=True)
class Shell:
    """Triangles on the surface of a field."""

    field: Field
    positions: Floats
    """(vertices, 3) metres."""
    indices: NDArray[np.intp]
    """(triangles, 3), counter-clockwise from outside."""

    def normals(self) -> Floats:
        """(vertices, 3) unit length, the field's gradient."""
        gradient = _gradient(self.field, self.positions)
        return np.asarray(gradient / np.linalg.norm(gradient, axis=1, keepdims=True), np.float64)

    def split(self, border: Field) -> "tuple[Shell, Shell]":
        """The parts where `border` is negative and where it is not; triangles are cut along its zeros."""
        values = border(self.positions)
        outside = values >= 0
        count = outside[self.indices].sum(1)
        parts = {False: [self.indices[count == 0]], True: [self.indices[count == 3]]}
        cut: list[Floats] = []
        first = len(self.positions)
        for single in (True, False):  # one corner is outside, or one is inside
            triangles = self.indices[count == (1 if single else 2)]
            corner = np.argmax(outside[triangles] == single, axis=1)
            a, b, c = (np.take_along_axis(triangles, (corner[:, None] + k) % 3, 1)[:, 0] for k in range(3))
            middles = []
            for other in (b, c):
                share = (values[a] / (values[a] - values[other]))[:, None]
                cut.append(self.positions[a] + share * (self.positions[other] - self.positions[a]))
                middles.append(first + np.arange(len(a)))
                first += len(a)
            ab, ac = middles
            parts[single].append(np.stack([a, ab, ac], 1))
            parts[not single] += [np.stack([ab, b, c], 1), np.stack([ab, c, ac], 1)]
        positions = np.concatenate([self.positions, _projected(self.field, np.concatenate(cut))])
        inside, outer = (Shell(self.field, positions, np.concatenate(parts[side])) for side in (False, True))
        return inside._compact(), outer._compact()

    def _compact(self) -> "Shell":
        used, indices = np.unique(self.indices, return_inverse=True)
        return Shell(self.field, self.positions[used], indices.reshape(-1, 3))


def surface(field: Field, low: ArrayLike, high: ArrayLike, cell: float) -> Shell:
    """The surface within a box, in metres, with edges of about `cell`: surface nets (Gibson 1998, "Constrained Elastic
    Surface Nets"), whose vertices then go along the gradient to where the field is 0."""
    axes = [np.arange(first, last + cell, cell) for first, last in zip(np.asarray(low), np.asarray(high), strict=True)]
    shape = tuple(len(axis) for axis in axes)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    values = field(points.reshape(-1, 3)).reshape(shape)
    inside = values < 0
    sums, counts = np.zeros((*(n - 1 for n in shape), 3)), np.zeros(tuple(n - 1 for n in shape))
    quads = []
    number = np.arange(counts.size).reshape(counts.shape)
    for axis in range(3):
        here, there = _along(inside, axis, 0), _along(inside, axis, 1)
        edges = np.argwhere(here != there)
        start = tuple(edges.T)
        end = tuple((edges + np.eye(3, dtype=int)[axis]).T)
        share = (values[start] / (values[start] - values[end]))[:, None]
        crossings = points[start] + share * (points[end] - points[start])
        u, v = (axis + 1) % 3, (axis + 2) % 3
        around = []
        for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):  # counter-clockwise as seen from the axis' tip
            cells = edges.copy()
            cells[:, u] += du - 1
            cells[:, v] += dv - 1
            ok = ((cells >= 0) & (cells < counts.shape)).all(1)
            np.add.at(sums, tuple(cells[ok].T), crossings[ok])
            np.add.at(counts, tuple(cells[ok].T), 1)
            around.append(np.where(ok, number[tuple(np.clip(cells, 0, np.array(counts.shape) - 1).T)], -1))
        quad = np.stack(around, 1)
        quad[~inside[start]] = quad[~inside[start]][:, ::-1]
        quads.append(quad[(quad >= 0).all(1)])
    corners = np.concatenate(quads)
    used, compact = np.unique(corners, return_inverse=True)
    a, b, c, d = compact.reshape(-1, 4).T
    middles = sums.reshape(-1, 3)[used] / counts.reshape(-1, 1)[used]
    indices = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Shell(field, _projected(field, middles), indices)


def _along(values: NDArray[np.bool_], axis: int, offset: int) -> NDArray[np.bool_]:
    return np.take(values, np.arange(offset, values.shape[axis] - 1 + offset), axis)


def _projected(field: Field, points: Floats) -> Floats:
    """Points after three steps of Newton's method towards the surface."""
    for _ in range(3):
        gradient = _gradient(field, points)
        points = points - gradient * (field(points) / np.maximum(np.sum(gradient * gradient, 1), 1e-9))[:, None]
    return points


def _gradient(field: Field, points: Floats) -> Floats:
    steps = np.eye(3) * _STEP
    return np.stack([(field(points + step) - field(points - step)) / (2 * _STEP) for step in steps], 1)
