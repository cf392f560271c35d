"""Where feet go along a lane: one that is down stays where it is, one that is up swings to its next place."""

import numpy as np
from numpy.typing import NDArray

from pica.scenes.lane import Lane

Floats = NDArray[np.float64]


def footfalls(lane: Lane, distance: Floats, stride: float, hip: Floats, offset: float, lift: float) -> Floats:
    """(count, 3) metres in the world: a foot's positions after the walker has moved by `distance`, (count,) metres.

    The foot touches down every `stride` metres and stays down for half of that. `hip`, (3,), is its position
    relative to the walker, `offset` its phase as a fraction of a stride, `lift` its height in metres.
    """
    step, share = np.divmod(distance / stride + offset, 1)
    # Down for the first half of each step: where the hip passes in the middle of that time.
    down, after = (beside(lane, (step + k + 0.25 - offset) * stride, hip) for k in (0, 1))
    swinging = np.clip(2 * share - 1, 0, 1)[:, None]
    spot = down + (after - down) * swinging * swinging * (3 - 2 * swinging)
    spot[:, 1] += lift * np.sin(np.pi * swinging[:, 0])
    return spot


def beside(lane: Lane, distance: Floats, offset: Floats) -> Floats:
    """(count, 3) positions of a point `offset`, (3,), relative to the walker after these distances."""
    places, headings = lane.at(distance)
    return places + turned_by(np.broadcast_to(offset, places.shape), headings)


def turned_by(points: Floats, headings: Floats) -> Floats:
    """(count, 3) points turned about +Y by `headings`, (count,) radians."""
    sin, cos = np.sin(headings), np.cos(headings)
    x, y, z = points.T
    return np.stack([x * cos + z * sin, y, z * cos - x * sin], -1)


def from_down(directions: Floats) -> Floats:
    """(count, 4) the shortest rotations from -Y to each direction, (count, 3)."""
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    # Half-way between the identity and twice the rotation: (a x b, 1 + a . b) for unit vectors a and b.
    quaternions = np.concatenate([np.cross((0.0, -1.0, 0.0), unit), 1 - unit[:, 1:2]], 1)
    lengths: Floats = np.linalg.norm(quaternions, axis=1, keepdims=True)
    return quaternions / lengths
