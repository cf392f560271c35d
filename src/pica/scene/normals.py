"""Normals, and frames around them, for meshes without."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

_UNIT_WITHIN = 2e-7
"""Of rounding to 32 bits."""
_STRIP = 1 << 14


def strips(count: int) -> Iterator[slice]:
    """Rows to compute at once: temporary arrays of all rows would take several times the memory of the result."""
    return (slice(start, min(start + _STRIP, count)) for start in range(0, count, _STRIP))


def in_strips(make: Callable[[slice], NDArray[np.float32]], count: int, width: int) -> NDArray[np.float32]:
    """(count, width) rows as `make` gives them, in strips."""
    whole = np.empty((count, width), np.float32)
    for rows in strips(count):
        whole[rows] = make(rows)
    return whole


def face_normals(positions: NDArray[np.floating[Any]], triangles: NDArray[np.uint32]) -> NDArray[np.float32]:
    """(triangles, 3) unit normals, on the side from which the corners go counter-clockwise; +Z where no area is."""
    return in_strips(lambda rows: _face_normals(positions[triangles[rows]].astype(np.float64)), len(triangles), 3)


def _face_normals(corners: NDArray[np.float64]) -> NDArray[np.float32]:
    edge1, edge2 = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    # np.cross is several times as slow for small meshes
    normals = np.stack([edge1[i - 2] * edge2[i - 1] - edge1[i - 1] * edge2[i - 2] for i in range(3)], axis=1)
    return _unit(normals, np.array([0.0, 0.0, 1.0])).astype(np.float32)


def vertex_normals(positions: NDArray[np.floating[Any]], triangles: NDArray[np.uint32]) -> NDArray[np.float32]:
    """(vertices, 3) the mean of the triangles at each vertex, weighted by their angles there; zero where none is.

    Thurmer and Wuthrich 1998, "Computing Vertex Normals from Polygonal Facets": the same however a face is cut into
    triangles.
    """
    normals = np.zeros((len(positions), 3))
    for rows in strips(len(triangles)):
        corners = positions[triangles[rows]].astype(np.float64)
        to_next = _unit(np.roll(corners, -1, axis=1) - corners, np.zeros(3))
        to_previous = -np.roll(to_next, 1, axis=1)
        angles = np.arccos(np.clip(np.einsum("tci,tci->tc", to_next, to_previous), -1.0, 1.0))
        has_area = np.linalg.norm(np.cross(to_next[:, 0], to_previous[:, 0]), axis=1) > 0
        weighted = _face_normals(corners)[:, None] * (angles * has_area[:, None])[..., None]
        np.add.at(normals, triangles[rows], weighted)
    return normals.astype(np.float32)


def unit_normals(
    normals: NDArray[np.float32], positions: NDArray[np.float32], triangles: NDArray[np.uint32]
) -> NDArray[np.float32]:
    """(vertices, 3) the normals at unit length; one of length zero becomes that of a triangle at the vertex."""
    missing = ~normals.any(axis=1, keepdims=True)
    if missing.any():
        at_vertex = np.zeros_like(normals)
        at_vertex[triangles] = face_normals(positions, triangles)[:, None]
        normals = np.where(missing, at_vertex, normals)
    return in_strips(lambda rows: _unit_normals(normals[rows]), len(normals), 3)


def _unit_normals(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    unit = _unit(normals.astype(np.float64), np.array([0.0, 0.0, 1.0])).astype(np.float32)
    return np.where(are_unit(normals), normals, unit)


def are_unit(vectors: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(vertices, 1) which vectors, (vertices, 3), have unit length already: they are kept to the bit, so that a scene
    that was saved is the same once it is loaded."""
    lengths = np.linalg.norm(vectors.astype(np.float64), axis=1, keepdims=True)
    return np.abs(lengths - 1) <= _UNIT_WITHIN


def perpendicular(normals: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """(vertices, 3) one unit vector at a right angle to each unit normal."""
    # Duff et al. 2017, "Building an Orthonormal Basis, Revisited", the first of its two axes
    x, y, z = normals.astype(np.float64).T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    return np.stack([1.0 + sign * x * x * a, sign * x * y * a, -sign * x], axis=1).astype(np.float32)


def _unit(vectors: NDArray[np.float64], fallback: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1.0), fallback)
