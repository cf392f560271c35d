"""A toy diorama after the PICA PICA experiment: belts, little machines and robots on a slab in a soft studio."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from pica.errors import SceneError
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, PointLight, RectangleLight, SpotLight
from pica.scene.material import Material
from pica.scene.model import Node, Scene
from pica.scene.procedural import machines as kinds
from pica.scene.procedural import robots as robot_kinds
from pica.scene.procedural.conveyor import cable_drum, conveyor, crate, goods
from pica.scene.procedural.palette import Palette, linear
from pica.scene.procedural.placing import aim, at, copied, mesh, move, place, turn
from pica.scene.procedural.primitives import filleted, lathe, pipe, plate, sphere
from pica.scene.procedural.sky import Window, gradient_sky

SLAB = (9.0, 6.4)
"""Metres along X and Z."""
BELTS = (0.72, 0.52)
"""Heights in metres of the long belt along X and of the lower one that it feeds."""

FRONT = ((-4.0, 0.3), (4.0, 2.8))
"""Corners of the open part of the slab, (x, z) each."""

BACK_ROW = (-1.75, 0.8, 3.3)
"""Where along X machines stand behind the long belt: in the gaps that the camera sees."""


def machine_world(seed: int = 1, machines: int = 4, robots: int = 5) -> Scene:
    """A factory for fruit. The same seed gives the same world; machines and robots are how many stand free.

    Raises SceneError when they do not all fit on the slab.
    """
    rng = np.random.default_rng(seed)
    palette = Palette()
    scene = Scene(f"machine_world {seed}", _sky())
    world = scene.add(Node("world"))
    _ground(world, palette)
    ground_plan = GroundPlan(rng)
    accents = list(rng.permutation(np.array(palette.accents, object)))
    _belts(world, palette, accents, rng)
    ground_plan.block(-0.85, -0.75, 3.75, 0.95)
    ground_plan.block(2.75, 0.5, 0.75, 2.2)
    _lamp_posts(world, palette, ground_plan)
    _machines(world, palette, accents, rng, ground_plan, machines)
    _robots(world, palette, accents, rng, ground_plan, robots)
    _clutter(world, palette, accents, rng, ground_plan)
    _lights(world)
    camera = Camera.look_at((-5.2, 5.7, 10.1), (0.05, -0.05, 0.1), fov=32.5, name="three-quarter")
    place(world, "camera", transform=camera.transform).camera = camera
    return scene


class GroundPlan:
    """Which parts of the slab are taken: circles of (x, z, radius)."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.circles: list[tuple[float, float, float]] = []

    def block(self, x: float, z: float, half_width: float, half_depth: float) -> None:
        """Keep a rectangle free of everything, with circles along its longer side."""
        radius = min(half_width, half_depth)
        reach = max(half_width, half_depth) - radius
        for step in np.linspace(-reach, reach, max(1, math.ceil(reach / radius * 2) + 1)):
            self.circles.append((x + step, z, radius) if half_width > half_depth else (x, z + step, radius))

    def clearance(self, x: float, z: float, radius: float) -> float:
        """Metres between a circle and the nearest taken one, or the slab's edge; negative: no room."""
        edge = min(SLAB[0] / 2 - abs(x), SLAB[1] / 2 - abs(z)) - 0.2
        return min([edge, *(math.hypot(x - cx, z - cz) - r for cx, cz, r in self.circles)]) - radius

    def find(self, radius: float, low: Sequence[float], high: Sequence[float]) -> tuple[float, float] | None:
        """Take a free place for a circle with its centre between two (x, z) corners; None: there is none."""
        for _ in range(400):
            x, z = (float(value) for value in self.rng.uniform(low, high))
            if self.clearance(x, z, radius) > 0:
                self.circles.append((x, z, radius))
                return x, z
        return None

    def take(self, radius: float, what: str, low: Sequence[float], high: Sequence[float]) -> tuple[float, float]:
        """As `find`, but raises SceneError where there is no place."""
        spot = self.find(radius, low, high)
        if spot is None:
            raise SceneError(f"machine_world: no room on the slab for another {what}; ask for fewer of them")
        return spot


