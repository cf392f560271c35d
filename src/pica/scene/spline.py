"""Meshes bent along a cubic B-spline (RTG 19, 19.2.1.3: spline meshes).

The curve is the uniform cubic B-spline over the control points (de Boor 1978, "A Practical Guide to Splines", chapter
IX). One more point beyond either end, P[-1] = 2 P[0] - P[1] and likewise at the other, makes it begin and end at the
first and the last control point.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.scene.arrays import doubles
from pica.scene.deformer import Deformer, Floats, unit
from pica.scene.model import Mesh, Node, Section
from pica.scene.values import checked, instance, text, vector, whole

_SAMPLES = 32
"""Of the arc length, for each piece of the curve."""


class Spline(Deformer):
    """Bends a node's mesh: its +Z follows the curve, evenly by arc length; +Y is the curve's up, +X its side.

    Up is parallel-transported along the curve, then rotated by `rolls`. Between one control point and
    the next, up should rotate by less than a right angle. Raises SceneError for fewer than two points or invalid
    values.
    """

    def __init__(
        self,
        points: ArrayLike,
        rolls: ArrayLike = 0.0,
        scales: ArrayLike = 1.0,
        up: ArrayLike = (0.0, 1.0, 0.0),
        extent: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        """`points` (n, 3) metres in the node's space, `rolls` (n,) radians, counter-clockwise as seen from ahead,
        `scales` (n,) of the cross-section, `up` (3,) at the start, `extent`: of the mesh along its Z axis."""
        self._count = len(checked("spline: points", doubles("n", 3), points))
        self._up = checked("spline: up", doubles(3), up)
        self.extent = checked("spline: extent", vector(2), extent)
        if self.extent[0] == self.extent[1]:
            raise SceneError(f"spline: extent: its ends are the same, {self.extent[0]:g}")
        self.version = 0
        """Counts calls of `set`."""
        self.rows: Floats
        """(n + 2, 8) x, y, z, roll; up x, y, z, scale: of the control points and one beyond either end."""
        self.places: Floats
        self.length: float
        self.set(points, rolls, scales)

    def set(self, points: ArrayLike, rolls: ArrayLike = 0.0, scales: ArrayLike = 1.0) -> None:
        """Bend the mesh along other control points, as many as there were; parameters as above."""
        control = checked("spline: points", doubles(), points)
        if control.shape != (self._count, 3) or self._count < 2:
            raise SceneError(
                f"spline: control points of shape {control.shape}; give {max(self._count, 2)} finite places x, y, z"
            )
        given = checked("spline: rolls", doubles(), rolls), checked("spline: scales", doubles(), scales)
        try:
            spread = [np.broadcast_to(values, (self._count,)) for values in given]
        except ValueError:
            raise SceneError(f"spline: give one roll and one scale, or one of each for {self._count} points") from None
        rows = np.zeros((self._count, 8))
        rows[:, :3], rows[:, 3], rows[:, 7] = control, *spread
        self._renew(rows=checked("spline: points and what is beyond its ends", doubles(), _with_ends(rows)))
        turned = self.rows.copy()
        turned[:, 4:7] = _with_ends(self._transported_ups())
        self._renew(rows=turned)
        places, length = self._by_length()
        self._renew(places=places, length=length, version=self.version + 1)
        self.changed()

    def frame(self, parameters: NDArray[np.floating[Any]]) -> dict[str, Floats]:
        """The curve at (m,) parameters from 0 to n - 1: center, side, up, (m, 3), scale, (m, 1), and their derivatives
        by the parameter: d_center, d_side, d_up, d_scale."""
        value, first, second = self._evaluated(parameters)
        velocity, acceleration = first[:, :3], second[:, :3]
        speed = np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), 1e-12)
        forward = velocity / speed
        d_forward = (acceleration - forward * _dot(forward, acceleration)) / speed
        reference, d_reference = value[:, 4:7], first[:, 4:7]
        # Gram-Schmidt, and its derivative
        across = reference - forward * _dot(reference, forward)
        d_across = (
            d_reference
            - forward * (_dot(d_reference, forward) + _dot(reference, d_forward))
            - d_forward * _dot(reference, forward)
        )
        size = np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
        up = across / size
        d_up = (d_across - up * _dot(up, d_across)) / size
        side = np.cross(up, forward)
        d_side = np.cross(d_up, forward) + np.cross(up, d_forward)
        cos, sin, d_roll = np.cos(value[:, 3:4]), np.sin(value[:, 3:4]), first[:, 3:4]
        rolled_side, rolled_up = cos * side + sin * up, cos * up - sin * side
        return {
            "center": value[:, :3],
            "side": rolled_side,
            "up": rolled_up,
            "scale": value[:, 7:],
            "d_center": velocity,
            "d_side": cos * d_side + sin * d_up + d_roll * rolled_up,
            "d_up": cos * d_up - sin * d_side - d_roll * rolled_side,
            "d_scale": first[:, 7:],
        }

    def deform(self, section: Section) -> tuple[Floats, Floats, Floats]:
        """As Deformer: bent positions, normals by the cofactors of the bend's derivative, tangents by it."""
        rest = section.positions.astype(np.float64)
        low, high = self.extent
        share = np.clip((rest[:, 2] - low) / (high - low), 0, 1)
        parameter = np.interp(share * (len(self.places) - 1), np.arange(len(self.places)), self.places)
        at = self.frame(parameter)
        x, y = rest[:, :1], rest[:, 1:2]
        offset, d_offset = x * at["side"] + y * at["up"], x * at["d_side"] + y * at["d_up"]
        speed = np.maximum(np.linalg.norm(at["d_center"], axis=1, keepdims=True), 1e-12)
        along_x, along_y = at["scale"] * at["side"], at["scale"] * at["up"]
        along_z = (
            self.length / (speed * (high - low)) * (at["d_center"] + at["d_scale"] * offset + at["scale"] * d_offset)
        )
        bent = (np.cross(along_y, along_z), np.cross(along_z, along_x), np.cross(along_x, along_y))
        normals = unit(_combined(section.normals, bent), section.normals.astype(np.float64))
        tangents = _combined(section.tangents[:, :3], (along_x, along_y, along_z))
        tangents = unit(tangents - normals * _dot(normals, tangents), section.tangents[:, :3].astype(np.float64))
        return at["center"] + at["scale"] * offset, normals, np.column_stack([tangents, section.tangents[:, 3]])

    def _evaluated(self, parameters: NDArray[np.floating[Any]]) -> tuple[Floats, Floats, Floats]:
        """(m, 8) blended rows, their first and their second derivative."""
        piece = np.clip(np.floor(parameters), 0, self._count - 2).astype(np.intp)
        u = (np.asarray(parameters, np.float64) - piece)[:, None]
        rows = [self.rows[piece + i] for i in range(4)]
        weights = (
            ((1 - u) ** 3 / 6, (3 * u**3 - 6 * u**2 + 4) / 6, (-3 * u**3 + 3 * u**2 + 3 * u + 1) / 6, u**3 / 6),
            (-((1 - u) ** 2) / 2, (3 * u**2 - 4 * u) / 2, (-3 * u**2 + 2 * u + 1) / 2, u**2 / 2),
            (1 - u, 3 * u - 2, 1 - 3 * u, u),
        )
        value, first, second = (sum(w * row for w, row in zip(ws, rows, strict=True)) for ws in weights)
        return np.asarray(value), np.asarray(first), np.asarray(second)

    def _transported_ups(self) -> Floats:
        """(n, 3) a direction across the curve at each control point, with the least turning from one to the next."""
        knots = np.arange(self._count, dtype=np.float64)
        value, first, _ = self._evaluated(knots)
        places, ahead = value[:, :3], unit(first[:, :3], np.array([0.0, 0.0, 1.0]))
        start = self._up - ahead[0] * (self._up @ ahead[0])
        if np.linalg.norm(start) < 1e-6 * max(float(np.linalg.norm(self._up)), 1e-6):
            start = np.eye(3)[np.argmin(np.abs(ahead[0]))]
            start = start - ahead[0] * (start @ ahead[0])
        ups = [start / np.linalg.norm(start)]
        # Wang, Jüttler, Zheng and Liu 2008, "Computation of Rotation Minimizing Frames", section 4: double reflection
        for i in range(self._count - 1):
            chord = places[i + 1] - places[i]
            up, forward = (_reflected(v, chord) for v in (ups[-1], ahead[i]))
            ups.append(_reflected(up, ahead[i + 1] - forward))
        return np.array(ups)

    def _by_length(self) -> tuple[Floats, float]:
        """Parameters at even steps of arc length, from the first to the last, and the whole length in metres."""
        fine = np.linspace(0, self._count - 1, _SAMPLES * (self._count - 1) + 1)
        middle = (fine[1:] + fine[:-1]) / 2
        speeds = (np.linalg.norm(self._evaluated(p)[1][:, :3], axis=1) for p in (fine, middle))
        ends, middles = speeds
        steps = (ends[1:] + ends[:-1] + 4 * middles) / 6 * np.diff(fine)  # Simpson's rule
        lengths = np.append(0.0, np.cumsum(steps))
        even = np.linspace(0, lengths[-1], len(fine))
        return np.interp(even, lengths, fine), float(lengths[-1])


