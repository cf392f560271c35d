"""Keyframes for worlds made in code: everything repeats after LOOP seconds.

Rotations are unit quaternions (x, y, z, w).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.scene.animation import Channel, Path, Pose
from pica.scene.model import Node

Floats = NDArray[np.float64]

LOOP = 24.0
"""Seconds after which everything is where it began."""

HIDDEN = 0.01
"""Scale of a particle that waits to fly."""


def about(axis: ArrayLike, angles: ArrayLike) -> Floats:
    """(count, 4) rotations by `angles`, (count,) radians, about an axis of any length."""
    direction = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    half = np.atleast_1d(np.asarray(angles, np.float64))[:, None] / 2
    return np.concatenate([np.sin(half) * direction, np.cos(half)], 1)


def product(first: Floats, second: Floats) -> Floats:
    """(count, 4) products: rotation by `second`, then by `first`; either may be a single one."""
    # Hamilton's product, scalar part last
    a, b = (np.asarray(each, np.float64) for each in np.broadcast_arrays(first, second))
    vector = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
    return np.concatenate([vector, a[:, 3:] * b[:, 3:] - np.sum(a[:, :3] * b[:, :3], 1, keepdims=True)], 1)


def turned(rotations: Floats, vector: ArrayLike) -> Floats:
    """(count, 3) a vector, (3,) or (count, 3), turned by (count, 4) rotations."""
    axis, scalar = rotations[:, :3], rotations[:, 3:]
    across: Floats = 2 * np.cross(axis, np.asarray(vector, np.float64))
    return np.asarray(vector) + scalar * across + np.cross(axis, across)


def rotation_of(matrix: Floats) -> Floats:
    """(4,) the rotation of a (4, 4) matrix without scale."""
    # The eigenvector of the largest eigenvalue (Bar-Itzhack 2000, "New Method for Extracting the Quaternion").
    m = matrix
    form = np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
        [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
        [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], 0],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
    ])  # fmt: skip
    quaternion: Floats = np.linalg.eigh(form)[1][:, -1]
    return quaternion


def follow(
    node: Node,
    times: Floats,
    translation: Floats | None = None,
    rotation: Floats | None = None,
    scale: Floats | None = None,
) -> list[Channel]:
    """Keys for a node at `times`, (keys,) seconds from 0 to LOOP; None: constant, from the node's matrix.

    `translation` (keys, 3) metres, `rotation` (keys, 4), `scale` (keys, 3). The matrix has no scale of its own.
    """
    if node.pose is None:
        node.place(node.transform, Pose(node.transform[:3, 3], rotation_of(node.transform)))
    paths: list[tuple[Path, Floats | None]] = [
        ("translation", translation), ("rotation", rotation), ("scale", scale)
    ]  # fmt: skip
    return [Channel(node, path, times, values) for path, values in paths if values is not None]


def spin(node: Node, axis: ArrayLike, turns: int) -> list[Channel]:
    """`turns` whole revolutions a loop about an axis of the node."""
    steps = 3 * abs(turns)  # two keys are at most half a revolution apart
    angles = np.linspace(0, 2 * np.pi * turns, steps + 1)
    rotation = product(rotation_of(node.transform)[None], about(axis, angles))
    return follow(node, np.linspace(0, LOOP, steps + 1), rotation=rotation)


def swing(node: Node, axis: ArrayLike, degrees: float, cycles: int, phase: float = 0.0) -> list[Channel]:
    """To and fro, `degrees` each way, about an axis of the node; `phase` is a fraction of a cycle."""
    share = np.linspace(0, 1, 12 * cycles + 1)
    angles = np.radians(degrees) * np.sin(2 * np.pi * (cycles * share + phase))
    rotation = product(rotation_of(node.transform)[None], about(axis, angles))
    return follow(node, share * LOOP, rotation=rotation)


def delayed(times: Floats, values: Floats, delay: float) -> tuple[Floats, Floats]:
    """Keys over one loop, (keys,) and (keys, components), that are played `delay` seconds later and go round."""
    moments = np.unique(np.concatenate([(times + delay) % LOOP, [0, LOOP]]))
    columns = [np.interp((moments - delay) % LOOP, times, column) for column in values.T]
    return moments, np.stack(columns, -1)


def beat(node: Node, times: Floats, heights: Floats, count: int, delay: float) -> list[Channel]:
    """Up and down by `heights`, (keys,) metres, at `times` within each of `count` equal parts of the loop."""
    period = LOOP / count
    every = (np.arange(count)[:, None] * period + times).ravel()
    moments, height = delayed(every, np.tile(heights, count)[:, None], delay)
    return follow(node, moments, node.transform[:3, 3] + height * (0, 1, 0))


def particle(node: Node, places: Floats, sizes: Floats, life: float, delay: float) -> list[Channel]:
    """A thing that flies off again and again, `life` seconds each time, and waits unseen in between.

    `places` (flights, keys, 3) metres, with the flights evenly over the loop; `sizes` (keys,) from HIDDEN to HIDDEN.
    """
    flights, keys = places.shape[:2]
    starts = np.arange(flights)[:, None] * (LOOP / flights)
    ages = np.append(np.linspace(0, life, keys), life + 1e-3)  # back at once, while it is unseen
    places = np.concatenate([places, np.roll(places, -1, 0)[:, :1]], 1)
    values = np.concatenate([places.reshape(-1, 3), np.tile(np.append(sizes, HIDDEN), flights)[:, None]], 1)
    moments, values = delayed((starts + ages).ravel(), values, delay)
    return follow(node, moments, values[:, :3], scale=np.repeat(values[:, 3:], 3, 1))