def _sky() -> Environment:
    return gradient_sky(
        zenith=(0.24, 0.33, 0.50),
        horizon=(0.52, 0.47, 0.43),
        nadir=(0.20, 0.16, 0.13),
        windows=[Window(azimuth=120, elevation=48, width=80, height=36, radiance=(2.0, 1.95, 1.9))],
        name="soft sky",
    )


def _ground(world: Node, palette: Palette) -> None:
    ground = lathe([(0, 0), (60, 0)], palette.ground, segments=64)
    place(world, "ground", mesh("ground", [ground]), move(0, -0.42, 0))
    slab = plate((SLAB[0], 0.42, SLAB[1]), 1.1, palette.floor, 0.09, 64)
    rim = plate((SLAB[0] + 0.16, 0.16, SLAB[1] + 0.16), 1.18, palette.wood, 0.05, 64)
    track = lathe([(0.55, 0), (0.75, 0)], palette.accents[4], segments=64, stretch=(2.3, 0.5))
    place(world, "track", mesh("track", [track]), move(-0.95, 0.0005, 1.45))
    place(world, "slab", mesh("slab", [at(slab, move(0, -0.21, 0)), at(rim, move(0, -0.34, 0))]))


def _belts(world: Node, palette: Palette, accents: list[Material], rng: np.random.Generator) -> None:
    things = goods(palette)
    for name, length, height, placement in (
        ("long belt", 6.6, BELTS[0], move(-0.95, 0.001, -0.75)),
        ("cross belt", 4.0, BELTS[1], move(2.75, 0.001, 0.6) @ turn("y", -90)),
    ):
        belt = world.add(conveyor(palette, accents[0], length, height))
        belt.name, belt.transform = name, placement
        x = -length / 2 + 0.55
        while x < length / 2 - 0.3:
            thing, radius = things[rng.choice(len(things), p=(0.3, 0.25, 0.2, 0.15, 0.1))]
            side, spin = rng.uniform(-1, 1) * (0.2 - radius), rng.uniform(0, 360)
            place(belt, thing.name, thing, move(x + radius, height + 0.012, side) @ turn("y", spin))
            x += 2 * radius + rng.uniform(0.12, 0.5)


def _machines(
    world: Node, palette: Palette, accents: list[Material], rng: np.random.Generator, plan: GroundPlan, count: int
) -> None:
    for make, x, accent in (
        (kinds.hopper, -3.75, accents[1]), (kinds.press, -1.2, accents[2]), (kinds.oven, 1.25, accents[3])
    ):  # fmt: skip
        machine = world.add(make(palette, accent, BELTS[0]))
        machine.transform = move(x + float(rng.uniform(-0.1, 0.1)), 0.001, -0.75)
    tall: list[Callable[[Palette, Material], Node]] = [kinds.tank, kinds.gear_tower, kinds.fan]
    makers = [tall[i] for i in rng.permutation(len(tall))] + [kinds.mixer]
    built: dict[int, Node] = {}
    for i in range(count):
        kind = i % len(makers)
        if kind not in built:
            built[kind] = makers[kind](palette, accents[(i + 4) % len(accents)])
        if i < len(BACK_ROW):
            x, z = BACK_ROW[i] + float(rng.uniform(-0.1, 0.1)), -2.3
            plan.circles.append((x, z, kinds.MACHINE_RADIUS))
        else:
            x, z = plan.take(kinds.MACHINE_RADIUS, "machine", *FRONT)
        machine = world.add(copied(built[kind], f"{built[kind].name} {i}"))
        machine.transform = move(x, 0.001, z) @ turn("y", float(rng.uniform(-30, 5)))


