"""Animations: values that channels give to nodes over time (glTF 2.0, 3.11 and appendix C).

Times are in seconds, rotations unit quaternions (x, y, z, w).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.arrays import affine, doubles
from pica.scene.checked_field import CheckedField, described, fitting, read_only
from pica.scene.field_channel import FieldChannel, FieldTracks
from pica.scene.fixed import Fixed
from pica.scene.keyframes import NO_TURN, Floats, Interpolation, Keyframes, keyed, unit
from pica.scene.values import choice, instance, items, number, text

if TYPE_CHECKING:
    from pica.scene.model import Node

Path = Literal["translation", "rotation", "scale", "weights"]
_PLACING: dict[Path, int] = {"translation": 3, "rotation": 4, "scale": 3}
"""The properties of a node that channels can animate, and the number of components of each."""


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
            raise SceneError(f"pose: rotation: {NO_TURN}")

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


def _node(value: Any) -> "Node":
    from pica.scene.model import Node  # which imports animations

    node: Node = instance(Node)(value)
    return node


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Channel:
    """The values of one property of one node over time. Arrays are not copied. Raises SceneError if invalid."""

    node: CheckedField["Node"] = CheckedField(_node)
    path: CheckedField[Path] = CheckedField(choice(*_PLACING, "weights"))
    times: CheckedField[Floats] = CheckedField(keyed(1))
    """(keys,) seconds, ascending, at least one. The value is constant before the first and after the last."""
    values: CheckedField[Floats] = CheckedField(keyed(2, 3))
    """(keys, components); CUBICSPLINE: (keys, 3, components), incoming tangent, value, outgoing tangent."""
    interpolation: CheckedField[Interpolation] = CheckedField(choice("STEP", "LINEAR", "CUBICSPLINE"), "LINEAR")

    def __post_init__(self) -> None:
        components = _PLACING.get(self.path, self.values.shape[-1])
        tangents = (3,) if self.interpolation == "CUBICSPLINE" else ()
        if self.values.shape != (len(self.times), *tangents, components):
            fault = f"of the shape {self.values.shape} do not go with {len(self.times)} times"
            raise SceneError(f"channel: values: {fault}, {self.interpolation} and {self.path}")

    @property
    def target(self) -> tuple["Node", str]:
        """What it sets."""
        return self.node, self.path


def _keyframes(track: list[Channel]) -> Keyframes:
    """Of channels of one path, interpolation and number of components."""
    path = track[0].path
    return Keyframes(track, path == "rotation", lambda index: f"{path} of {described(track[index].node)}")


class Animation(Fixed):
    """Channels that play together, of nodes and of fields. Raises SceneError for a channel whose node has no pose, and
    for numbers that are not finite or times that do not ascend.

    `drivers` are called with the time in seconds, to set state that channels cannot animate, such as particles; they
    must depend on nothing else. `duration`: minimum in seconds, for drivers that continue after the last key.
    """

    def __init__(
        self,
        channels: Iterable[Channel | FieldChannel],
        name: str = "",
        drivers: Iterable[Callable[[float], None]] = (),
        duration: float = 0.0,
    ) -> None:
        self.name = fitting(self, "name", text, name)
        self.channels = fitting(self, "channels", items(Channel, FieldChannel), channels)
        self.drivers = tuple(drivers)
        least = fitting(self, "duration", number(0), duration)
        moving = [channel for channel in self.channels if isinstance(channel, Channel)]
        self._nodes = list(dict.fromkeys(channel.node for channel in moving if channel.path in _PLACING))
        for node in self._nodes:
            if node.pose is None:
                raise SceneError(
                    f"animation {name!r}: node {node.name!r} is placed by a matrix; give it a pose to move"
                )
        self._rows = {node: row for row, node in enumerate(self._nodes)}
        alike: dict[tuple[Path, Interpolation, int], list[Channel]] = {}
        for channel in moving:
            alike.setdefault((channel.path, channel.interpolation, channel.values.shape[-1]), []).append(channel)
        self._tracks = [(track, fitting(self, "channels", _keyframes, track)) for track in alike.values()]
        fields = [channel for channel in self.channels if isinstance(channel, FieldChannel)]
        self._fields = fitting(self, "channels", FieldTracks, fields)
        self.duration = max([least, *(float(channel.times[-1]) for channel in self.channels)])
        """Seconds until the last key; play `time % duration` for a loop."""

    def apply(self, time: float) -> None:
        """Set every node and field to its channels' values at `time`; those already in that state are not touched."""
        parts = {path: np.array([getattr(node.pose, path) for node in self._nodes]) for path in _PLACING}
        for track, keyframes in self._tracks:
            values, path = keyframes.at(time), track[0].path
            if path != "weights":
                parts[path][[self._rows[channel.node] for channel in track]] = values
                continue
            for channel, weights in zip(track, values, strict=True):
                node = channel.node
                if not np.array_equal(node.weights if node.weights is not None else (), weights):
                    node.weights = weights
        if self._nodes:
            self._place(**parts)
        self._fields.apply(time)
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
    """All animations as one; where two set the same value, the later one does."""
    every = list(animations)
    channels = {channel.target: channel for animation in every for channel in animation.channels}
    return Animation(channels.values(), drivers=[drive for animation in every for drive in animation.drivers])


def compose(translation: Floats, rotation: Floats, scale: Floats) -> Floats:
    """(count, 4, 4) translation * rotation * scale, from (count, 3), (count, 4) of any length but 0, and (count, 3)."""
    x, y, z, w = unit(rotation).T
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
