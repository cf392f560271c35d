"""Motion of the toy world's robots: wheels and balls roll, feet step, heads look about."""

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import Channel
from pica.scene.model import Node
from pica.scenes.lane import Lane
from pica.scenes.motion import LOOP, about, follow, product, rotation_of, swing
from pica.scenes.robots import ANKLE, BALL_RADIUS, LEGS, WHEEL_RADIUS, WHEEL_TRACK
from pica.scenes.walking import footfalls, from_down, turned_by

Floats = NDArray[np.float64]

STRIDE = 0.32
"""Approximate stride of a walker in metres."""
LIFT = 0.05
"""Metres between a foot and the floor in mid-step."""
KEYS_PER_STRIDE = 16


def go_round(robot: Node, lane: Lane, start: float, rng: np.random.Generator) -> list[Channel]:
    """One lap a loop, `start` metres along the lane at first. The robot's parts are those that pica made it of."""
    parts = {part.name: part for part in robot.children}
    strides = round(lane.length / STRIDE)
    stride = lane.length / strides
    start = round(start / stride * KEYS_PER_STRIDE) / KEYS_PER_STRIDE * stride
    times = np.linspace(0, LOOP, strides * KEYS_PER_STRIDE + 1)
    distance = start + lane.length * times / LOOP
    places, headings = lane.at(distance)
    channels = follow(robot, times, places + np.array((0, robot.transform[1, 3], 0)), about((0, 1, 0), headings))
    for name, side in (("left wheel", -1), ("right wheel", 1)):
        if name in parts:
            channels += _roll(parts[name], times, distance + side * WHEEL_TRACK * headings, WHEEL_RADIUS)
    if "ball" in parts:
        channels += _roll(parts["ball"], times, distance, BALL_RADIUS)
    if "body" in parts and "front left foot" in parts:
        channels += _walk(parts, times, lane, distance, stride)
    for name, degrees in (("head", 38.0), ("eye", 16.0)):
        if name in parts:
            channels += swing(parts[name], (0, 1, 0), degrees, int(rng.integers(3, 7)), float(rng.uniform()))
    for name, phase in (("left arm", 0.0), ("right arm", 0.5)):
        if name in parts:
            channels += swing(parts[name], (1, 0, 0), 14.0, 18, phase)
    return channels


def _roll(part: Node, times: Floats, distance: Floats, radius: float) -> list[Channel]:
    """Roll with the distance; whole revolutions a loop, so it slips by the fraction of one that a lap leaves over."""
    gone = distance - distance[0]
    turns = max(1, round(gone[-1] / (2 * np.pi * radius)))
    angles = gone / gone[-1] * 2 * np.pi * turns
    return follow(part, times, rotation=product(rotation_of(part.transform)[None], about((1, 0, 0), angles)))


def _walk(parts: dict[str, Node], times: Floats, lane: Lane, distance: Floats, stride: float) -> list[Channel]:
    """A trot: legs across from each other step together. A foot that is down stays where it is on the floor."""
    places, headings = lane.at(distance)
    bob = 0.008 * np.cos(4 * np.pi * distance / stride)
    channels = follow(parts["body"], times, bob[:, None] * (0, 1, 0))
    for name, x, z in LEGS:
        thigh, foot = parts[f"{name} leg"], parts[f"{name} foot"]
        offset = 0.0 if x * z > 0 else 0.5
        spot = footfalls(lane, distance, stride, foot.transform[:3, 3], offset, LIFT)
        local = turned_by(spot - places, -headings)
        channels += follow(foot, times, local)
        towards = local + np.array((0, ANKLE, 0)) - thigh.transform[:3, 3]
        channels += follow(thigh, times, rotation=from_down(towards))
    return channels
