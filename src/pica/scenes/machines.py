"""The toy world's machines. Each stands on y = 0 and faces +Z.

Moving parts are nodes with their pivots: rams, drums, gears and fans.
`press` and `oven` straddle a conveyor that runs along X.
"""

import numpy as np

from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Section
from pica.scenes.basic_meshes import box, cylinder, filleted, frustum, lathe, pipe, plate, ring, sphere, torus
from pica.scenes.palette import Palette
from pica.scenes.placing import Matrix, at, mesh, move, place, rotate, stretch

MACHINE_RADIUS = 0.82
"""Metres of floor round a free-standing machine's origin that it needs."""
CHIMNEY = (-0.66, 0.75, -0.3)
"""Where the oven's chimney ends, metres from its middle and, along Y, from its roof."""
OVEN_ROOF = 0.46
"""Metres from the belt to the oven's roof."""
PAD_HEIGHT = 0.12
"""Metres from the floor to the top of a kicker's pad at rest."""


def press(palette: Palette, accent: Material, belt_height: float) -> Node:
    """A gantry with a ram that stamps goods on the belt."""
    node = Node("press")
    top = belt_height + 0.98
    parts = []
    for side in (-1, 1):
        parts.append(at(box((0.34, top, 0.24), palette.white, 0.09), move(0, top / 2, side * 0.63)))
        parts.append(at(plate((0.56, 0.1, 0.36), 0.12, palette.dark, 0.03, 24), move(0, 0.05, side * 0.63)))
    parts.append(at(box((0.62, 0.46, 1.62), accent, 0.14), move(0, top + 0.02, 0)))
    parts.append(at(cylinder(0.2, 0.34, palette.steel, 0.04), move(0, top + 0.36, 0)))
    parts.append(at(torus(0.2, 0.03, palette.copper), move(0, top + 0.32, 0)))
    parts += _beacon(palette, (0, top + 0.24, -0.55))
    parts += [_button(material, (-0.14 + 0.14 * i, top + 0.06, 0.812)) for i, material in enumerate(palette.lamps)]
    place(node, "frame", mesh("press frame", parts))
    ram = [
        at(cylinder(0.09, 0.6, palette.steel, 0.01), move(0, 0.36, 0)),
        at(cylinder(0.2, 0.16, palette.copper, 0.04), move(0, 0.08, 0)),
        at(torus(0.12, 0.03, palette.rubber), move(0, 0.18, 0)),
    ]
    place(node, "ram", mesh("press ram", ram), move(0, belt_height + 0.4, 0))
    return node


def oven(palette: Palette, accent: Material, belt_height: float) -> Node:
    """A tunnel with a warm glow inside and a chimney."""
    node = Node("oven")
    inside, wall, length = 0.5, 0.15, 1.1
    roof = belt_height + OVEN_ROOF
    parts = []
    for side in (-1, 1):
        parts.append(at(box((length, roof, wall * 2), accent, 0.1), move(0, roof / 2, side * (inside + wall))))
        foot = box((length + 0.12, 0.14, wall * 2 + 0.08), palette.dark, 0.05)
        parts.append(at(foot, move(0, 0.07, side * (inside + wall))))
        heater = box((length * 0.8, 0.09, 0.03), palette.fire, 0.012)
        parts.append(at(heater, move(0, belt_height + 0.26, side * (inside - 0.02))))
    arch = plate((length - 0.02, 0.34, inside * 2 + wall * 4), 0.15, accent, 0.15)
    parts.append(at(arch, move(0, roof + 0.1, 0)))
    window = move(0, belt_height + 0.1, inside + 2 * wall)
    parts.append(at(ring(0.15, 0.2, 0.08, palette.brass, 0.02), window, rotate("x", 90)))
    parts.append(at(sphere(0.16, palette.fire), window, stretch(1, 1, 0.15)))
    chimney = filleted([(-0.3, roof + 0.1, -0.3), (-0.3, roof + 0.75, -0.3), (-0.62, roof + 0.75, -0.3)], 0.16, 8)[0]
    parts.append(pipe(chimney, 0.1, palette.copper, 24))
    parts.append(at(ring(0.075, 0.13, 0.08, palette.copper, 0.02, 24), move(-0.64, roof + 0.75, -0.3), rotate("z", 90)))
    parts.append(at(torus(0.12, 0.03, palette.steel), move(-0.3, roof + 0.28, -0.3)))
    parts += _gauge(palette, (0.25, roof + 0.27, 0.3), rotate("x", -60))
    place(node, "body", mesh("oven body", parts))
    return node


