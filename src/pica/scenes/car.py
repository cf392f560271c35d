"""A coupé of no make: one smooth body whose panes, lamps and trims are cut out of it, on four wheels.

It stands on y = 0 and looks along +X; 4.5 metres long.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pica.scene.coat import Coat
from pica.scene.material import Material, Texture
from pica.scene.model import Node, Section
from pica.scenes.basic_meshes import box, cylinder, lathe, plate, ring, torus
from pica.scenes.implicit import Field, Floats, Shell, intersection, surface, union
from pica.scenes.palette import lamp, linear, metal, plastic
from pica.scenes.placing import at, mesh, move, place, rotate

LENGTH, WIDTH, HEIGHT = 4.5, 1.84, 1.26
"""Metres, about."""
AXLES = (1.36, -1.34)
"""Metres along X."""
TRACK, WHEEL, TYRE = 0.755, 0.345, 0.24
"""Metres: wheels from the middle, their radius and their width."""
ARCH = 0.392
"""Radius of the wheel arches in metres."""
_CELL = 0.025
"""Metres between vertices of the body."""
_FLAKES, _TILE = 256, 0.5
"""Texels of the flakes' normal map, and metres that it covers."""


class _Curve:
    """A natural cubic spline: its curvature is continuous, so reflections have no kinks. Constant beyond its ends."""

    def __init__(self, *points: tuple[float, float]) -> None:
        self.x, self.y = np.array(points).T
        steps, slopes = np.diff(self.x), np.diff(self.y) / np.diff(self.x)
        count = len(self.x)
        matrix, right = np.eye(count), np.zeros(count)
        for i in range(1, count - 1):
            matrix[i, i - 1 : i + 2] = steps[i - 1], 2 * (steps[i - 1] + steps[i]), steps[i]
            right[i] = 6 * (slopes[i] - slopes[i - 1])
        self.bend = np.linalg.solve(matrix, right)  # second derivatives at the points

    def __call__(self, x: Floats) -> Floats:
        inside = np.clip(x, self.x[0], self.x[-1])
        i = np.clip(np.searchsorted(self.x, inside) - 1, 0, len(self.x) - 2)
        step = self.x[i + 1] - self.x[i]
        a, b = (self.x[i + 1] - inside) / step, (inside - self.x[i]) / step
        bend = ((a**3 - a) * self.bend[i] + (b**3 - b) * self.bend[i + 1]) * step * step / 6
        return np.asarray(a * self.y[i] + b * self.y[i + 1] + bend, np.float64)


_HALF_WIDTH = _Curve((-2.3, 0.80), (-1.35, 0.915), (-0.1, 0.865), (1.3, 0.905), (2.0, 0.79), (2.4, 0.60))
_DECK = _Curve((-2.3, 0.865), (-1.6, 0.925), (-0.8, 0.925), (0.2, 0.895), (1.2, 0.80), (1.9, 0.665), (2.4, 0.52))
"""The top of the body without its cabin."""
_ROOF = _Curve(
    (-2.1, 0.83), (-1.5, 1.03), (-0.9, 1.185), (-0.2, 1.26), (0.3, 1.225), (0.8, 1.04), (1.3, 0.76), (1.6, 0.55)
)


def _bump(x: Floats, middle: float, width: float) -> Floats:
    return np.asarray(np.exp(-(((x - middle) / width) ** 2)), np.float64)


def _side(p: Floats) -> Floats:
    """Distance from the cabin's sides, which lean inwards."""
    x, y, z = p[:, 0], p[:, 1], np.abs(p[:, 2])
    return np.asarray(z - (0.76 - 0.05 * x * x - 0.47 * (y - 0.9)), np.float64) * 0.9


def _over(p: Floats) -> Floats:
    """Distance from the roof, the windscreen and the rear window."""
    return np.asarray(p[:, 1] - _ROOF(p[:, 0]) + 0.13 * p[:, 2] ** 2, np.float64) * 0.85


def _body(p: Floats) -> Floats:
    x, y, z = p[:, 0], p[:, 1], np.abs(p[:, 2])
    fenders = sum(0.075 * _bump(x, axle, 0.42) * _bump(z, 0.68, 0.2) for axle in AXLES)
    top = y - _DECK(x) + 0.12 * z**2 - fenders
    hollow = 0.035 * _bump(y, 0.43, 0.13) * _bump(x, 0.0, 0.75)
    wall = z - _HALF_WIDTH(x) * (1 - 0.32 * (y - 0.55) ** 2) + hollow
    front = (x - 2.27 + 0.42 * z**2 + 0.9 * (y - 0.42) ** 2) * 0.85
    back = (-x - 2.2 + 0.25 * z**2 + 0.5 * (y - 0.74) ** 2) * 0.9
    low = 0.15 + 0.05 * np.maximum(np.abs(x) - 1.5, 0) ** 2 - y
    hull = intersection(intersection(top, wall, 0.16), intersection(front, back, 0.1), 0.16)
    cabin = intersection(intersection(_side(p), _over(p), 0.12), np.maximum(0.6 - y, -1.95 - x), 0.02)
    whole = intersection(union(hull, cabin, 0.07), low, 0.12)
    arches = np.maximum(np.minimum(*(np.hypot(x - axle, y - WHEEL) for axle in AXLES)) - ARCH, 0.5 - z)
    return intersection(whole, -arches, 0.05)


