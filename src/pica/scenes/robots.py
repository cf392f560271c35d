"""The toy world's robots. Each stands on y = 0, looks along +Z and is under a metre tall.

Moving parts are nodes with their pivots: heads, arms, wheels, legs and feet.
"""

from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Section
from pica.scenes.basic_meshes import box, cylinder, filleted, frustum, lathe, pipe, ring, sphere, torus
from pica.scenes.palette import Palette
from pica.scenes.placing import at, mesh, move, place, rotate, stretch

ROBOT_RADIUS = 0.46
"""Metres of floor round a robot's origin that it needs."""
WHEEL_RADIUS, WHEEL_TRACK = 0.18, 0.295
"""Metres; the track is from the robot's middle to each wheel's."""
BALL_RADIUS = 0.206
ANKLE = 0.09
"""Metres from a walker's sole to its leg's joint."""
LEGS = (("front left", 1, 1), ("front right", -1, 1), ("back left", 1, -1), ("back right", -1, -1))
"""A walker's legs and on which side along (x, z) they are."""


def roller(palette: Palette, accent: Material) -> Node:
    """A round robot on two wheels with a visor."""
    robot = Node("roller")
    cup = lathe([(0, 0.66), (0.21, 0.66), (0.25, 0.2), (0, 0.13)], accent, 0.09, 32)
    belly = lathe([(0.262, 0.36), (0.272, 0.36), (0.277, 0.3), (0.266, 0.3)], palette.white, 0.004, 32, closed=True)
    button = at(sphere(0.035, palette.warm_lamp, 16), move(0, 0.5, 0.225))
    neck = at(cylinder(0.07, 0.1, palette.rubber, 0.02, 20), move(0, 0.69, 0))
    caster = at(sphere(0.06, palette.rubber, 16), move(0, 0.06, -0.2))
    caster_arm = pipe([(0, 0.07, -0.2), (0, 0.25, -0.14)], 0.025, palette.steel)
    place(robot, "body", mesh("roller body", [cup, belly, button, neck, caster, caster_arm]))

    face = at(box((0.36, 0.2, 0.08), palette.black, 0.04), move(0, 0.16, 0.155))
    eye = at(sphere(0.04, palette.eye, 16), stretch(0.8, 1.15, 0.4))
    eyes = [at(eye, move(x, 0.17, 0.194)) for x in (-0.08, 0.08)]
    ears = [at(cylinder(0.075, 0.05, accent, 0.02, 20), move(x, 0.16, 0), rotate("z", 90)) for x in (-0.245, 0.245)]
    antenna = [
        pipe([(0.1, 0.28, 0), (0.1, 0.42, 0)], 0.01, palette.steel, 8),
        at(sphere(0.032, palette.red_lamp, 16), move(0.1, 0.44, 0)),
    ]
    skull = at(box((0.46, 0.32, 0.36), palette.white, 0.12), move(0, 0.16, 0))
    head = [skull, face, *eyes, *ears, *antenna, *_helmet(palette, 0.37, 0.18)]
    place(robot, "head", mesh("roller head", head), move(0, 0.73, 0))

    tyre = [at(torus(0.135, 0.045, palette.rubber, 32), rotate("z", 90))]
    hub = at(cylinder(0.105, 0.07, palette.white, 0.02, 24), rotate("z", 90))
    bolts = [
        at(cylinder(0.018, 0.085, palette.copper, 0.006, 8), rotate("x", 72 * i), move(0, 0.062, 0), rotate("z", 90))
        for i in range(5)
    ]
    wheel = mesh("roller wheel", [*tyre, hub, *bolts])
    for name, x in (("left wheel", WHEEL_TRACK), ("right wheel", -WHEEL_TRACK)):
        place(robot, name, wheel, move(x, WHEEL_RADIUS, 0.03))
    _arms(robot, palette, accent, shoulder=(0.27, 0.56, 0.0), reach=0.24)
    return robot


