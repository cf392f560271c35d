"""One factory of the toy world on its part of the slab, and its motion."""

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from pica.scene.animation import Channel
from pica.scene.light import PointLight, SpotLight
from pica.scene.material import Material
from pica.scene.model import Node
from pica.scenes import machines as kinds
from pica.scenes import robots as robot_kinds
from pica.scenes.basic_meshes import box, filleted, lathe, pipe, sphere
from pica.scenes.conveyor import cable_drum, conveyor, crate, goods, run
from pica.scenes.lane import Lane
from pica.scenes.motion import HIDDEN, LOOP, beat, particle, spin, swing
from pica.scenes.palette import Palette, linear
from pica.scenes.placing import aim, at, copied, mesh, move, place, rotate
from pica.scenes.robot_motion import go_round
from pica.scenes.tour import (
    CROSS,
    CROSS_MIDDLE,
    DIP,
    GRAVITY,
    HOPPER_X,
    KICK,
    KICKER,
    LONG,
    LONG_MIDDLE,
    tour,
    under,
)

PLOT = (9.0, 6.4)
"""Metres along X and Z."""
LANE = Lane(center=(-1.19, 1.6), straight=(2.1, 0.42), radius=0.65)
PRESS_X, OVEN_X = -1.2, 1.25
BACK_ROW = (-1.75, 0.8, 3.3)
"""Positions along X of machines behind the long belt: in the gaps that the camera sees."""
IN_LANE = (-0.3, -1.95)
"""Positions along X of machines inside the lane."""
MACHINES, ROBOTS = len(BACK_ROW) + len(IN_LANE), 8
"""Maximum numbers in one factory."""
GOODS = 16
CHIPS = 8
PUFFS = 6
PUFFS_A_LOOP = 8
"""How often each puff of steam leaves the chimney."""

Make = Callable[[Palette, Material], Node]


class Kit:
    """Shared by all factories of a world: materials, and objects built once and copied."""

    def __init__(self, rng: np.random.Generator, glass: bool) -> None:
        """`glass`: whether the palette has what lets light through."""
        self.palette = Palette.with_glass() if glass else Palette()
        self.accents: list[Material] = list(rng.permutation(np.array(self.palette.accents, object)))
        tall: list[Make] = [kinds.tank, kinds.gear_tower, kinds.fan]
        self.machines = [tall[i] for i in rng.permutation(len(tall))] + [kinds.mixer]
        self.goods = goods(self.palette)
        self._built: dict[object, Node] = {}

    def copy(self, key: object, name: str, make: Callable[[], Node]) -> Node:
        """A copy of the result of `make`, which is called for the first use of `key`."""
        if key not in self._built:
            self._built[key] = make()
        return copied(self._built[key], name)

    def make(self, make: Make, accent: Material, name: str) -> Node:
        """A copy of a machine or a robot in a colour."""
        return self.copy((make, accent.name), name, lambda: make(self.palette, accent))


