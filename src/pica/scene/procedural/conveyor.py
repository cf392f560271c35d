"""The toy world's conveyor belts and what rides on them."""

import numpy as np

from pica.scene.material import Material
from pica.scene.model import Mesh, Node
from pica.scene.procedural.palette import Palette
from pica.scene.procedural.placing import at, mesh, move, place, stretch, turn
from pica.scene.procedural.primitives import box, cylinder, filleted, lathe, pipe, ring, sphere, torus

BELT_WIDTH = 0.56
BELT_RADIUS = 0.13
"""Metres from the axle of an end roller to the outside of the belt."""


def conveyor(palette: Palette, accent: Material, length: float, height: float) -> Node:
    """A belt along X over `length` metres whose upper side is `height` metres above y = 0."""
    node = Node("conveyor")
    axle = height - BELT_RADIUS
    straight = length / 2 - BELT_RADIUS
    inner, half = BELT_RADIUS - 0.025, BELT_WIDTH / 2
    outline = [(BELT_RADIUS, half), (BELT_RADIUS, -half), (inner, -half), (inner, half)]
    loop = lathe(outline, palette.rubber, 0.008, 32, closed=True, stretch=(straight, 0.0))
    place(node, "belt", mesh("belt", [at(loop, turn("x", 90))]), move(0, axle, 0))

    cleat = mesh("belt cleat", [box((0.03, 0.012, BELT_WIDTH * 0.94), palette.dark, 0.005, 1)])
    for i, x in enumerate(np.linspace(-straight, straight, round(straight * 2 / 0.28) + 1)):
        place(node, f"cleat {i}", cleat, move(float(x), height + 0.004, 0))

    rod = cylinder(inner - 0.004, BELT_WIDTH + 0.03, palette.steel, 0.01, 20)
    roller = mesh("belt roller", [at(rod, turn("x", 90))])
    for i, x in enumerate(np.linspace(-straight, straight, max(2, round(straight * 2 / 0.8)))):
        place(node, f"roller {i}", roller, move(float(x), axle, 0))

    parts = []
    for side in (-1, 1):
        z = side * (half + 0.065)
        parts.append(at(box((length - 0.04, 0.13, 0.07), accent, 0.034), move(0, axle + 0.05, z)))
        parts += [
            at(cylinder(0.045, 0.03, palette.white, 0.012, 16), move(float(x), axle, z + side * 0.038), turn("x", 90))
            for x in (-straight, straight)
        ]
        for x in np.linspace(-straight + 0.1, straight - 0.1, max(2, round(length / 1.6) + 1)):
            foot = lathe([(0, 0.05), (0.05, 0.05), (0.08, 0), (0, 0)], palette.dark, 0.02, 16)
            parts.append(at(cylinder(0.04, axle + 0.02, palette.steel, 0.01, 16), move(float(x), axle / 2 + 0.01, z)))
            parts.append(at(foot, move(float(x), 0.001, z)))
    place(node, "frame", mesh("belt frame", parts))
    return node


def goods(palette: Palette) -> list[tuple[Mesh, float]]:
    """What rides on belts and lies in crates, each standing on y = 0, with its radius in metres."""
    stalk = pipe([(0, 0.17, 0), (0.01, 0.24, 0)], 0.01, palette.wood, 6)
    leaf = at(sphere(0.05, palette.leaf, 12), move(0.05, 0.215, 0), turn("z", 25), stretch(1, 0.18, 0.5))
    round_fruit = [(0, 0.19), (0.09, 0.2), (0.125, 0.1), (0.06, 0), (0, 0.005)]
    tin = [cylinder(0.1, 0.24, palette.copper, 0.02, 24), *(
        at(torus(0.1, 0.008, palette.steel, 24), move(0, y, 0)) for y in (-0.07, 0.07)
    )]  # fmt: skip
    parcel = [
        box(0.24, palette.accents[4], 0.03, 2),
        box((0.245, 0.245, 0.05), palette.accents[0], 0.02, 2),
        box((0.05, 0.246, 0.246), palette.accents[0], 0.02, 2),
    ]
    return [
        (mesh("orange", [at(sphere(0.11, palette.orange, 24), move(0, 0.11, 0)), leaf]), 0.12),
        (mesh("apple", [lathe(round_fruit, palette.apple, 0.06, 24), stalk, leaf]), 0.12),
        (mesh("plum", [at(sphere(0.085, palette.plum, 20), move(0, 0.085, 0), stretch(1.15, 1, 1))]), 0.1),
        (mesh("tin", [at(part, move(0, 0.12, 0)) for part in tin]), 0.11),
        (mesh("parcel", [at(part, move(0, 0.123, 0)) for part in parcel]), 0.18),
    ]


def crate(palette: Palette, accent: Material) -> Node:
    """An open box of 0.6 x 0.36 x 0.44 metres on y = 0."""
    width, height, depth = 0.6, 0.34, 0.44
    parts = [at(box((width - 0.06, 0.04, depth - 0.06), palette.wood, 0.015, 1), move(0, 0.03, 0))]
    for level in (0.09, 0.2, 0.31):
        for side in (-1, 1):
            parts.append(at(box((width, 0.085, 0.035), palette.wood, 0.014, 1), move(0, level, side * depth / 2)))
            parts.append(at(box((0.035, 0.085, depth), palette.wood, 0.014, 1), move(side * width / 2, level, 0)))
    for x in (-1, 1):
        for z in (-1, 1):
            post = box((0.06, height + 0.03, 0.06), accent, 0.02, 2)
            parts.append(at(post, move(x * (width / 2 - 0.012), height / 2 + 0.016, z * (depth / 2 - 0.012))))
    node = Node("crate", mesh=mesh("crate", parts))
    return node


def cable_drum(palette: Palette, accent: Material) -> Node:
    """A spool of cable lying on its side with its end on the floor."""
    flange = cylinder(0.27, 0.05, palette.wood, 0.02, 32)
    parts = [at(flange, move(0, 0.025, 0)), at(flange, move(0, 0.335, 0))]
    parts += [at(torus(0.16, 0.028, accent, 32), move(0, 0.08 + 0.05 * i, 0)) for i in range(5)]
    parts.append(at(cylinder(0.15, 0.26, palette.dark, 0, 24), move(0, 0.18, 0)))
    parts.append(at(ring(0.05, 0.09, 0.03, palette.steel, 0.01, 20), move(0, 0.37, 0)))
    loose = [(0.16, 0.08, 0), (0.16, 0.08, 0.2), (0.26, 0.027, 0.38), (0.1, 0.027, 0.5), (-0.2, 0.027, 0.44)]
    parts.append(pipe(filleted(loose, 0.14, 8)[0], 0.026, accent, 10))
    return Node("cable drum", mesh=mesh("cable drum", parts))
