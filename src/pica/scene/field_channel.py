"""Animated fields of materials and nodes: colours, lights, cameras, visibility."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Union

from pica.errors import SceneError, shown
from pica.names import checked_names
from pica.scene.checked_field import CheckedField, described
from pica.scene.keyframes import Floats, Interpolation, Keyframes, keyed
from pica.scene.values import choice, instance, text

if TYPE_CHECKING:
    from pica.scene.material import Material
    from pica.scene.model import Node

Changes = list[tuple[list[str], Floats]]
"""Paths of fields below an object, and the new components of each."""


def _holder(value: Any) -> Any:
    from pica.scene.material import Material  # which imports nodes' modules
    from pica.scene.model import Node

    return instance(Material, Node)(value)


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class FieldChannel:
    """The values of a field of a material or node over time, such as "roughness" or "light.intensity".

    Dots lead into a field's object or to an entry of its tuple: "sheen.color", "coats.0.roughness". A field holds a
    number, several, or a flag, which is set from 0.5 on. Arrays are not copied. Raises SceneError if invalid.
    """

    holder: CheckedField[Union["Material", "Node"]] = CheckedField(_holder)
    field: CheckedField[str] = CheckedField(text)
    times: CheckedField[Floats] = CheckedField(keyed(1))
    """(keys,) seconds, ascending, at least one. The value is constant before the first and after the last."""
    values: CheckedField[Floats] = CheckedField(keyed(2, 3))
    """(keys, components); CUBICSPLINE: (keys, 3, components), incoming tangent, value, outgoing tangent. As the field's
    own checks have them: `Scene.animate` raises SceneError for others."""
    interpolation: CheckedField[Interpolation] = CheckedField(choice("STEP", "LINEAR", "CUBICSPLINE"), "LINEAR")

    def __post_init__(self) -> None:
        part: Any = self.holder
        for name in self.field.split("."):
            part = _below(part, name, self.field)
        if part is not None and not isinstance(part, bool | int | float | tuple):
            raise SceneError(f"field channel: {self.field} of {described(self.holder)} holds no numbers")
        components = len(part) if isinstance(part, tuple) else 1
        tangents = (3,) if self.interpolation == "CUBICSPLINE" else ()
        if self.values.shape != (len(self.times), *tangents, components):
            fault = f"of the shape {self.values.shape} do not go with {len(self.times)} times"
            raise SceneError(f"field channel: values: {fault}, {self.interpolation} and {self.field}")

    @property
    def target(self) -> tuple[Union["Material", "Node"], str]:
        """What it sets."""
        return self.holder, self.field


def has_field(holder: Union["Material", "Node"], field: str) -> bool:
    """Whether a field channel can set a field."""
    part: Any = holder
    try:
        for name in field.split("."):
            part = _below(part, name)
    except SceneError:
        return False
    return True


class FieldTracks:
    """Field channels, sampled in one go for each interpolation and number of components. Raises UnfitError."""

    def __init__(self, channels: Sequence[FieldChannel]) -> None:
        alike: dict[tuple[Interpolation, int], list[FieldChannel]] = {}
        for channel in channels:
            alike.setdefault((channel.interpolation, channel.values.shape[-1]), []).append(channel)
        self._tracks = [(track, _keyframes(track)) for track in alike.values()]

    def apply(self, time: float) -> None:
        """Set the fields to their values at `time`; those that have them are not touched."""
        changes: dict[Material | Node, Changes] = {}
        for track, keyframes in self._tracks:
            for channel, row in zip(track, keyframes.at(time), strict=True):
                changes.setdefault(channel.holder, []).append((channel.field.split("."), row))
        for holder, each in changes.items():
            for name, value in _new_parts(holder, each).items():
                setattr(holder, name, value)


def _keyframes(track: list[FieldChannel]) -> Keyframes:
    def label(index: int) -> str:
        return f"{track[index].field} of {described(track[index].holder)}"

    return Keyframes(track, False, label)


def _below(part: Any, name: str, field: str = "") -> Any:
    """A field of an object, or an entry of a tuple. Raises SceneError."""
    if isinstance(part, tuple):
        if name.isdecimal() and int(name) < len(part):
            return part[int(name)]
    elif not name.startswith("_") and isinstance(vars(type(part)).get(name), CheckedField):
        return getattr(part, name)
    kind = described(part) if hasattr(part, "__dict__") else shown(part)
    raise SceneError(f"field channel: {field}: {kind} has no {name}")


def _new_parts(part: Any, changes: Changes) -> dict[str, Any]:
    """The fields of an object, or entries of a tuple, that differ after the changes."""
    below: dict[str, Changes] = {}
    for (name, *rest), row in changes:
        below.setdefault(name, []).append((rest, row))
    new = {name: _changed(_below(part, name), each) for name, each in below.items()}
    return {name: value for name, value in new.items() if value is not _below(part, name)}


def _changed(part: Any, changes: Changes) -> Any:
    """The part with new values below it; itself if it has them already."""
    if not changes[0][0]:
        value = _like(part, changes[0][1])
        return part if value == part else value
    new = _new_parts(part, changes)
    if not new:
        return part
    if isinstance(part, tuple):
        return tuple(new.get(str(index), entry) for index, entry in enumerate(part))
    return replace(part, **new)


def _like(part: Any, row: Floats) -> Any:
    """Components as the value of a field that holds `part`."""
    if isinstance(part, bool):
        return bool(row[0] >= 0.5)
    return tuple(row.tolist()) if isinstance(part, tuple) else float(row[0])