class Factory:
    """A factory for fruit. `node` is its root, `channels` its motion, by the name of the animation."""

    def __init__(self, kit: Kit, rng: np.random.Generator, name: str, machines: int, robots: int) -> None:
        self.node = Node(name)
        self.channels: dict[str, list[Channel]] = {"belts": [], "machines": [], "robots": [], "particles": []}
        self._kit, self._rng = kit, rng
        self._taken: list[tuple[float, float, float]] = []
        self._belts()
        self._line()
        self._goods()
        self._chips()
        self._puffs()
        self._machines(machines)
        self._lamp_posts()
        self._robots(robots)
        self._clutter()
        spot = SpotLight(
            color=(1.0, 0.85, 0.66), intensity=14.0, inner_cone_angle=math.radians(12),
            outer_cone_angle=math.radians(24), radius=0.08, name="work light",
        )  # fmt: skip
        place(self.node, "work light", spot, aim((2.6, 4.0, 3.4), (2.75, 0.5, 0.8)))

    def _add(self, node: Node, x: float, z: float, degrees: float = 0.0) -> Node:
        node.transform = move(x, 0.001, z) @ rotate("y", degrees)
        return self.node.add(node)

    def _belts(self) -> None:
        palette, accent = self._kit.palette, self._kit.accents[0]
        for name, belt, (x, z), degrees in (
            ("long belt", LONG, LONG_MIDDLE, 0.0),
            ("cross belt", CROSS, CROSS_MIDDLE, -90.0),
        ):
            node = self._kit.copy(name, name, partial(conveyor, palette, accent, belt))
            self.channels["belts"] += run(self._add(node, x, z, degrees), belt)
        self._block(LONG_MIDDLE, 3.4, 0.95)
        self._block((CROSS_MIDDLE[0], 0.75), 0.6, 2.3)

    def _line(self) -> None:
        """The machines along the belts: hopper, press, oven and kicker, in step with the goods."""
        palette, accents = self._kit.palette, self._kit.accents
        for make, x, accent in (
            (kinds.hopper, HOPPER_X, accents[1]),
            (kinds.press, PRESS_X, accents[2]),
            (kinds.oven, OVEN_X, accents[3]),
        ):
            name = make.__name__
            self._add(self._kit.copy(name, name, partial(make, palette, accent, LONG.height)), x, LONG_MIDDLE[1])
        self._add(self._kit.make(kinds.kicker, accents[4], "kicker"), *KICKER)
        ram, pad = (self._part(name) for name in ("ram", "pad"))
        stamp = np.array([0, 0.14, 0.18, 0.5, 0.6]), np.array([0.14, -0.09, -0.09, 0.12, 0.14])
        self.channels["belts"] += beat(ram, *stamp, GOODS, under(PRESS_X) - 0.16)
        throw = np.array([0, 0.05, 0.2, 0.24, 0.3, 0.6]), np.array([0, -DIP, -DIP, 0.05, 0.03, 0])
        self.channels["belts"] += beat(pad, *throw, GOODS, KICK - 0.2)

    def _goods(self) -> None:
        for i in range(GOODS):
            good = self._kit.goods[self._rng.choice(len(self._kit.goods), p=(0.3, 0.25, 0.2, 0.15, 0.1))]
            yaw = float(self._rng.uniform(0, 2 * math.pi))
            if good.square:
                yaw = round(yaw / (math.pi / 2)) * math.pi / 2
            side = float(self._rng.uniform(-1, 1)) * (0.02 if good.square else 0.07)  # as the spout is wide
            node = self.node.add(Node(f"{good.mesh.name} {i}", mesh=good.mesh))
            self.channels["belts"] += tour(node, good, side, yaw, i * LOOP / GOODS)

    def _chips(self) -> None:
        """Particles from under the press at each stroke."""
        material = self._kit.palette.brass
        chip = self._kit.copy("chip", "chip", lambda: Node(mesh=mesh("chip", [box((0.05, 0.012, 0.03), material)])))
        life, start = 0.42, np.array((PRESS_X, LONG.height + 0.32, LONG_MIDDLE[1]))
        ages = np.linspace(0, life, 7)
        sizes = np.array([HIDDEN, 0.8, 1, 1, 1, 0.7, HIDDEN])
        for i in range(CHIPS):
            angle = 2 * math.pi * (i + self._rng.uniform(0, 1, GOODS)) / CHIPS
            speed = self._rng.uniform((0.7, 1.4), (1.5, 2.4), (GOODS, 2))
            # Out from the ram's edge, more along the belt than towards the posts.
            out = np.stack([np.cos(angle), np.zeros(GOODS), np.sin(angle)], -1)
            leaving = speed[:, :1] * out * np.array((1, 1, 0.4)) + speed[:, 1:] * np.array((0, 1, 0))
            fall = GRAVITY / 2 * ages[:, None] ** 2 * np.array((0, 1, 0))
            places = start + 0.23 * out[:, None] + leaving[:, None] * ages[:, None] - fall
            node = self.node.add(copied(chip, f"chip {i}"))
            self.channels["particles"] += particle(node, places, sizes, life, under(PRESS_X) - 0.02)

    def _puffs(self) -> None:
        """Steam from the oven's chimney."""
        white = self._kit.palette.white
        puff = self._kit.copy("puff", "puff", lambda: Node(mesh=mesh("puff", [sphere(0.13, white, 16)])))
        x, y, z = kinds.CHIMNEY
        start = np.array((OVEN_X + x + 0.12, LONG.height + kinds.OVEN_ROOF + y, LONG_MIDDLE[1] + z))
        age = np.linspace(0, 1, 9)
        sizes = np.interp(age, (0, 0.12, 0.5, 0.8, 1), (HIDDEN, 0.5, 1.0, 0.7, HIDDEN))
        for i in range(PUFFS):
            drift = self._rng.uniform((0.45, 0.9, -0.2), (0.6, 1.2, 0.2), (PUFFS_A_LOOP, 3))
            # Slower and slower away from the mouth, faster and faster up.
            gone = np.stack([-np.sqrt(age), age**1.5, age], -1)
            places = start + drift[:, None] * gone
            life = LOOP / PUFFS_A_LOOP - 2e-3
            node = self.node.add(copied(puff, f"puff {i}"))
            delay = LOOP / PUFFS_A_LOOP * i / PUFFS
            self.channels["particles"] += particle(node, places, sizes, life, delay)

    def _machines(self, count: int) -> None:
        kit, rng = self._kit, self._rng
        spots = [(x, -2.3, 30.0) for x in BACK_ROW] + [(x, LANE.center[1], 3.0) for x in IN_LANE]
        for i, (x, z, twist) in enumerate(spots[:count]):
            kind = i % len(kit.machines)
            name = kit.machines[kind].__name__.replace("_", " ")
            machine = kit.make(kit.machines[kind], kit.accents[(kind + 4) % len(kit.accents)], f"{name} {i}")
            self._add(machine, x + float(rng.uniform(-0.1, 0.1)), z, float(rng.uniform(-twist, min(twist, 5))))
            self._taken.append((x, z, kinds.MACHINE_RADIUS))
            self.channels["machines"] += _work(machine)

    def _robots(self, count: int) -> None:
        kit, rng = self._kit, self._rng
        makers: list[Make] = [robot_kinds.roller, robot_kinds.walker, robot_kinds.balancer]
        gap = LANE.length / max(count, 1)
        slack = max(min(gap, 3.0) - 2 * robot_kinds.ROBOT_RADIUS - 0.5, 0)
        first = float(rng.uniform(0, LANE.length))
        for i in range(count):
            make = makers[i % len(makers)]
            robot = kit.make(make, kit.accents[(2 * i + 1) % len(kit.accents)], f"{make.__name__} {i}")
            self._add(robot, 0, 0)
            start = first + i * gap + float(rng.uniform(-0.5, 0.5)) * slack
            self.channels["robots"] += go_round(robot, LANE, start, rng)
        for share in np.linspace(0, 1, 40, endpoint=False):
            (place_on_lane,), _ = LANE.at(np.array([share * LANE.length]))
            self._taken.append((place_on_lane[0], place_on_lane[2], robot_kinds.ROBOT_RADIUS))

    def _lamp_posts(self) -> None:
        bulb = PointLight(color=linear("#ffd2a0"), intensity=1.8, radius=0.05, name="bulb")
        for i, (x, z, facing) in enumerate(((-3.15, 1.6, 200.0), (4.05, -0.9, 150.0))):
            self._taken.append((x, z, 0.22))
            post = self._kit.copy("lamp post", f"lamp post {i}", lambda: _lamp_post(self._kit.palette))
            lamp = self._add(post, x, z, facing).children[0]
            place(lamp, "bulb", bulb, move(0, -0.22, 0))
            self.channels["machines"] += swing(lamp, (1, 0, 0), 6.0, 8 + i)

    def _clutter(self) -> None:
        """Crates, cable and fruit wherever there is still room."""
        kit, rng = self._kit, self._rng
        filled = kit.copy("crate", "crate", lambda: _filled_crate(kit, rng))
        drum = kit.copy("cable drum", "cable drum", lambda: cable_drum(kit.palette, kit.accents[5]))
        single = [Node(fruit.mesh.name, mesh=fruit.mesh) for fruit in kit.goods[:3]]
        things = [(0.4, filled), (0.5, drum), (0.4, filled), *((0.15, fruit) for fruit in single * 2)]
        for radius, thing in things:
            spot = self._free(radius, (-4.0, -0.3), (4.1, 2.9))
            if spot is not None:
                self._add(copied(thing, thing.name), *spot, float(rng.uniform(0, 360)))

    def _part(self, name: str) -> Node:
        return next(node for node in self.node.walk() if node.name == name)

    def _block(self, middle: tuple[float, float], half_width: float, half_depth: float) -> None:
        """Keep a rectangle free of clutter, with circles along its longer side."""
        (x, z), radius = middle, min(half_width, half_depth)
        reach = max(half_width, half_depth) - radius
        for step in np.linspace(-reach, reach, math.ceil(reach / radius * 2) + 1):
            self._taken.append((x + step, z, radius) if half_width > half_depth else (x, z + step, radius))

    def _free(self, radius: float, low: Sequence[float], high: Sequence[float]) -> tuple[float, float] | None:
        """Take a free place for a circle with its centre between two (x, z) corners; None: there is none."""
        for _ in range(200):
            x, z = (float(value) for value in self._rng.uniform(low, high))
            edge = min(PLOT[0] / 2 - abs(x), PLOT[1] / 2 - abs(z)) - 0.2
            if min([edge, *(math.hypot(x - cx, z - cz) - r for cx, cz, r in self._taken)]) > radius:
                self._taken.append((x, z, radius))
                return x, z
        return None