def walker(palette: Palette, accent: Material) -> Node:
    """A box on four short legs with one big eye."""
    robot = Node("walker")
    trunk = at(box((0.5, 0.4, 0.46), accent, 0.13), move(0, 0.48, 0))
    band = at(box((0.515, 0.07, 0.475), palette.white, 0.03), move(0, 0.38, 0))
    hatch = at(cylinder(0.12, 0.05, palette.dark, 0.02, 24), move(0, 0.69, 0))
    light = at(lathe([(0, 0.09), (0.06, 0.09), (0.06, 0), (0, 0)], palette.warm_lamp, 0.05, 20), move(0, 0.712, 0))
    tail = pipe(filleted([(0, 0.5, -0.22), (0, 0.5, -0.34), (0, 0.66, -0.36)], 0.08)[0], 0.016, palette.copper, 8)
    tail_ball = at(sphere(0.035, palette.copper, 16), move(0, 0.67, -0.36))
    dome = _helmet(palette, 0.15, 0.74)
    place(robot, "body", mesh("walker body", [trunk, band, hatch, light, tail, tail_ball, *dome]))

    looking = rotate("x", 90)
    parts = [
        at(ring(0.115, 0.15, 0.07, palette.copper, 0.02), looking),
        at(sphere(0.125, palette.white, 32), stretch(1, 1, 0.6)),
        at(sphere(0.062, palette.black, 24), move(0, 0, 0.058), stretch(1, 1, 0.4)),
        at(sphere(0.016, palette.warm_lamp, 12), move(0.024, 0.028, 0.078)),
    ]
    place(robot, "eye", mesh("walker eye", parts), move(0, 0.52, 0.23))

    thigh = frustum(0.04, 0.06, 0.19, palette.white, 0.01, 20)
    leg = mesh("walker leg", [sphere(0.075, palette.steel, 20), at(thigh, move(0, -0.115, 0))])
    sole = lathe([(0, 0.09), (0.06, 0.09), (0.095, 0), (0, 0)], palette.dark, 0.03, 24)
    foot = mesh("walker foot", [at(sole, move(0, 0.002, 0))])
    for name, x, z in LEGS:
        place(robot, f"{name} leg", leg, move(x * 0.19, 0.262, z * 0.18))
        place(robot, f"{name} foot", foot, move(x * 0.19, 0, z * 0.18))
    return robot


def balancer(palette: Palette, accent: Material) -> Node:
    """A bell on a ball with goggle eyes."""
    robot = Node("balancer")
    ball = [sphere(0.19, palette.rubber, 32), at(torus(0.188, 0.016, accent, 32), rotate("z", 90))]
    place(robot, "ball", mesh("balancer ball", ball), move(0, BALL_RADIUS, 0))
    bell = lathe(
        [(0, 0.84), (0.17, 0.84), (0.19, 0.6), (0.27, 0.24), (0.235, 0.24), (0.16, 0.5), (0, 0.5)], accent, 0.05, 32
    )
    skirt = at(torus(0.262, 0.022, palette.brass, 32), move(0, 0.25, 0))
    place(robot, "body", mesh("balancer body", [bell, skirt]))

    head = [at(lathe([(0, 0.2), (0.175, 0.2), (0.19, 0), (0, 0)], palette.white, 0.12, 32), move(0, 0.025, 0))]
    head.append(at(torus(0.17, 0.025, palette.steel, 32), move(0, 0.022, 0)))
    for x in (-0.085, 0.085):
        head.append(at(sphere(0.078, palette.white, 24), move(x, 0.13, 0.155)))
        head.append(at(ring(0.06, 0.086, 0.05, palette.dark, 0.012, 24), move(x, 0.13, 0.15), rotate("x", 90)))
        head.append(at(sphere(0.036, palette.black, 16), move(x * 0.92, 0.13, 0.215)))
    head.append(pipe(filleted([(0, 0.2, -0.05), (0, 0.32, -0.05), (0, 0.34, 0.05)], 0.05)[0], 0.012, palette.steel, 8))
    head.append(at(sphere(0.03, palette.eye, 16), move(0, 0.34, 0.06)))
    head += _helmet(palette, 0.3, 0.16)
    place(robot, "head", mesh("balancer head", head), move(0, 0.835, 0))
    _arms(robot, palette, accent, shoulder=(0.2, 0.66, 0.0), reach=0.2)
    return robot


def _helmet(palette: Palette, radius: float, height: float) -> list[Section]:
    """A ball of thin glass about the height `height`; none if the palette has no glass."""
    return [] if palette.dome is None else [at(sphere(radius, palette.dome, 24), move(0, height, 0))]


def _arms(robot: Node, palette: Palette, accent: Material, shoulder: tuple[float, float, float], reach: float) -> None:
    """Two bent arms with round hands, held out to the front."""
    x, y, z = shoulder
    for name, side in (("left arm", 1), ("right arm", -1)):
        path = filleted([(0, 0, 0), (side * 0.1, -0.1, 0.03), (side * 0.07, -0.16, reach)], 0.08)[0]
        arm: Mesh = mesh(f"{robot.name} {name}", [
            sphere(0.055, palette.steel, 16),
            pipe(path, 0.028, palette.rubber, 12),
            *_hand(palette, accent, path[-1]),
        ])  # fmt: skip
        place(robot, name, arm, move(side * x, y, z))


def _hand(palette: Palette, accent: Material, place: tuple[float, float, float]) -> list[Section]:
    there = move(*place)
    cuff = at(cylinder(0.042, 0.05, palette.white, 0.014, 16), there, rotate("x", 90))
    fingers = [
        at(cylinder(0.018, 0.11, accent, 0.018, 12), there, rotate("z", 120 * i), move(0, 0.034, 0.06), rotate("x", 80))
        for i in range(3)
    ]
    return [cuff, *fingers]
