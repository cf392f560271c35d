"""Animations: values that channels give to nodes over time (glTF 2.0, 3.11 and appendix C).

Times are in seconds, rotations unit quaternions (x, y, z, w).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.arrays import affine, doubles
from pica.scene.checked_field import CheckedField, described, fitting, read_only
from pica.scene.fixed import Fixed
from pica.scene.values import LARGEST, Check, UnfitError, choice, instance, items, number, text

if TYPE_CHECKING:
    from pica.scene.model import Node

Floats = NDArray[np.float64]
Path = Literal["translation", "rotation", "scale", "weights"]
Interpolation = Literal["STEP", "LINEAR", "CUBICSPLINE"]
_PLACING: dict[Path, int] = {"translation": 3, "rotation": 4, "scale": 3}
"""The properties of a node that channels can animate, and the number of components of each."""
_NO_TURN = "a quaternion of zeros is no rotation"


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Pose:
    """A node's transform relative to its parent, as translation, rotation and scale. Raises SceneError for numbers
    that are not finite."""

    translation: Floats = field(default_factory=lambda: np.zeros(3))
    """(3,) metres."""
    rotation: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    """(4,) quaternion x, y, z, w, not zero."""
    scale: Floats = field(default_factory=lambda: np.ones(3))
    """(3,)"""

    def __post_init__(self) -> None:
        for name, count in _PLACING.items():
            object.__setattr__(self, name, read_only(fitting(self, name, doubles(count), getattr(self, name))))
        if not np.linalg.norm(self.rotation):
            raise SceneError(f"pose: rotation: {_NO_TURN}")

    @staticmethod
    def of(translation: Floats, rotation: Floats, scale: Floats) -> "Pose":
        """A pose from arrays that are valid and not shared with writers."""
        for values in (translation, rotation, scale):
            values.setflags(write=False)
        pose = object.__new__(Pose)
        attributes = {"translation": translation, "rotation": rotation, "scale": scale}
        object.__setattr__(pose, "__dict__", attributes)
        return pose

    def matrix(self) -> Floats:
        """(4, 4) node to parent."""
        return compose(self.translation[None], self.rotation[None], self.scale[None])[0]


def _keyed(*dimensions: int) -> Check[Floats]:
    """A float64 array with this number of dimensions. Animation checks all of them for finite values at once."""

    def check(values: Any) -> Floats:
        if not (type(values) is np.ndarray and values.dtype == np.float64):
            values = doubles()(values)
        if values.ndim not in dimensions or not len(values):
            raise UnfitError(f"has the shape {values.shape}; give one or more keys, {_KEYS[dimensions]}")
        return np.asarray(values)

    return check


def _node(value: Any) -> "Node":
    from pica.scene.model import Node  # which imports animations

    node: Node = instance(Node)(value)
    return node


_KEYS = {(1,): "(keys,)", (2, 3): "(keys, components) or, for CUBICSPLINE, (keys, 3, components)"}


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Channel:
    """The values of one property of one node over time. Arrays are not copied. Raises SceneError if invalid."""

    node: CheckedField["Node"] = CheckedField(_node)
    path: CheckedField[Path] = CheckedField(choice(*_PLACING, "weights"))
    times: CheckedField[Floats] = CheckedField(_keyed(1))
    """(keys,) seconds, ascending, at least one. The value is constant before the first and after the last."""
    values: CheckedField[Floats] = CheckedField(_keyed(2, 3))
    """(keys, components); CUBICSPLINE: (keys, 3, components), incoming tangent, value, outgoing tangent."""
    interpolation: CheckedField[Interpolation] = CheckedField(choice("STEP", "LINEAR", "CUBICSPLINE"), "LINEAR")

    def __post_init__(self) -> None:
        components = _PLACING.get(self.path, self.values.shape[-1])
        tangents = (3,) if self.interpolation == "CUBICSPLINE" else ()
        if self.values.shape != (len(self.times), *tangents, components):
            fault = f"of the shape {self.values.shape} do not go with {len(self.times)} times"
            raise SceneError(f"channel: values: {fault}, {self.interpolation} and {self.path}")


class Animation(Fixed):
    """Channels that play together. Raises SceneError for a channel whose node has no pose, and for
    numbers that are not finite or times that do not ascend.

    `drivers` are called with the time in seconds, to set state that channels cannot animate, such as particles; they
    must depend on nothing else. `duration`: minimum in seconds, for drivers that continue after the last key.
    """

    def __init__(
        self,
        channels: Iterable[Channel],
        name: str = "",
        drivers: Iterable[Callable[[float], None]] = (),
        duration: float = 0.0,
    ) -> None:
        self.name = fitting(self, "name", text, name)
        self.channels = fitting(self, "channels", items(Channel), channels)
        self.drivers = tuple(drivers)
        least = fitting(self, "duration", number(0), duration)
        placing = (channel.node for channel in self.channels if channel.path in _PLACING)
        self._nodes = list(dict.fromkeys(placing))
        for node in self._nodes:
            if node.pose is None:
                raise SceneError(
                    f"animation {name!r}: node {node.name!r} is placed by a matrix; give it a pose to move"
                )
        rows = {node: row for row, node in enumerate(self._nodes)}
        alike: dict[tuple[Path, Interpolation, int], list[Channel]] = {}
        for channel in self.channels:
            alike.setdefault((channel.path, channel.interpolation, channel.values.shape[-1]), []).append(channel)
        self._tracks = [
            fitting(self, "channels", partial(_Track, rows=rows), animation) for animation in alike.values()
        ]
        self.duration = max([least, *(float(channel.times[-1]) for channel in self.channels)])
        """Seconds until the last key; play `time % duration` for a loop."""

    def apply(self, time: float) -> None:
        """Set every node to its channels' values at `time`; nodes already in that state are not touched."""
        parts = {path: np.array([getattr(node.pose, path) for node in self._nodes]) for path in _PLACING}
        for track in self._tracks:
            values = track.at(time)
            if track.path != "weights":
                parts[track.path][track.rows] = values
                continue
            for node, weights in zip(track.nodes, values, strict=True):
                if not np.array_equal(node.weights if node.weights is not None else (), weights):
                    node.weights = weights
        if self._nodes:
            self._place(**parts)
        for drive in self.drivers:
            drive(time)

    def _place(self, translation: Floats, rotation: Floats, scale: Floats) -> None:
        """Move the nodes to their poses, one row each."""
        matrices = compose(translation, rotation, scale)
        moved = (matrices != np.stack([node.transform for node in self._nodes])).any((1, 2))
        for row in np.flatnonzero(moved):
            node = self._nodes[row]
            pose = Pose.of(translation[row], rotation[row], scale[row])
            node.place(fitting(node, "transform", affine, matrices[row]), pose)


