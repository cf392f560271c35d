"""Standing and walking of figures: feet on the ground stay in place, knees follow by inverse kinematics."""

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import Channel
from pica.scene.model import Node
from pica.scenes.figures import ANKLE, SHIN, SIDES, THIGH
from pica.scenes.lane import Lane
from pica.scenes.motion import LOOP, about, follow, product, swing
from pica.scenes.walking import footfalls, from_down, turned_by

Floats = NDArray[np.float64]

STRIDE = 0.9
"""Approximate stride of a figure in metres."""
LIFT = 0.07
"""Metres between a boot and the floor in mid-step."""
KEYS_PER_STRIDE = 24


def stand(body: Node, phase: float) -> list[Channel]:
    """To stand, breathe and look about; `phase` is a fraction of each movement's cycle."""
    parts = {part.name: part for part in body.walk()}
    channels = swing(parts["torso"], (0, 1, 0), 9.0, 3, phase)
    channels += swing(parts["head"], (0, 1, 0), 34.0, 4, phase + 0.3)
    for side, x in SIDES:
        channels += swing(parts[f"{side} arm"], (1, 0, 0.5 * x), 4.0, 5, phase + 0.2 * x)
    return channels


def walk(body: Node, lane: Lane) -> list[Channel]:
    """One lap of the lane a loop."""
    parts = {part.name: part for part in body.walk()}
    strides = round(lane.length / STRIDE)
    stride = lane.length / strides
    times = np.linspace(0, LOOP, strides * KEYS_PER_STRIDE + 1)
    distance = lane.length * times / LOOP
    places, headings = lane.at(distance)
    # Lowest where both feet are down, so that the legs reach.
    places[:, 1] = -0.022 - 0.012 * np.cos(4 * np.pi * distance / stride)
    channels = follow(body, times, places, about((0, 1, 0), headings))
    for (side, _), offset in zip(SIDES, (0.0, 0.5), strict=True):
        thigh, shin, boot = (parts[f"{side} {part}"] for part in ("thigh", "shin", "boot"))
        floor = boot.transform[:3, 3] * (1, 0, 1)
        ankles = footfalls(lane, distance, stride, floor, offset, LIFT) + np.array((0, ANKLE, 0)) - places
        local = turned_by(ankles, -headings)
        upper, lower = bent_leg(local - thigh.transform[:3, 3])
        channels += follow(boot, times, local)
        channels += follow(thigh, times, rotation=upper)
        channels += follow(shin, times, rotation=lower)
    channels += swing(parts["torso"], (0, 1, 0), 5.0, strides)
    channels += swing(parts["head"], (0, 1, 0), 22.0, 3)
    for side, x in SIDES:
        channels += swing(parts[f"{side} arm"], (1, 0, 0), 15.0, strides, 0.5 if x > 0 else 0.0)
    return channels


def bent_leg(ankles: Floats) -> tuple[Floats, Floats]:
    """Rotations of thigh and shin, (count, 4) each, that bring the ankle to `ankles`, (count, 3) metres from the hip.

    The knee bends towards +Z. The leg points at targets out of its reach.
    """
    reach = np.clip(np.linalg.norm(ankles, axis=1), abs(THIGH - SHIN) + 1e-6, THIGH + SHIN)
    # The law of cosines, at the hip and at the knee.
    hip = np.arccos(np.clip((THIGH**2 + reach**2 - SHIN**2) / (2 * THIGH * reach), -1, 1))
    knee = np.pi - np.arccos(np.clip((THIGH**2 + SHIN**2 - reach**2) / (2 * THIGH * SHIN), -1, 1))
    return product(from_down(ankles), about((1, 0, 0), -hip)), about((1, 0, 0), knee)
