"""Catmull-Clark subdivision with semi-sharp creases.

Catmull and Clark 1978, "Recursively Generated B-Spline Surfaces on Arbitrary Topological Meshes"; DeRose, Kass and
Truong 1998, "Subdivision Surfaces in Character Animation", for creases. Boundaries are sharp edges, and corners of a
single face are sharp, as USD's "edgeAndCorner". Data of corners is interpolated linearly.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.intp]
SHARP = 10.0
"""Sharpness that never becomes smooth (UsdGeomMesh.SHARPNESS_INFINITE)."""


@dataclass
class Polygons:
    """Faces and what is subdivided with them."""

    counts: Integers
    """(faces,) corners of each."""
    corners: Integers
    """(corners,) vertices, face after face."""
    vertices: Floats
    """(vertices, k) positions and other smooth data."""
    corner_data: Floats
    """(corners, m)"""
    face: Integers
    """(faces,) which face of the unrefined mesh each comes from."""
    crease_edges: Integers
    """(creases, 2) vertices."""
    crease_sharpness: Floats
    """(creases,)"""
    corner_sharpness: Floats
    """(vertices,)"""


def subdivide(mesh: Polygons) -> Polygons:
    """One level: each face of n corners becomes n quads."""
    counts, corners = mesh.counts, mesh.corners
    vertex_count = len(mesh.vertices)
    faces = np.repeat(np.arange(len(counts)), counts)
    starts = np.cumsum(counts) - counts
    number = np.arange(len(corners)) - starts[faces]
    following = starts[faces] + (number + 1) % counts[faces]
    previous = starts[faces] + (number - 1) % counts[faces]
    ends = np.sort(np.stack([corners, corners[following]], axis=1), axis=1)
    keys, edge_of = np.unique(ends[:, 0] * vertex_count + ends[:, 1], return_inverse=True)
    edge_of = edge_of.reshape(-1)
    edges = np.stack([keys // vertex_count, keys % vertex_count], axis=1)
    sharpness = _edge_sharpness(mesh, keys, edge_of)

    centres = _means(mesh.vertices[corners], faces, len(counts))
    middles = mesh.vertices[edges].mean(axis=1)
    beside = np.bincount(edge_of, minlength=len(edges))
    smooth = (2 * middles + _sums(centres[faces], edge_of, len(edges))) / (2 + beside)[:, None]
    sharp_share = np.clip(sharpness, 0, 1)[:, None]
    edge_points = middles * sharp_share + smooth * (1 - sharp_share)
    vertex_points = _vertex_points(mesh, edges, sharpness, centres, faces, middles)

    first_edge, first_face = vertex_count, vertex_count + len(edges)
    quads = np.stack([corners, first_edge + edge_of, first_face + faces, first_edge + edge_of[previous]], axis=1)
    data = mesh.corner_data
    along = (data + data[following]) / 2
    middle = _means(data, faces, len(counts))[faces]
    creases = np.flatnonzero(sharpness > 0)
    halves = np.concatenate([np.stack([edges[creases, end], first_edge + creases], axis=1) for end in (0, 1)])
    return Polygons(
        counts=np.full(len(corners), 4),
        corners=quads.reshape(-1),
        vertices=np.concatenate([vertex_points, edge_points, centres]),
        corner_data=np.stack([data, along, middle, along[previous]], axis=1).reshape(4 * len(data), data.shape[1]),
        face=mesh.face[faces],
        crease_edges=halves,
        crease_sharpness=np.tile(_duller(sharpness[creases]), 2),
        corner_sharpness=np.concatenate([_duller(mesh.corner_sharpness), np.zeros(len(edges) + len(counts))]),
    )


def _edge_sharpness(mesh: Polygons, keys: Integers, edge_of: Integers) -> Floats:
    sharpness = np.zeros(len(keys))
    if len(mesh.crease_edges):
        ends = np.sort(mesh.crease_edges, axis=1)
        wanted = ends[:, 0] * len(mesh.vertices) + ends[:, 1]
        rows = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        there = keys[rows] == wanted
        np.maximum.at(sharpness, rows[there], mesh.crease_sharpness[there])
    sharpness[np.bincount(edge_of, minlength=len(keys)) != 2] = SHARP  # boundaries, and edges of more than two faces
    return sharpness


def _vertex_points(
    mesh: Polygons, edges: Integers, sharpness: Floats, centres: Floats, faces: Integers, middles: Floats
) -> Floats:
    """New places of the vertices there were."""
    points, count = mesh.vertices, len(mesh.vertices)
    both = edges.reshape(-1)
    valence = np.bincount(both, minlength=count)
    face_count = np.bincount(mesh.corners, minlength=count)
    faces_mean = _sums(centres[faces], mesh.corners, count) / np.maximum(face_count, 1)[:, None]
    edges_mean = _sums(np.repeat(middles, 2, axis=0), both, count) / np.maximum(valence, 1)[:, None]
    n = np.maximum(valence, 1)[:, None]
    smooth = (faces_mean + 2 * edges_mean + (n - 3) * points) / n

    is_sharp = np.repeat(sharpness > 0, 2)
    sharp_count = np.bincount(both[is_sharp], minlength=count)
    others = edges[:, ::-1].reshape(-1)
    neighbours = _sums(points[others[is_sharp]], both[is_sharp], count)
    creased = (6 * points + neighbours) / 8
    of_edges = np.bincount(both[is_sharp], np.repeat(sharpness, 2)[is_sharp], count) / np.maximum(sharp_count, 1)

    share = np.clip(of_edges, 0, 1)[:, None]
    result = np.where((sharp_count == 2)[:, None], creased * share + smooth * (1 - share), smooth)
    corner = np.where((sharp_count > 2) | ((sharp_count == 2) & (face_count == 1)), of_edges, 0.0)
    share = np.clip(np.maximum(corner, mesh.corner_sharpness), 0, 1)[:, None]
    result = points * share + result * (1 - share)
    return np.where((face_count == 0)[:, None], points, result)


def _duller(sharpness: Floats) -> Floats:
    return np.where(sharpness >= SHARP, SHARP, np.maximum(sharpness - 1, 0))


def _sums(values: Floats, rows: Integers, count: int) -> Floats:
    """(count, k) sums of the values, (n, k), of each row."""
    total = np.zeros((count, values.shape[1]))
    for column in range(values.shape[1]):
        total[:, column] = np.bincount(rows, values[:, column], count)
    return total


def _means(values: Floats, rows: Integers, count: int) -> Floats:
    amounts: NDArray[Any] = np.bincount(rows, minlength=count)
    return _sums(values, rows, count) / np.maximum(amounts, 1)[:, None]