def hopper(palette: Palette, accent: Material, belt_height: float) -> Node:
    """A funnel on four legs, full of oranges, that feeds a belt below its spout."""
    node = Node("hopper")
    spout = belt_height + 0.42
    funnel = lathe(
        [(0.5, 1.0), (0.55, 0.92), (0.55, 0.62), (0.27, 0.16), (0.25, 0), (0.2, 0), (0.22, 0.18), (0.48, 0.64)],
        accent, 0.04, 48, closed=True,
    )  # fmt: skip
    parts = [at(funnel, move(0, spout, 0)), at(torus(0.545, 0.035, palette.white, 48), move(0, spout + 0.62, 0))]
    for angle in (0, 90, 180, 270):
        leg = filleted([(0.56, spout + 0.6, 0), (0.74, spout + 0.3, 0), (0.74, 0.03, 0)], 0.1)[0]
        foot = at(lathe([(0, 0.06), (0.06, 0.06), (0.1, 0), (0, 0)], palette.dark, 0.025, 20), move(0.74, 0, 0))
        parts += [at(part, rotate("y", angle + 45)) for part in (pipe(leg, 0.045, palette.steel, 16), foot)]
    place(node, "body", mesh("hopper body", parts))
    orange = mesh("hopper orange", [sphere(0.12, palette.orange, 24)])
    for i, angle in enumerate(np.radians(range(10, 370, 45))):  # a ring, so that what flies in can sink
        place(node, f"orange {i}", orange, move(0.34 * np.cos(angle), spout + 0.78, 0.34 * np.sin(angle)))
    return node


def kicker(palette: Palette, accent: Material) -> Node:
    """A pad on a piston that throws fallen goods."""
    node = Node("kicker")
    foot = lathe([(0, 0.03), (0.19, 0.03), (0.22, 0), (0, 0)], palette.dark, 0.012, 32)
    sleeve = at(ring(0.052, 0.08, 0.05, palette.rubber, 0.008, 24), move(0, 0.04, 0))
    place(node, "base", mesh("kicker base", [foot, sleeve]))
    pad = [
        at(cylinder(0.19, 0.024, accent, 0.01, 32), move(0, -0.012, 0)),
        at(cylinder(0.05, 0.08, palette.steel, 0.005, 16), move(0, -0.05, 0)),
    ]
    place(node, "pad", mesh("kicker pad", pad), move(0, PAD_HEIGHT, 0))
    return node


def tank(palette: Palette, accent: Material) -> Node:
    """A round boiler on legs with pipes, a valve wheel and a lit porthole."""
    node = Node("tank")
    parts = [at(cylinder(0.48, 1.5, accent, 0.4, 48), move(0, 1.16, 0))]
    parts += [at(torus(0.48, 0.035, palette.white, 48), move(0, y, 0)) for y in (0.86, 1.46)]
    for angle in (45, 135, 225, 315):
        leg = at(frustum(0.06, 0.09, 0.55, palette.steel, 0.01, 20), move(0.33, 0.3, 0))
        foot = at(cylinder(0.11, 0.05, palette.dark, 0.02, 20), move(0.33, 0.025, 0))
        parts += [at(part, rotate("y", angle)) for part in (leg, foot)]
    window = move(0, 1.16, 0.47)
    parts.append(at(ring(0.14, 0.19, 0.1, palette.brass, 0.03), window, rotate("x", 90)))
    parts.append(at(sphere(0.15, palette.warm_lamp), window, stretch(1, 1, 0.25)))
    main = filleted([(0, 1.85, 0), (0, 2.14, 0), (0.62, 2.14, 0), (0.62, 0.03, 0)], 0.2, 8)[0]
    parts.append(pipe(main, 0.085, palette.copper, 24))
    for point, rotation in (((0, 1.94, 0), 0), ((0.62, 0.05, 0), 0), ((0.62, 1.1, 0), 0), ((0.31, 2.14, 0), 90)):
        parts.append(at(cylinder(0.125, 0.07, palette.copper, 0.02, 24), move(*point), rotate("z", rotation)))
    thin = filleted([(-0.4, 0.86, 0.2), (-0.66, 0.86, 0.2), (-0.66, 1.5, 0.2), (-0.38, 1.5, 0.2)], 0.12, 8)[0]
    parts.append(pipe(thin, 0.04, palette.steel, 16))
    parts += _gauge(palette, (0.25, 1.62, 0.42), rotate("y", 30))
    place(node, "body", mesh("tank body", parts))
    place(node, "valve wheel", mesh("valve wheel", _hand_wheel(palette)), move(0.62, 1.42, 0.16))
    return node