def together(animations: Iterable[Animation]) -> Animation:
    """All animations as one; where two move the same value of a node, the later one does."""
    every = list(animations)
    channels = {(channel.node, channel.path): channel for animation in every for channel in animation.channels}
    return Animation(channels.values(), drivers=[drive for animation in every for drive in animation.drivers])


def compose(translation: Floats, rotation: Floats, scale: Floats) -> Floats:
    """(count, 4, 4) translation * rotation * scale, from (count, 3), (count, 4) of any length but 0, and (count, 3)."""
    x, y, z, w = _unit(rotation).T
    # Shoemake 1985, "Animating Rotation with Quaternion Curves"
    turned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrices = np.zeros((len(rotation), 4, 4))
    matrices[:, :3, :3] = turned.transpose(2, 0, 1) * scale[:, None, :]
    matrices[:, :3, 3] = translation
    matrices[:, 3, 3] = 1
    return matrices


class _Track:
    """Channels of one path, interpolation and number of components: sampled in one go."""

    def __init__(self, channels: list[Channel], rows: dict["Node", int]) -> None:
        """Raises UnfitError."""
        self.path, self._interpolation = channels[0].path, channels[0].interpolation
        self.nodes = [channel.node for channel in channels]
        self.rows = [rows[node] for node in self.nodes] if self.path != "weights" else []
        self._times = np.concatenate([channel.times for channel in channels]).astype(np.float64)
        self._values = np.concatenate([channel.values for channel in channels]).astype(np.float64)
        counts = np.array([len(channel.times) for channel in channels])
        self._first = np.cumsum(counts) - counts
        self._last = self._first + counts - 1
        self._check()
        if self.path == "rotation" and self._interpolation != "CUBICSPLINE":
            self._values = _unit(self._values)

    def _check(self) -> None:
        descends = np.diff(self._times, prepend=-np.inf) < 0
        descends[self._first] = False
        faults = {
            "times are not finite": ~(np.abs(self._times) <= LARGEST),
            "times do not ascend": descends,
            "values are not finite, or too large for 32-bit floats": ~(np.abs(self._values) <= LARGEST),
        }
        if self.path == "rotation":
            values = self._values[:, 1] if self._interpolation == "CUBICSPLINE" else self._values
            faults[_NO_TURN] = ~(np.linalg.norm(values, axis=1) > 0)
        for fault, bad in faults.items():
            if bad.any():
                row = int(np.argwhere(bad)[0][0])
                channel = int(np.searchsorted(self._first, row, "right")) - 1
                key = f"key {row - self._first[channel]}"
                raise UnfitError(f"{self.path} of {described(self.nodes[channel])}: {fault} ({key})")

    def at(self, time: float) -> Floats:
        """(channels, components) at `time`."""
        before, after = self._keys_around(time)
        start, length = self._times[before], self._times[after] - self._times[before]
        elapsed = np.where(length > 0, (time - start) / np.where(length > 0, length, 1), 1)
        fraction = np.clip(elapsed, 0, 1)[:, None]
        if self._interpolation == "CUBICSPLINE":
            return self._spline(before, after, fraction, length[:, None])
        if self._interpolation == "STEP":
            fraction = np.floor(fraction)
        if self.path == "rotation":
            return _slerp(self._values[before], self._values[after], fraction)
        return self._values[before] * (1 - fraction) + self._values[after] * fraction

    def _keys_around(self, time: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """(channels,) the keys between which `time` lies, by bisection in all channels at once."""
        before, after = self._first, self._last
        while (after - before > 1).any():
            middle = (before + after) // 2
            passed = self._times[middle] <= time
            before, after = np.where(passed, middle, before), np.where(passed, after, middle)
        return before, after

    def _spline(self, before: NDArray[np.intp], after: NDArray[np.intp], t: Floats, length: Floats) -> Floats:
        # glTF 2.0, appendix C.5: a cubic Hermite spline whose tangents are scaled by the time between the keys
        value, leaving = self._values[before, 1], self._values[before, 2] * length
        next_value, arriving = self._values[after, 1], self._values[after, 0] * length
        t2, t3 = t * t, t * t * t
        result = (
            (2 * t3 - 3 * t2 + 1) * value
            + (t3 - 2 * t2 + t) * leaving
            + (3 * t2 - 2 * t3) * next_value
            + (t3 - t2) * arriving
        )
        if self.path != "rotation":
            return result
        return _unit(np.where(result.any(axis=1, keepdims=True), result, value))


def _slerp(start: Floats, end: Floats, fraction: Floats) -> Floats:
    """(count, 4) unit quaternions on the shorter arc from start to end."""
    # glTF 2.0, appendix C.4
    cosine = np.sum(start * end, axis=1, keepdims=True)
    angle = np.arccos(np.minimum(np.abs(cosine), 1.0))
    sine = np.sin(angle)
    curved = sine > 1e-6  # otherwise linear interpolation is accurate
    divisor = np.where(curved, sine, 1.0)
    from_start = np.where(curved, np.sin(angle * (1 - fraction)) / divisor, 1 - fraction)
    from_end = np.where(curved, np.sin(angle * fraction) / divisor, fraction)
    return _unit(from_start * start + np.copysign(from_end, cosine) * end)


def _unit(quaternions: Floats) -> Floats:
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
