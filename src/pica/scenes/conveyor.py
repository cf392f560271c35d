"""The toy world's conveyor belts and goods."""

import math
from dataclasses import dataclass

import numpy as np

from pica.scene.animation import Channel
from pica.scene.material import Material
from pica.scene.model import Mesh, Node
from pica.scenes.basic_meshes import box, cylinder, filleted, lathe, pipe, ring, sphere, torus
from pica.scenes.motion import LOOP, about, delayed, follow, spin
from pica.scenes.palette import Palette
from pica.scenes.placing import at, mesh, move, place, rotate, stretch

BELT_WIDTH = 0.56
BELT_RADIUS = 0.13
"""Metres from the axle of an end roller to the outside of the belt."""
CLEARANCE = 0.012
"""Metres from the belt to the goods: a little more than a slat's height."""


@dataclass(frozen=True)
class Belt:
    """Where a conveyor is and how fast it runs: once round a loop."""

    length: float
    """Metres along its +X, in which it runs."""
    height: float
    """Metres from its origin to its upper side."""

    @property
    def straight(self) -> float:
        """Metres from the middle to each end's axle."""
        return self.length / 2 - BELT_RADIUS

    @property
    def axle(self) -> float:
        """Height in metres of the axles."""
        return self.height - BELT_RADIUS

    @property
    def speed(self) -> float:
        """Metres per second."""
        return (4 * self.straight + 2 * math.pi * BELT_RADIUS) / LOOP


def conveyor(palette: Palette, accent: Material, belt: Belt) -> Node:
    """A belt along X."""
    node = Node("conveyor")
    axle, straight = belt.axle, belt.straight
    inner, half = BELT_RADIUS - 0.025, BELT_WIDTH / 2
    outline = [(BELT_RADIUS, half), (BELT_RADIUS, -half), (inner, -half), (inner, half)]
    loop = lathe(outline, palette.rubber, 0.008, 32, closed=True, stretch=(straight, 0.0))
    place(node, "belt", mesh("belt", [at(loop, rotate("x", 90))]), move(0, axle, 0))

    slat = mesh("belt slat", [box((0.03, 0.012, BELT_WIDTH * 0.94), palette.dark)])
    for i in range(round(belt.speed * LOOP / 0.42)):
        place(node, f"slat {i}", slat, move(0, belt.height, 0))

    rod = cylinder(inner - 0.004, BELT_WIDTH + 0.03, palette.steel, 0.01, 20)
    roller = mesh("belt roller", [at(rod, rotate("x", 90))])
    for i, x in enumerate(np.linspace(-straight, straight, max(2, round(straight * 2 / 0.8)))):
        place(node, f"roller {i}", roller, move(float(x), axle, 0))

    facing = rotate("x", 90)
    wheel = [at(torus(0.085, 0.018, palette.white, 24), facing), at(cylinder(0.035, 0.03, accent, 0.01, 16), facing)]
    wheel += [at(cylinder(0.012, 0.17, palette.white, 0, 8), rotate("z", 120 * i + 30)) for i in range(3)]
    drive = mesh("drive wheel", wheel)
    for i, (x, side) in enumerate(((-straight, 1), (straight, 1), (-straight, -1), (straight, -1))):
        place(node, f"drive wheel {i}", drive, move(x, axle, side * (half + 0.12)))

    parts = []
    for side in (-1, 1):
        z = side * (half + 0.065)
        parts.append(at(box((belt.length - 0.04, 0.13, 0.07), accent, 0.034), move(0, axle + 0.05, z)))
        for x in np.linspace(0.22 - straight, straight - 0.22, max(2, round(belt.length / 1.6) + 1)):
            foot = lathe([(0, 0.05), (0.05, 0.05), (0.08, 0), (0, 0)], palette.dark, 0.02, 16)
            parts.append(at(cylinder(0.04, axle + 0.02, palette.steel, 0.01, 16), move(float(x), axle / 2 + 0.01, z)))
            parts.append(at(foot, move(float(x), 0.001, z)))
    place(node, "frame", mesh("belt frame", parts))
    return node


def run(node: Node, belt: Belt) -> list[Channel]:
    """A conveyor's slats go once round a loop, its drive wheels rotate with them."""
    bend = np.linspace(0, math.pi, 7)
    top, end = 2 * belt.straight / belt.speed, math.pi * BELT_RADIUS / belt.speed
    times = np.concatenate([top + bend / math.pi * end, 2 * top + end + bend / math.pi * end])
    lean = np.concatenate([bend, math.pi + bend])
    axles = np.repeat((belt.straight, -belt.straight), len(bend))
    radius = BELT_RADIUS + 0.004
    path = np.stack([axles + radius * np.sin(lean), belt.axle + radius * np.cos(lean), -lean], -1)
    times, path = np.append(0, times), np.concatenate([path[-1:] * (1, 1, 0), path])
    times[-1] = LOOP
    slats = [child for child in node.children if child.name.startswith("slat")]
    channels = []
    for i, slat in enumerate(slats):
        moments, where = delayed(times, path, i * LOOP / len(slats))
        channels += follow(slat, moments, where[:, :2] @ np.eye(2, 3), about((0, 0, 1), where[:, 2]))
    turns = round(belt.speed * LOOP / (2 * math.pi * BELT_RADIUS))
    for child in node.children:
        if child.name.startswith("drive wheel"):
            channels += spin(child, (0, 0, 1), -turns)
    return channels


@dataclass(frozen=True)
class Good:
    """Goods for belts, standing on y = 0."""

    mesh: Mesh
    middle: float
    """Height of its middle, metres."""
    half_width: float
    square: bool = False
    """It lies flat on its sides only."""


def goods(palette: Palette) -> list[Good]:
    """The goods on belts and in crates."""
    stalk = pipe([(0, 0.17, 0), (0.01, 0.24, 0)], 0.01, palette.wood, 6)
    leaf = at(sphere(0.05, palette.leaf, 12), move(0.05, 0.215, 0), rotate("z", 25), stretch(1, 0.18, 0.5))
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
        Good(mesh("orange", [at(sphere(0.11, palette.orange, 24), move(0, 0.11, 0)), leaf]), 0.11, 0.11),
        Good(mesh("apple", [lathe(round_fruit, palette.apple, 0.06, 24), stalk, leaf]), 0.1, 0.125),
        Good(mesh("plum", [at(sphere(0.085, palette.plum, 20), move(0, 0.085, 0))]), 0.085, 0.085),
        Good(mesh("tin", [at(part, move(0, 0.12, 0)) for part in tin]), 0.12, 0.108),
        Good(mesh("parcel", [at(part, move(0, 0.123, 0)) for part in parcel]), 0.123, 0.123, square=True),
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