def _box(
    p: Floats, middle: tuple[float, float], half: tuple[float, float], corner: float, axes: tuple[int, int]
) -> Floats:
    """Distance in metres from a rounded rectangle in the plane of two axes, mirrored along Z."""
    inner = [
        np.abs(np.abs(p[:, axis]) - m if axis == 2 else p[:, axis] - m) - h + corner
        for axis, m, h in zip(axes, middle, half, strict=True)
    ]
    out = np.hypot(np.maximum(inner[0], 0), np.maximum(inner[1], 0))
    return np.asarray(out + np.minimum(np.maximum(*inner), 0) - corner, np.float64)


def _panes(p: Floats) -> Floats:
    """Negative where there is glass: the windscreen, the rear window and the sides' windows."""
    x, y = p[:, 0], p[:, 1]
    above = _DECK(x) + 0.035 - y
    sides = np.maximum(_over(p) + 0.075, np.maximum(np.abs(x + 0.28) - 1.12, np.abs(_side(p)) - 0.08))
    sides = np.maximum(sides, 0.022 - np.abs(x + 0.45))  # the pillar
    ends = np.maximum(_side(p) + 0.075, np.maximum(0.62 - np.abs(x + 0.23), np.abs(_over(p)) - 0.05))
    return np.maximum(np.minimum(sides, ends), above)


def _arches(p: Floats) -> Floats:
    distance = np.minimum(*(np.hypot(p[:, 0] - axle, p[:, 1] - WHEEL) for axle in AXLES))
    return np.maximum(distance - ARCH - 0.02, 0.45 - np.abs(p[:, 2]))


def _seams(p: Floats) -> Floats:
    """The gaps round doors and bonnet."""
    doors = np.abs(_box(p, (-0.03, 0.62), (0.6, 0.42), 0.12, (0, 1)))
    doors = np.maximum(doors, np.maximum(0.6 - np.abs(p[:, 2]), p[:, 1] - _DECK(p[:, 0]) - 0.02))
    bonnet = np.maximum(np.abs(_box(p, (0.0, 1.2), (0.6, 0.78), 0.25, (2, 0))), 0.62 - p[:, 1])
    return np.minimum(doors, np.maximum(bonnet, p[:, 0] - 1.99)) - 0.0045


def _headlamps(p: Floats) -> Floats:
    x, y, z = p[:, 0], p[:, 1], np.abs(p[:, 2])
    tilted = np.stack([x, y - 0.16 * (z - 0.6), z], 1)
    return np.maximum(_box(tilted, (0.62, 0.57), (0.15, 0.028), 0.02, (2, 1)), 1.5 - x)


def _tail(p: Floats) -> Floats:
    return np.maximum(_box(p, (0.0, 0.735), (0.7, 0.02), 0.018, (2, 1)), p[:, 0] + 1.8)


def _black(p: Floats) -> Floats:
    """Intake, diffuser, sills."""
    intake = np.maximum(_box(p, (0.0, 0.36), (0.55, 0.075), 0.06, (2, 1)), 1.7 - p[:, 0])
    plate_recess = np.maximum(_box(p, (0.0, 0.43), (0.5, 0.1), 0.06, (2, 1)), p[:, 0] + 1.8)
    return np.minimum(np.minimum(intake, plate_recess), p[:, 1] - 0.235)


@dataclass(frozen=True)
class Finish:
    """Materials of a car."""

    paint: Material
    glass: Material
    black: Material
    rubber: Material
    rim: Material
    leather: Material
    caliper: Material
    headlamp: Material
    tail: Material


def finish(rng: np.random.Generator) -> Finish:
    """Red flake paint under a clear coat."""
    return Finish(
        paint=_flake_paint("flake paint", "#a30f20", rng),
        glass=Material(
            "tinted glass", base_color=(0.32, 0.35, 0.36, 1.0), metallic=0.0, roughness=0.0, transmission=1.0
        ),
        black=_dull("black trim", "#0c0d0f", 0.35),
        rubber=_dull("tyre", "#161617", 0.75),
        rim=metal("rim", "#c4c8ce", 0.22),
        leather=plastic("leather", "#57483b", 0.55),
        caliper=plastic("caliper", "#e0b52c", 0.3),
        headlamp=lamp("headlamp", "#dfeaff", 60.0),
        tail=lamp("tail lamp", "#ff2a1c", 20.0),
    )


def _dull(name: str, code: str, roughness: float) -> Material:
    """Plastic or rubber whose highlights stay dark under bright lamps."""
    return Material(name, base_color=(*linear(code), 1.0), metallic=0.0, roughness=roughness, specular=0.3)


