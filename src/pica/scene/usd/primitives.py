"""Spheres, cubes, cylinders, cones, capsules and planes become polygons (UsdGeomSphere and so on)."""

import math

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from pica.scene.usd.geometry import Geometry
from pica.scene.usd.primvars import Primvar

_SEGMENTS, _RINGS = 48, 24
"""Of a whole turn, and of half a turn from pole to pole."""
_TURNS = {"X": (2, 0, 1), "Y": (1, 2, 0), "Z": (0, 1, 2)}
"""Which of x, y and z along Z is each axis."""
_CUBE = np.array([[2, 6, 4, 0], [5, 7, 3, 1], [4, 5, 1, 0], [3, 7, 6, 2], [1, 3, 2, 0], [6, 7, 5, 4]])
"""Corners of the sides, counter-clockwise from outside: bit 2 is x, bit 1 y, bit 0 z."""


def read_primitive(prim: Usd.Prim, time: Usd.TimeCode) -> Geometry | None:
    """The polygons of a prim; None where it is no such primitive."""

    def number(name: str, default: float) -> float:
        value = prim.GetAttribute(name).Get(time)
        return default if value is None else float(value)

    axis = str(prim.GetAttribute("axis").Get(time) or "Z")
    match prim.GetTypeName():
        case "Sphere":
            return _revolved(_arc(number("radius", 1.0), 0.0, 0.0, math.pi), "Z", smooth=True)
        case "Cube":
            return _cube(number("size", 2.0))
        case "Plane":
            return _plane(number("width", 2.0), number("length", 2.0), axis)
        case "Cylinder":
            radius, half = number("radius", 1.0), number("height", 2.0) / 2
            return _revolved(np.array([[0, half], [radius, half], [radius, -half], [0, -half]]), axis, smooth=False)
        case "Cone":
            radius, half = number("radius", 1.0), number("height", 2.0) / 2
            return _revolved(np.array([[0, half], [radius, -half], [0, -half]]), axis, smooth=False)
        case "Capsule":
            radius, half = number("radius", 0.5), number("height", 1.0) / 2
            top, bottom = _arc(radius, half, 0.0, math.pi / 2), _arc(radius, -half, math.pi / 2, math.pi)
            return _revolved(np.concatenate([top, bottom]), axis, smooth=True)
    return None


def _arc(radius: float, centre: float, start: float, end: float) -> NDArray[np.float64]:
    """(points, 2) distance from the axis, and height: of a circle about `centre`, by angles from the top."""
    rings = max(round(_RINGS * (end - start) / math.pi), 1)
    angles = np.linspace(start, end, rings + 1)
    return np.stack([radius * np.sin(angles), centre + radius * np.cos(angles)], axis=1)


def _revolved(profile: NDArray[np.float64], axis: str, smooth: bool) -> Geometry:
    """A profile, (points, 2), turned about the axis; `smooth`: its corners are round."""
    turn = np.arange(_SEGMENTS + 1) * (2 * math.pi / _SEGMENTS)
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    edges = np.diff(profile, axis=0)
    slopes = np.stack([-edges[:, 1], edges[:, 0]], axis=1)  # outwards: to the left of an edge that goes down
    slopes /= np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-30)
    rows = []
    for row, slope in enumerate(slopes):
        ends = (row, row + 1)
        if smooth:  # of the profile's two edges at each point
            each = [slopes[max(end - 1, 0)] + slopes[min(end, len(slopes) - 1)] for end in ends]
            each = [normal / np.linalg.norm(normal) for normal in each]
            each = [
                np.array([0.0, math.copysign(1.0, profile[end, 1])])
                if profile[end, 0] < 1e-9 * abs(profile[end, 1])
                else normal
                for end, normal in zip(ends, each, strict=True)
            ]
        else:
            each = [slope, slope]
        rows.append((ends, each))
    points, normals, uv, corners = [], [], [], []
    for ends, each in rows:
        for end, normal in zip(ends, each, strict=True):
            distance, height = profile[end]
            points.append(np.column_stack([distance * around, np.full(len(around), height)]))
            normals.append(np.column_stack([normal[0] * around, np.full(len(around), normal[1])]))
            uv.append(np.column_stack([turn / turn[-1], np.full(len(turn), 1 - end / (len(profile) - 1))]))
        start = (len(points) - 2) * len(around)
        first = start + np.arange(_SEGMENTS)
        below = first + len(around)
        corners.append(np.stack([first, below, below + 1, first + 1], axis=1))
    quads = np.concatenate(corners)
    order = list(_TURNS[axis])
    return _shape(np.concatenate(points)[:, order], quads, np.concatenate(normals)[:, order], np.concatenate(uv))


def _cube(size: float) -> Geometry:
    bits = np.arange(8)[:, None] >> np.array([2, 1, 0]) & 1
    points = (bits - 0.5)[_CUBE.reshape(-1)] * size
    sides = points.reshape(6, 4, 3)
    normals = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    normals = np.repeat(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30), 4, axis=0)
    uv = np.tile([[0.0, 0.0], [1, 0], [1, 1], [0, 1]], (6, 1))
    return _shape(points, np.arange(24).reshape(6, 4), normals, uv)


def _plane(width: float, length: float, axis: str) -> Geometry:
    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]) * [width, length, 0]
    order = list(_TURNS[axis])
    normals = np.tile([0.0, 0, 1], (4, 1))[:, order]
    return _shape(corners[:, order], np.arange(4)[None], normals, corners[:, :2] / [width or 1, length or 1] + 0.5)


def _shape(
    points: NDArray[np.float64], quads: NDArray[np.intp], normals: NDArray[np.float64], uv: NDArray[np.float64]
) -> Geometry:
    rows = np.arange(len(points))
    named = {"NORMAL": Primvar(normals, rows, "vertex"), "st": Primvar(uv, rows, "vertex")}
    return Geometry(points, np.full(len(quads), 4), quads.reshape(-1), named)
