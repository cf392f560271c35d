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
    is_pole = profile[:, 0] <= 1e-9 * np.abs(profile).max()
    rows = []
    for row, slope in enumerate(slopes):
        ends = (row, row + 1)
        each = [slope, slope]
        if smooth:  # the mean of the profile's edges at each end, and along the axis at poles
            each = [slopes[max(end - 1, 0)] + slopes[min(end, len(slopes) - 1)] for end in ends]
            each = [normal / np.linalg.norm(normal) for normal in each]
            poles = [np.array([0.0, math.copysign(1.0, profile[end, 1])]) for end in ends]
            each = [pole if is_pole[end] else normal for end, pole, normal in zip(ends, poles, each, strict=True)]
        rows.append((ends, each))
    points, normals, uv = [], [], []
    corners: list[NDArray[np.intp]] = []
    counts: list[NDArray[np.intp]] = []
    for ends, each in rows:
        for end, normal in zip(ends, each, strict=True):
            distance, height = profile[end]
            points.append(np.column_stack([distance * around, np.full(len(around), height)]))
            normals.append(np.column_stack([normal[0] * around, np.full(len(around), normal[1])]))
            uv.append(np.column_stack([turn / turn[-1], np.full(len(turn), 1 - end / (len(profile) - 1))]))
        first = (len(points) - 2) * len(around) + np.arange(_SEGMENTS)
        below = first + len(around)
        sides = [first, below, below + 1, first + 1]
        if is_pole[ends[0]]:
            sides.pop()
        elif is_pole[ends[1]]:
            sides.pop(2)
        corners.append(np.stack(sides, axis=1).reshape(-1))
        counts.append(np.full(_SEGMENTS, len(sides)))
    order = list(_TURNS[axis])
    shape = [np.concatenate(each) for each in (points, counts, corners, normals, uv)]
    return _shape(shape[0][:, order], shape[1], shape[2], shape[3][:, order], shape[4])


def _cube(size: float) -> Geometry:
    bits = np.arange(8)[:, None] >> np.array([2, 1, 0]) & 1
    points = (bits - 0.5)[_CUBE.reshape(-1)] * size
    sides = points.reshape(6, 4, 3)
    normals = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    normals = np.repeat(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30), 4, axis=0)
    uv = np.tile([[0.0, 0.0], [1, 0], [1, 1], [0, 1]], (6, 1))
    return _shape(points, np.full(6, 4), np.arange(24), normals, uv)


def _plane(width: float, length: float, axis: str) -> Geometry:
    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]) * [width, length, 0]
    order = list(_TURNS[axis])
    normals = np.tile([0.0, 0, 1], (4, 1))[:, order]
    uv = corners[:, :2] / [width or 1, length or 1] + 0.5
    return _shape(corners[:, order], np.array([4]), np.arange(4), normals, uv)


def _shape(
    points: NDArray[np.float64],
    counts: NDArray[np.intp],
    corners: NDArray[np.intp],
    normals: NDArray[np.float64],
    uv: NDArray[np.float64],
) -> Geometry:
    rows = np.arange(len(points))
    named = {"NORMAL": Primvar(normals, rows, "vertex"), "st": Primvar(uv, rows, "vertex")}
    return Geometry(points, counts, corners, named)