def _flake_paint(name: str, code: str, rng: np.random.Generator) -> Material:
    """A metal of tilted flakes, by a normal map, under a smooth clear coat."""
    tilt = rng.normal(0, 0.05, (_FLAKES, _FLAKES, 2))
    normal = np.dstack([tilt, np.ones((_FLAKES, _FLAKES))])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    flakes = Texture.from_array((normal * 0.5 + 0.5).astype(np.float32), encoding="linear", name="flakes")
    paint = Material(name, base_color=(*linear(code), 1.0), metallic=1.0, roughness=0.3, normal_texture=flakes)
    paint.coats = (Coat(roughness=0.02),)
    return paint


def car(finish: Finish) -> Node:
    """The car; its wheels are nodes, with their axles along their own Z."""
    node = Node("car")
    shell = surface(_body, (-2.35, 0.05, -1.05), (2.45, 1.36, 1.05), _CELL)
    regions: Sequence[tuple[Field, Material]] = (
        (_arches, finish.black),
        (_headlamps, finish.headlamp),
        (_tail, finish.tail),
        (_black, finish.black),
        (_panes, finish.glass),
        (lambda p: _panes(p) - 0.02, finish.black),
        (_seams, finish.black),
    )
    parts = []
    for region, material in regions:
        part, shell = shell.split(region)
        parts.append(_section(part, material))
    place(node, "body", mesh("body", [_section(shell, finish.paint), *parts]))
    place(node, "cockpit", mesh("cockpit", _cockpit(finish)))
    wheel = mesh("wheel", _wheel(finish))
    for x, end in zip(AXLES, ("front", "rear"), strict=True):
        for side in (1, -1):
            where = move(x, WHEEL, side * TRACK) @ rotate("y", 0 if side > 0 else 180)
            place(node, f"{end} {'right' if side > 0 else 'left'} wheel", wheel, where)
    return node


def _section(shell: Shell, material: Material) -> Section:
    """Texture coordinates are metres along the two axes that the surface faces least."""
    normals = shell.normals()
    corners = shell.positions[shell.indices]
    faces = np.argmax(np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])), axis=1)
    keys, indices = np.unique(shell.indices + faces[:, None] * len(normals), return_inverse=True)
    axis, vertex = np.divmod(keys, len(normals))
    across = np.array([(2, 1), (0, 2), (0, 1)])[axis]
    positions = shell.positions[vertex]
    uv = np.take_along_axis(positions, across, 1) / _TILE
    return Section.from_arrays(positions, indices.reshape(-1, 3), normals=normals[vertex], uv=uv, material=material)


def _cockpit(finish: Finish) -> list[Section]:
    seats = [
        part
        for x, y, z in ((-0.15, 0.72, 0.34), (-0.15, 0.72, -0.34), (-0.85, 0.64, 0.3), (-0.85, 0.64, -0.3))
        for part in (
            at(box((0.5, 0.16, 0.5), finish.leather, 0.07, 4), move(x + 0.12, y, z)),
            at(box((0.14, 0.46, 0.46), finish.leather, 0.06, 4), move(x - 0.16, y + 0.18, z), rotate("z", 14)),
        )
    ]
    dash = at(box((0.3, 0.1, 1.3), finish.black, 0.05, 4), move(0.68, 0.86, 0))
    wheel = at(torus(0.17, 0.016, finish.black, 24), move(0.42, 0.92, 0.34), rotate("z", 68))
    tub = at(plate((2.5, 0.04, 1.5), 0.3, finish.black), move(-0.35, 0.62, 0))
    return [*seats, dash, wheel, tub]


def _wheel(finish: Finish) -> list[Section]:
    """Its outer side towards +Z."""
    half = TYRE / 2
    tread = [(WHEEL - 0.09, half), (WHEEL, half), (WHEEL, -half), (WHEEL - 0.09, -half)]
    lip, well = WHEEL - 0.085, WHEEL - 0.11
    upright = rotate("x", 90)
    parts = [
        at(lathe(tread, finish.rubber, 0.035, 64, closed=True), upright),
        at(ring(well, lip, TYRE - 0.02, finish.rim, 0.004, 64), upright),
        at(cylinder(0.155, 0.025, finish.rim, 0.006, 48), move(0, 0, -0.01), upright),
        at(cylinder(0.045, 0.05, finish.black, 0.012, 32), move(0, 0, half - 0.045), upright),
        at(box((0.08, 0.19, 0.07), finish.caliper, 0.02), move(0.135, 0, 0)),
    ]
    spoke = box((0.022, well - 0.02, 0.03), finish.rim, 0.008)
    for angle in np.arange(10) * 36.0 + np.tile((5.0, -5.0), 5):
        lean = rotate("x", -6)
        parts.append(at(spoke, rotate("z", angle), move(0, well / 2 + 0.01, half - 0.04), lean))
    return parts