def _work(machine: Node) -> list[Channel]:
    """The motion of a free-standing machine."""
    channels: list[Channel] = []
    for part in machine.children:
        if part.name == "valve wheel":
            channels += swing(part, (0, 0, 1), 100.0, 3)
        elif part.name in _SPINS:
            axis, turns = _SPINS[part.name]
            channels += spin(part, axis, turns)
    return channels


_SPINS = {
    "large gear": ((0, 0, 1), 5),
    "upper gear": ((0, 0, 1), -8),
    "lower gear": ((0, 0, 1), -8),
    "blades": ((0, 0, 1), -28),
    "drum": ((1, 0, 0), 5),
}
"""Axis and revolutions a loop; those of gears are inverse to their teeth, 16 and 10."""


def _lamp_post(palette: Palette) -> Node:
    """Its first child is the lamp, which hangs from the arm's end."""
    arm = filleted([(0, 0.1, 0), (0, 1.75, 0), (0.4, 1.75, 0), (0.4, 1.6, 0)], 0.16, 6)[0]
    shade = [(0, 0.12), (0.05, 0.12), (0.2, 0), (0.18, 0), (0.04, 0.09), (0, 0.09)]
    foot = at(lathe([(0, 0.16), (0.06, 0.16), (0.2, 0), (0, 0)], palette.dark, 0.04, 32), move(0, 0, 0))
    node = Node("lamp post", mesh=mesh("lamp post", [foot, pipe(arm, 0.035, palette.dark, 16)]))
    lamp = [
        at(lathe(shade, palette.copper, 0.008, 32), move(0, -0.1, 0)),
        at(sphere(0.07, palette.warm_lamp, 20), move(0, -0.08, 0)),
    ]
    place(node, "lamp", mesh("lamp", lamp), move(0.4, 1.6, 0))
    return node


def _filled_crate(kit: Kit, rng: np.random.Generator) -> Node:
    filled, orange = crate(kit.palette, kit.palette.accents[4]), kit.goods[0].mesh
    for row in range(2):
        for column in range(2):
            placement = move(0.26 * column - 0.13, 0.06, 0.22 * row - 0.11) @ rotate("y", float(rng.uniform(0, 360)))
            place(filled, orange.name, orange, placement)
    return filled