def mixer(palette: Palette, accent: Material) -> Node:
    """A rotating drum on a cradle."""
    node = Node("mixer")
    parts = [at(plate((1.5, 0.14, 0.9), 0.2, palette.dark, 0.05), move(0, 0.07, 0))]
    for x in (-0.62, 0.62):
        parts.append(at(box((0.18, 0.9, 0.5), palette.white, 0.08), move(x, 0.52, 0)))
        parts.append(at(cylinder(0.17, 0.24, palette.steel, 0.04), move(x, 0.92, 0), rotate("z", 90)))
    parts.append(at(box((0.5, 0.26, 0.2), palette.white, 0.06), move(0, 0.26, 0.3)))
    parts += [_button(m, (-0.12 + 0.12 * i, 0.28, 0.402)) for i, m in enumerate(palette.lamps)]
    parts += _beacon(palette, (-0.62, 0.95, 0), 0.12)
    place(node, "cradle", mesh("mixer cradle", parts))
    side = rotate("z", 90)
    barrel = [(0, 0.48), (0.26, 0.48), (0.47, 0.2), (0.47, -0.2), (0.26, -0.48), (0, -0.48)]
    drum = [at(lathe(barrel, accent, 0.1, 48), side)]
    drum += [at(torus(0.465, 0.035, palette.copper, 48), move(x, 0, 0), side) for x in (-0.17, 0.17)]
    drum += [at(sphere(0.05, palette.brass, 16), rotate("x", 60 * i), move(0, 0.475, 0)) for i in range(6)]
    place(node, "drum", mesh("mixer drum", drum), move(0, 0.92, 0))
    return node


def gear_tower(palette: Palette, accent: Material) -> Node:
    """A tower with three meshing gears on its face."""
    node = Node("gear tower")
    parts = [
        at(box((1.0, 1.5, 0.6), accent, 0.16), move(0, 0.8, -0.1)),
        at(plate((1.24, 0.12, 0.9), 0.2, palette.dark, 0.04), move(0, 0.06, -0.05)),
        at(box((0.7, 0.24, 0.44), palette.white, 0.1), move(0, 1.62, -0.1)),
        *_beacon(palette, (0.2, 1.72, -0.1), 0.13),
        pipe(filleted([(-0.2, 1.7, -0.1), (-0.2, 2.0, -0.1), (-0.2, 2.0, 0.2)], 0.1)[0], 0.05, palette.copper, 16),
        at(frustum(0.05, 0.14, 0.16, palette.copper, 0.015, 24), move(-0.2, 2.0, 0.26), rotate("x", 90)),
    ]
    place(node, "body", mesh("gear tower body", parts))
    big, small = _gear("large gear", palette.brass, palette, 16), _gear("small gear", palette.copper, palette, 10)
    center = move(-0.12, 0.66, 0.27)
    place(node, "large gear", big, center)
    for name, angle in (("upper gear", 53.0), ("lower gear", -6.0)):
        place(node, name, small, center @ _meshing(16, 10, angle))
    return node


