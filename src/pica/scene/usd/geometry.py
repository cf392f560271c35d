"""Polygons with attributes, of which parts become primitives of glTF."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.conversion.triangles import triangulated
from pica.scene.usd.primvars import Primvar

Rows = NDArray[np.intp]
_MIX = np.uint64(0x9E3779B97F4A7C15)
"""An odd number whose multiples are spread over 64 bits (Knuth, The Art of Computer Programming 3, 6.4)."""


@dataclass
class Geometry:
    """What a prim shows."""

    points: NDArray[Any]
    """(points, 3)"""
    counts: Rows
    """(faces,) corners of each face."""
    corners: Rows
    """(corners,) points, face after face."""
    attributes: dict[str, Primvar] = field(default_factory=dict)
    """By the names that glTF has for them."""
    of_points: dict[str, NDArray[Any]] = field(default_factory=dict)
    """(points, components), likewise: joints and weights."""
    targets: list[dict[str, NDArray[Any]]] = field(default_factory=list)
    """Offsets, (points, 3) each, of morph targets."""
    left_handed: bool = False
    smooth: bool = False
    """Whether missing normals are averages of the faces round each point."""


@dataclass
class Part:
    """Triangles of one material."""

    attributes: dict[str, NDArray[Any]]
    triangles: NDArray[np.uint32]
    points: Rows
    """(vertices,) the point of each vertex."""


def part(geometry: Geometry, faces: Rows | None) -> Part | None:
    """The part of some faces, or of all; None where it has no triangles."""
    face_of = np.repeat(np.arange(len(geometry.counts)), geometry.counts)
    triangles = triangulated(geometry.counts, geometry.points, geometry.corners)
    if geometry.left_handed:
        triangles = triangles[:, ::-1]
    if faces is not None:
        wanted = np.zeros(len(geometry.counts), bool)
        wanted[faces] = True
        triangles = triangles[wanted[face_of[triangles[:, 0]]]]
    if not len(triangles):
        return None
    used = triangles.reshape(-1)
    corners, face_rows = geometry.corners[used], face_of[used]
    rows = {"POSITION": corners}
    for name, primvar in geometry.attributes.items():
        whole = primvar.interpolation == "faceVarying"
        rows[name] = primvar.rows(corners, face_rows)[used] if whole else primvar.rows(corners, face_rows)
    values = {name: primvar.values for name, primvar in geometry.attributes.items()}
    shared = {name: _merged(values[name], each) if name in values else each for name, each in rows.items()}
    first, vertices = _distinct(list(shared.values()))
    attributes = {"POSITION": geometry.points[corners[first]].astype(np.float32)}
    attributes |= {name: values[name][rows[name][first]].astype(np.float32) for name in values}
    attributes |= {name: of_points[corners[first]] for name, of_points in geometry.of_points.items()}
    return Part(attributes, vertices.reshape(-1, 3).astype(np.uint32), corners[first])


def _merged(values: NDArray[Any], rows: Rows) -> Rows:
    """The rows with equal values replaced by the first of them, so that vertices can be shared."""
    if len(values) < len(rows) // 2:  # indexed already
        return rows
    packed = np.ascontiguousarray(values.astype(np.float32)).view(np.uint32).astype(np.uint64)
    hashes = np.zeros(len(values), np.uint64)
    for column in packed.T:
        hashes = (hashes ^ column) * _MIX
        hashes ^= hashes >> np.uint64(29)
    _, first, inverse = np.unique(hashes, return_index=True, return_inverse=True)
    inverse = inverse.reshape(-1)
    merged = first[inverse]
    return merged[rows] if np.array_equal(values[merged], values) else rows


def _distinct(columns: Sequence[Rows]) -> tuple[Rows, Rows]:
    """The first of each different row of the columns, and the number of each row among these."""
    key, span = columns[0].astype(np.int64), int(columns[0].max()) + 1
    for column in columns[1:]:
        width = int(column.max()) + 1
        if span * width >= 1 << 62:
            _, key = np.unique(key, return_inverse=True)
            key = key.reshape(-1).astype(np.int64)
            span = int(key.max()) + 1
        key, span = key * width + column, span * width
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    return first, inverse.reshape(-1)
