"""The round trip of the toy world's goods: hopper, long belt, cross belt, kicker and through the air to the hopper."""

import math

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import Channel
from pica.scene.model import Node
from pica.scenes.conveyor import BELT_RADIUS, CLEARANCE, Belt, Good
from pica.scenes.machines import PAD_HEIGHT
from pica.scenes.motion import LOOP, about, delayed, follow, product, turned

Floats = NDArray[np.float64]

LONG, CROSS = Belt(length=6.7, height=0.72), Belt(length=4.0, height=0.44)
LONG_MIDDLE, CROSS_MIDDLE = (-0.9, -0.75), (2.64, 0.6)
"""Where the belts are, (x, z); the long one runs along +X, the cross belt that it feeds along +Z."""
HOPPER_X = -3.75
SPOUT = LONG.height + 0.42
"""Height in metres of the hopper's lower end."""
KICKER = (2.57, 2.825)
"""(x, z) metres."""
KICK = 22.0
"""Seconds from a fall out of the hopper to the kicker's kick."""
FLIGHT = 1.3
"""Seconds in the air."""
ROLL = 0.1
"""Metres that a thing goes on by when it falls on the kicker: else it would hit the belt when it is thrown."""
DIP = 0.015
"""Metres that the kicker's pad gives way."""
GRAVITY = 9.81
FALL = 0.55
"""Metres from the hopper's throat to the belt."""
FALL_TIME = math.sqrt(2 * FALL / GRAVITY)

_TIP = np.linspace(0, math.pi / 2, 16)
_ACROSS, _DOWN = about((0, 0, 1), -math.pi / 2), about((1, 0, 0), math.pi / 2)
_BOTH_TIPS = product(_DOWN, _ACROSS)[0]
"""Tipping over the ends of both belts comes to a third of a turn about one axis; the flight adds the rest."""


def under(x: float) -> float:
    """Seconds from a fall out of the hopper until a thing on the long belt is at `x` metres."""
    return FALL_TIME + (x - HOPPER_X) / LONG.speed


def tour(node: Node, good: Good, side: float, yaw: float, delay: float) -> list[Channel]:
    """One round trip a loop, `delay` seconds after the first; `side` metres off the belt's middle, turned by `yaw`."""
    times, path = _path(good, side)
    moments, path = delayed(times, path, delay)
    rotation = about((0, 1, 0), yaw)
    for axis, angles in zip(((0, 0, -1), (1, 0, 0), _BOTH_TIPS[:3]), path[:, 3:].T, strict=True):
        rotation = product(about(axis, angles), rotation)
    return follow(node, moments, path[:, :3] - turned(rotation, (0, good.middle, 0)), rotation)


def _path(good: Good, side: float) -> tuple[Floats, Floats]:
    """(keys,) seconds and (keys, 6): the middle's place and how far it tips across, tips down and tumbles."""
    keys: list[tuple[float, ...]] = []

    def key(time: float, x: float, y: float, z: float, across: float = 0, down: float = 0, tumble: float = 0) -> None:
        keys.append((time, x, y, z, across, down, tumble))

    quarter = math.pi / 2
    z = LONG_MIDDLE[1] + side
    for time in np.linspace(0, FALL_TIME, 6):
        key(time, HOPPER_X, _release(good) - GRAVITY / 2 * time**2, z)
    # Over the end of the long belt, as if stuck to it, then down on the cross belt.
    end, reach = LONG_MIDDLE[0] + LONG.straight, BELT_RADIUS + CLEARANCE + good.middle
    start, per_radian = under(end), (BELT_RADIUS + CLEARANCE) / LONG.speed
    for angle in _TIP:
        key(start + angle * per_radian, end + reach * math.sin(angle), LONG.axle + reach * math.cos(angle), z, angle)
    x, time = end + reach, start + quarter * per_radian
    height = CROSS.height + CLEARANCE + good.half_width
    time += math.sqrt(2 * max(LONG.axle - height, 0) / GRAVITY)
    key(time, x, height, z, quarter)
    # The same at the end of the cross belt, down on the kicker.
    end, reach = CROSS_MIDDLE[1] + CROSS.straight, BELT_RADIUS + CLEARANCE + good.half_width
    time, per_radian = time + (end - z) / CROSS.speed, (BELT_RADIUS + CLEARANCE) / CROSS.speed
    for angle in _TIP:
        y = CROSS.axle + reach * math.cos(angle)
        key(time + angle * per_radian, x, y, end + reach * math.sin(angle), quarter, angle)
    z, time = end + reach + ROLL, time + quarter * per_radian
    on_pad = PAD_HEIGHT + 0.002 + good.half_width
    key(time + math.sqrt(2 * (CROSS.axle - on_pad) / GRAVITY), x, on_pad, z, quarter, quarter)
    key(KICK - 0.12, x, on_pad, z, quarter, quarter)
    # Through the air into the hopper.
    first = np.array((x, on_pad - DIP, z))
    last = np.array((HOPPER_X, SPOUT + 1.0, LONG_MIDDLE[1]))
    leaving = (last - first) / FLIGHT + (0, GRAVITY * FLIGHT / 2, 0)
    for share in np.linspace(0, 1, 17):
        time = share * FLIGHT
        x, y, z = first + leaving * time - (0, GRAVITY / 2 * time**2, 0)
        key(KICK + time, x, y, z, quarter, quarter, share * 4 / 3 * math.pi)
    key(LOOP, HOPPER_X, _release(good), LONG_MIDDLE[1] + side, quarter, quarter, 4 / 3 * math.pi)
    table = np.array(keys)
    return table[:, 0], table[:, 1:]


def _release(good: Good) -> float:
    """Height of a thing's middle where it starts to fall, hidden in the hopper."""
    return LONG.height + CLEARANCE + good.middle + FALL