def fan(palette: Palette, accent: Material) -> Node:
    """A fan in a ring on a post."""
    node = Node("fan")
    high = 1.35
    facing = rotate("x", 90)
    parts = [
        at(ring(0.52, 0.62, 0.24, accent, 0.045, 48), move(0, high, 0), facing),
        at(lathe([(0, 0.3), (0.1, 0.3), (0.36, 0), (0, 0)], palette.white, 0.05, 32), move(0, 0.001, 0)),
        at(cylinder(0.075, high - 0.75, palette.steel, 0.01, 20), move(0, high / 2 - 0.15, 0)),
        at(box((0.26, 0.16, 0.2), palette.dark, 0.05), move(0, high - 0.66, 0)),
        at(cylinder(0.12, 0.2, palette.dark, 0.05, 24), move(0, high, -0.12), facing),
    ]
    parts += [
        pipe([(0, high, -0.13), (0.54 * np.cos(a), high + 0.54 * np.sin(a), -0.09)], 0.022, palette.steel, 10)
        for a in np.radians((90, 210, 330))
    ]
    place(node, "body", mesh("fan body", parts))
    blade = at(sphere(0.2, palette.white, 24), move(0, 0.28, 0), rotate("y", 28), stretch(0.62, 1.0, 0.1))
    hub = at(sphere(0.11, palette.copper, 24), stretch(1, 1, 0.8))
    blades = mesh("fan blades", [hub, *(at(blade, rotate("z", 72 * i)) for i in range(5))])
    place(node, "blades", blades, move(0, high, 0.02))
    return node


TOOTH_RADIUS = 0.0198
"""Metres that every tooth adds to a gear's pitch radius."""


def _gear(name: str, material: Material, palette: Palette, teeth: int) -> Mesh:
    """A gear round Z; its first tooth points along +X."""
    pitch, facing = teeth * TOOTH_RADIUS, rotate("x", 90)
    tooth = at(box((0.08, 0.052, 0.1), material, 0.012, 1), move(pitch - 0.016, 0, 0))
    return mesh(name, [
        at(ring(pitch - 0.1, pitch - 0.024, 0.1, material, 0.012, 48), facing),
        at(cylinder(pitch - 0.09, 0.05, palette.dark, 0.01), facing),
        at(cylinder(0.06, 0.14, palette.steel, 0.02, 24), facing),
        *(at(tooth, rotate("z", 360 * i / teeth)) for i in range(teeth)),
    ])  # fmt: skip


def _meshing(teeth: int, other_teeth: int, degrees: float) -> Matrix:
    """The position of a gear that meshes, in the direction `degrees`, with one of `teeth` at the origin."""
    distance, direction = (teeth + other_teeth) * TOOTH_RADIUS, np.radians(degrees)
    # At the point of contact, a tooth of one gear meets a gap of the other.
    phase = degrees / (360 / teeth) % 1
    own = degrees + 180 - (0.5 - phase) * 360 / other_teeth
    return move(distance * np.cos(direction), distance * np.sin(direction), 0) @ rotate("z", own)


def _beacon(palette: Palette, foot: tuple[float, float, float], size: float = 0.15) -> list[Section]:
    """A warning lamp."""
    here = move(*foot)
    dome = lathe([(0, 1.5 * size), (0.7 * size, 1.5 * size), (0.7 * size, 0), (0, 0)], palette.red_lamp, 0.6 * size, 24)
    return [at(dome, here), at(cylinder(size, 0.4 * size, palette.dark, 0.1 * size, 24), here)]


def _button(material: Material, center: tuple[float, float, float]) -> Section:
    return at(cylinder(0.045, 0.05, material, 0.016, 20), move(*center), rotate("x", 90))


def _gauge(palette: Palette, center: tuple[float, float, float], facing: Matrix) -> list[Section]:
    """A dial with a needle that faces +Z before it is turned."""
    there = move(*center) @ facing
    return [
        at(cylinder(0.12, 0.05, palette.white, 0.01), there, rotate("x", 90)),
        at(torus(0.12, 0.022, palette.brass), there, move(0, 0, 0.02), rotate("x", 90)),
        at(box((0.012, 0.09, 0.01), palette.red_lamp, 0.004, 1), there, move(0.02, 0.025, 0.03), rotate("z", -40)),
    ]


def _hand_wheel(palette: Palette) -> list[Section]:
    """A wheel round Z with a spindle behind it."""
    facing = rotate("x", 90)
    spokes = [at(cylinder(0.016, 0.28, palette.red, 0, 10), rotate("z", 60 * i)) for i in range(3)]
    spindle = at(cylinder(0.03, 0.12, palette.steel, 0.01, 16), move(0, 0, -0.05), facing)
    return [at(torus(0.14, 0.024, palette.red), facing), *spokes, spindle]
