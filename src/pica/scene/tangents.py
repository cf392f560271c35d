"""Tangents after MikkTSpace, the basis in which normal maps are baked (Mikkelsen 2008, "Simulation of Wrinkled
Surfaces Revisited"; glTF 2.0, 3.7.2.1 names it as the default).

Differences from the reference code, none of which is visible on meshes made for baking:
* corners at one vertex (same position, normal and texture coordinates) with the same handedness share a
  tangent even if no chain of edges joins their triangles, such as two cones that touch at the tip;
* a triangle without area in texture space takes the tangent of a neighbour corner by corner, not as a whole;
* if no triangle gives a direction, any vector at a right angle to the normal is used.
"""

import numpy as np
from numpy.typing import NDArray

from pica.scene.normals import in_strips, perpendicular, strips

Floats = NDArray[np.float64]


def generate_tangents(
    positions: NDArray[np.float32],
    normals: NDArray[np.float32],
    uvs: NDArray[np.float32],
    triangles: NDArray[np.uint32],
) -> tuple[NDArray[np.float32], NDArray[np.intp], NDArray[np.uint32]]:
    """Tangents of indexed triangles with unit normals; texture coordinates have v down.

    A vertex between a mirrored and an unmirrored part of the texture is split in two. Returns the tangents
    (vertices, 4), w being the sign of the bitangent; the original vertex of each new one, (vertices,);
    and the triangles as indices of new vertices, (triangles, 3).
    """
    # one tangent for each group: a welded vertex and a handedness
    welded, group_count = _welded(positions, normals, uvs), 2 * len(positions)
    group, usable = np.empty(triangles.shape, np.intp), np.empty((len(triangles), 1), bool)
    sums = np.zeros((group_count, 3))
    for rows in strips(len(triangles)):
        corner_normals = normals[triangles[rows]].astype(np.float64)
        corners, uv = positions[triangles[rows]].astype(np.float64), uvs[triangles[rows]].astype(np.float64)
        along_u, area = _u_directions(corners, uv)
        usable[rows] = (area != 0) & along_u.any(axis=1, keepdims=True) & _distinct(corners)
        group[rows] = welded[triangles[rows]] * 2 + (area > 0)
        directions = _unit(_projected(along_u[:, None], corner_normals))
        weights = np.where(usable[rows], _angles(corners, corner_normals), 0.0)
        np.add.at(sums, group[rows], weights[..., None] * directions)
    filled = np.abs(sums).sum(axis=1) > 0
    takes_other_hand = ~usable & ~filled[group] & filled[group ^ 1]
    group = np.where(takes_other_hand, group ^ 1, group)

    source, new_triangles = _split(triangles, group & 1)
    group_of_vertex = np.zeros(len(source), np.intp)
    group_of_vertex[new_triangles] = group

    def of_vertices(rows: slice) -> NDArray[np.float32]:
        own = normals[source[rows]]
        direction = _unit(_projected(sums[group_of_vertex[rows]], own.astype(np.float64)))
        # texture space is right-handed with v up, so a positive area with v down is a mirrored texture
        hand = np.where(group_of_vertex[rows] & 1, -1.0, 1.0)
        kept = np.where(direction.any(axis=1, keepdims=True), direction, perpendicular(own))
        return np.column_stack([kept, hand]).astype(np.float32)

    return in_strips(of_vertices, len(source), 4), source, new_triangles


def _u_directions(corners: Floats, uvs: Floats) -> tuple[Floats, Floats]:
    """(triangles, 3) where u grows, any length, and (triangles, 1) twice the signed area in texture space."""
    # mikktspace.c, InitTriInfo: solve edge = du * T + dv * B for T by Cramer's rule
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    du1, dv1 = (uvs[:, 1] - uvs[:, 0]).T
    du2, dv2 = (uvs[:, 2] - uvs[:, 0]).T
    area = (du1 * dv2 - du2 * dv1)[:, None]
    along_u = np.sign(area) * (dv2[:, None] * edge1 - dv1[:, None] * edge2)
    return along_u, area


def _angles(corners: Floats, normals: Floats) -> Floats:
    """(triangles, 3) angle of each corner as seen along its normal (mikktspace.c, EvalTspace)."""
    to_next = _unit(_projected(np.roll(corners, -1, axis=1) - corners, normals))
    to_previous = _unit(_projected(np.roll(corners, 1, axis=1) - corners, normals))
    return np.arccos(np.clip(np.einsum("tci,tci->tc", to_next, to_previous), -1.0, 1.0))


def _distinct(corners: Floats) -> NDArray[np.bool_]:
    """(triangles, 1) whether the three corners lie at different places."""
    return (corners != np.roll(corners, 1, axis=1)).any(axis=2).all(axis=1, keepdims=True)


def _welded(*attributes: NDArray[np.float32]) -> NDArray[np.intp]:
    """(vertices,) the same number for vertices that agree in every attribute."""
    rows = np.ascontiguousarray(np.concatenate(attributes, axis=1), np.float32) + np.float32(0)  # -0 becomes 0
    order = np.lexsort(rows.T)
    new = np.ones(len(rows), np.intp)
    new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    ids = np.empty(len(rows), np.intp)
    ids[order] = np.cumsum(new) - 1
    return ids


def _split(triangles: NDArray[np.uint32], hand: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.uint32]]:
    """One vertex for every pair of old vertex and handedness in use, in the old order."""
    pairs = triangles.astype(np.intp) * 2 + hand
    used = np.zeros(int(pairs.max(initial=-1)) + 1, bool)
    used[pairs] = True
    return np.flatnonzero(used) // 2, (np.cumsum(used) - 1)[pairs].astype(np.uint32)


def _projected(vectors: Floats, normals: Floats) -> Floats:
    """Vectors without their part along the normals."""
    return vectors - normals * np.sum(normals * vectors, axis=-1, keepdims=True)


def _unit(vectors: Floats) -> Floats:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)