def _robots(
    world: Node, palette: Palette, accents: list[Material], rng: np.random.Generator, plan: GroundPlan, count: int
) -> None:
    makers = [robot_kinds.roller, robot_kinds.walker, robot_kinds.balancer]
    built: dict[tuple[int, int], Node] = {}
    for i in range(count):
        kind, color = i % len(makers), (2 * i + 1) % len(accents)
        if (kind, color) not in built:
            built[kind, color] = makers[kind](palette, accents[color])
        x, z = plan.take(robot_kinds.ROBOT_RADIUS, "robot", *FRONT)
        robot = world.add(copied(built[kind, color], f"{built[kind, color].name} {i}"))
        robot.transform = move(x, 0.001, z) @ turn("y", float(rng.uniform(-80, 30)))


def _clutter(
    world: Node, palette: Palette, accents: list[Material], rng: np.random.Generator, plan: GroundPlan
) -> None:
    """Crates, cable and fruit wherever there is still room."""
    fruits = [thing for thing, _ in goods(palette)[:3]]
    filled = crate(palette, accents[4])
    for row in range(2):
        for column in range(2):
            placement = move(0.26 * column - 0.13, 0.06, 0.22 * row - 0.11) @ turn("y", float(rng.uniform(0, 360)))
            place(filled, fruits[0].name, fruits[0], placement)
    single = [Node(fruit.name, mesh=fruit) for fruit in fruits]
    for radius, thing in [(0.4, filled), (0.5, cable_drum(palette, accents[5])), (0.4, filled)] + [
        (0.15, fruit) for fruit in single * 2
    ]:
        spot = plan.find(radius, FRONT[0], FRONT[1])
        if spot is not None:
            node = world.add(copied(thing, thing.name))
            node.transform = move(spot[0], 0.001, spot[1]) @ turn("y", float(rng.uniform(0, 360)))


def _lamp_posts(world: Node, palette: Palette, plan: GroundPlan) -> None:
    arm = filleted([(0, 0.1, 0), (0, 1.75, 0), (0.4, 1.75, 0), (0.4, 1.6, 0)], 0.16, 6)[0]
    shade = [(0, 0.12), (0.05, 0.12), (0.2, 0), (0.18, 0), (0.04, 0.09), (0, 0.09)]
    post = mesh("lamp post", [
        at(lathe([(0, 0.16), (0.06, 0.16), (0.2, 0), (0, 0)], palette.dark, 0.04, 32), move(0, 0, 0)),
        pipe(arm, 0.035, palette.dark, 16),
        at(lathe(shade, palette.copper, 0.008, 32), move(0.4, 1.5, 0)),
        at(sphere(0.07, palette.warm_lamp, 20), move(0.4, 1.52, 0)),
    ])  # fmt: skip
    bulb = PointLight(color=linear("#ffd2a0"), intensity=1.8, radius=0.05, name="bulb")
    for i, (x, z, facing) in enumerate(((-4.0, 2.0, 20.0), (4.05, -0.9, 150.0))):
        plan.circles.append((x, z, 0.22))
        node = place(world, f"lamp post {i}", post, move(x, 0.001, z) @ turn("y", facing))
        place(node, "bulb", bulb, move(0.4, 1.38, 0))


def _lights(world: Node) -> None:
    sun = DirectionalLight(color=(1.0, 0.93, 0.82), illuminance=3.2, angular_diameter=math.radians(4.0), name="sun")
    place(world, "sun", sun, aim((6.0, 8.0, 3.2), (0, 0, 0)))
    soft_box = RectangleLight(color=(0.82, 0.90, 1.0), radiance=5.0, width=3.0, height=2.0, name="soft box")
    place(world, "soft box", soft_box, aim((-5.5, 5.0, -5.0), (0, 0.4, 0)))
    spot = SpotLight(
        color=(1.0, 0.85, 0.66), intensity=14.0, inner_cone_angle=math.radians(12), outer_cone_angle=math.radians(24),
        radius=0.08, name="work light",
    )  # fmt: skip
    place(world, "work light", spot, aim((2.6, 4.0, 3.4), (2.75, 0.5, 0.8)))
