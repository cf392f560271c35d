"""Points become small spheres (UsdGeomPoints)."""

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from pica.scene.gltf.points_and_lines import POINT_WIDTH
from pica.scene.usd.geometry import Geometry, Rows
from pica.scene.usd.primvars import Primvar, Sizes, array_of, color_primvars, coordinate_primvars, diagonal, fitting
from pica.scene.usd.stage import Stage

_MOST_TRIANGLES = 1_000_000
"""Of the points of a prim, if octahedra do: each subdivision of these has four times as many."""
_SUBDIVISIONS = 2
_VERTEX_BYTES = 400


def read_points(stage: Stage, prim: Usd.Prim) -> Geometry | None:
    """The spheres of a Points prim; None where it has none. Raises SceneError where its arrays do not fit."""
    given, time = UsdGeom.Points(prim), stage.time
    points = array_of(given.GetPointsAttr(), time, 3)
    count = len(points)
    if not count:
        return None
    levels = next((n for n in range(_SUBDIVISIONS, 0, -1) if count * 8 * 4**n <= _MOST_TRIANGLES), 0)
    directions, faces = _sphere(levels)
    vertices = count * len(directions)
    stage.conversion.budget.take(vertices=vertices, bytes=vertices * _VERTEX_BYTES)
    sizes = Sizes(count, count, count, count)
    own = array_of(given.GetWidthsAttr(), time, 1)
    widths = fitting("widths", own, None, str(given.GetWidthsInterpolation()), sizes)
    every = np.arange(count)
    if widths is None:
        diameters = np.full((count, 1), min(POINT_WIDTH, count**-0.5) * diagonal(points))
    else:
        diameters = widths.values[widths.rows(every, every)]
    rows = np.repeat(every, len(directions))
    outward = np.tile(directions, (count, 1))
    corners = (every[:, None, None] * len(directions) + faces).reshape(-1)
    geometry = Geometry(
        points[rows] + np.abs(diameters[rows]) / 2 * outward,
        np.full(len(corners) // 3, 3),
        corners,
        {"NORMAL": Primvar(directions, np.tile(np.arange(len(directions)), count), "vertex")},
    )
    surface = color_primvars(prim, time, sizes) | coordinate_primvars(prim, time, sizes)
    for name, primvar in surface.items():
        geometry.attributes[name] = Primvar(primvar.values, primvar.rows(every, every)[rows], "vertex")
    return geometry


def _sphere(levels: int) -> tuple[NDArray[np.float64], Rows]:
    """(vertices, 3) of an octahedron with subdivided sides on the unit sphere, and (triangles, 3)."""
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    for _ in range(levels):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        distinct, middle = np.unique(edges, axis=0, return_inverse=True)
        middle = middle.reshape(-1, 3) + len(vertices)
        vertices = np.concatenate([vertices, vertices[distinct].sum(axis=1)])
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate(
            [np.stack(each, axis=1) for each in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return vertices, faces