def bend(mesh: Mesh, spline: Spline, copies: int = 1, name: str = "") -> Node:
    """A node with a mesh, `copies` of the given one end to end along Z, bent along the whole spline."""
    checked("bend: mesh", instance(Mesh), mesh)
    checked("bend: name", text, name)
    checked("bend: spline", instance(Spline), spline)
    bent = f"bend {shown(name or mesh.name)}"
    checked(f"{bent}: copies", whole(1, 1 << 24), copies)
    depths = np.concatenate([np.zeros(0), *(section.positions[:, 2] for section in mesh.sections)])
    low, high = float(depths.min(initial=np.inf)), float(depths.max(initial=-np.inf))
    if high <= low:
        raise SceneError(f"{bent}: needs a mesh that reaches along its Z axis")
    sections = [_repeated(section, copies, high - low) for section in mesh.sections]
    spline._renew(extent=(low, low + copies * (high - low)))
    node = Node(name or mesh.name, mesh=Mesh(sections, mesh.name))
    node.deformer = spline
    return node


def _repeated(section: Section, copies: int, depth: float) -> Section:
    count = len(section.positions)
    many = section.take(np.tile(np.arange(count), copies), section.indices)
    shift = np.repeat(np.arange(copies) * depth, count)
    starts = np.arange(copies, dtype=np.uint32) * np.uint32(count)
    positions = many.positions.copy()
    positions[:, 2] += shift.astype(np.float32)
    indices = (section.indices[None] + starts[:, None, None]).reshape(-1, 3)
    return replace(many, positions=positions, indices=indices)


def _with_ends(rows: Floats) -> Floats:
    return np.concatenate([2 * rows[:1] - rows[1:2], rows, 2 * rows[-1:] - rows[-2:-1]])


def _reflected(vector: Floats, normal: Floats) -> Floats:
    squared = normal @ normal
    return vector if squared < 1e-24 else vector - 2 * (vector @ normal) / squared * normal


def _combined(vectors: NDArray[np.float32], axes: tuple[Floats, ...]) -> Floats:
    return np.asarray(sum(vectors[:, i : i + 1].astype(np.float64) * axes[i] for i in range(3)))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.sum(a * b, axis=1, keepdims=True))
