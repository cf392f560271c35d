"""Polygons become triangles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.normals import strips

_BENT_INWARDS = -1e-4
"""Sine of the angle at a corner below which a polygon is not convex; rounding makes straight ones bend by less."""


def fans(counts: NDArray[Any]) -> NDArray[np.intp]:
    """(triangles, 3) rows of corners, from the number of corners of each polygon, whose corners follow one another.

    Each polygon is a fan about its first corner; those of fewer than three corners have no triangle.
    """
    counts = np.asarray(counts, np.intp)
    starts = np.cumsum(counts) - counts
    per_face = np.maximum(counts - 2, 0)
    first = np.repeat(starts, per_face)
    number = np.arange(len(first)) - np.repeat(np.cumsum(per_face) - per_face, per_face)
    return np.stack([first, first + number + 1, first + number + 2], axis=1)


def triangulated(counts: NDArray[np.intp], positions: NDArray[Any], corners: NDArray[np.intp]) -> NDArray[np.intp]:
    """As `fans`, but polygons that are not convex are cut into ears. `corners`: the row of `positions` of each."""
    triangles = fans(counts)
    starts = np.cumsum(counts) - counts
    bent = not_convex(counts, positions, corners)
    if not len(bent):
        return triangles
    cut = [starts[face] + ears(positions[corners[starts[face] : starts[face] + counts[face]]]) for face in bent]
    is_fan = np.ones(len(counts), bool)
    is_fan[bent] = False
    return np.concatenate([triangles[np.repeat(is_fan, np.maximum(counts - 2, 0))], *cut])


def not_convex(counts: NDArray[np.intp], positions: NDArray[Any], corners: NDArray[np.intp]) -> NDArray[np.intp]:
    """The polygons that bend inwards at a corner."""
    starts = np.cumsum(counts) - counts
    large = np.flatnonzero(counts > 3)
    parts = (large[rows] for rows in strips(len(large)))
    found = [part[_bends(counts[part], starts[part], positions, corners)] for part in parts]
    return np.concatenate([np.zeros(0, np.intp), *found])


def _bends(
    counts: NDArray[np.intp], starts: NDArray[np.intp], positions: NDArray[Any], corners: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """(polygons,) which of some polygons bend inwards at a corner."""
    ends = np.cumsum(counts)
    firsts = ends - counts
    own = np.arange(ends[-1]) + np.repeat(starts - firsts, counts)
    places = positions[corners[own]].astype(np.float64)
    following = np.arange(1, len(places) + 1)
    following[ends - 1] = firsts
    edges = places[following] - places
    turns = np.cross(edges, edges[following])
    # Twice the area, about the first corner (Newell's method).
    arms = places - np.repeat(places[firsts], counts, axis=0)
    normals = np.add.reduceat(np.cross(arms, edges), firsts)
    lengths = np.linalg.norm(edges, axis=1)
    scale = lengths * lengths[following] * np.repeat(np.linalg.norm(normals, axis=1), counts)
    bends = np.einsum("ij,ij->i", turns, np.repeat(normals, counts, axis=0))
    bends = np.where(scale == 0, -1, bends / np.where(scale == 0, 1, scale))  # equal corners may hide a bend
    return np.asarray(np.minimum.reduceat(bends, firsts) < _BENT_INWARDS)


def ears(places: NDArray[Any]) -> NDArray[np.intp]:
    """(triangles, 3) corners of one polygon, (corners, 3)."""
    import mapbox_earcut

    arms = (places - places[0]).astype(np.float64)
    normal = np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0)
    axis = int(np.abs(normal).argmax())
    flat = np.ascontiguousarray(arms[:, [(axis + 1) % 3, (axis + 2) % 3]])
    found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    triangles = found.reshape(-1, 3).astype(np.intp)
    a, b, c = (flat[triangles[:, corner]] for corner in range(3))
    areas = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    wrong = areas * normal[axis] < 0
    triangles[wrong] = triangles[wrong][:, ::-1]
    return triangles
