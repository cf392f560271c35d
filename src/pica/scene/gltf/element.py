"""JSON objects with their place in the file: all values are read, and checked, through these."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

from pica.errors import SceneError, shown
from pica.scene.values import LARGEST

MOST = 1 << 53
"""Integers beyond are not exact in every reader of JSON, and no file is that large."""

_Value = TypeVar("_Value")
_Arguments = ParamSpec("_Arguments")


class Element:
    """A JSON object of a file and its place there, such as nodes[3] or materials[0].normalTexture.

    Readers of a key raise SceneError, "place: fault", if the value is invalid. `default` is for
    absent keys, which include null; without a default they are a fault. Unused keys are not
    checked. Places are formatted only for messages: a scene has hundreds of thousands of these.
    """

    __slots__ = ("_index", "_key", "_parent", "values")
    values: dict[str, Any]
    """The unchecked object of the file: for columns.py, and for iteration over its keys."""

    def __init__(
        self, values: dict[str, Any], key: str = "", parent: "Element | None" = None, index: int | None = None
    ) -> None:
        self.values, self._key, self._parent, self._index = values, key, parent, index

    def __contains__(self, key: str) -> bool:
        return self.values.get(key) is not None

    def replaced(self, **values: Any) -> "Element":
        """The same object with other values. A value that is an Element is what `reference` finds there."""
        return self.with_values(self.values | values)

    def with_values(self, values: dict[str, Any]) -> "Element":
        """Another object at the same place in the file."""
        return Element(values, self._key, self._parent, self._index)

    def keys(self) -> set[str]:
        """Which keys the object has."""
        return set(self.values)

    def place(self, key: str = "", index: int | None = None) -> str:
        """The place of the object, or of its value, or of entry `index` of that value; empty for the file itself."""
        above = "" if self._parent is None else self._parent.place(self._key, self._index)
        own = key if index is None else f"{key}[{index}]"
        return f"{above}.{own}" if above and own else above or own

    def fault(self, text: str, key: str = "", index: int | None = None) -> SceneError:
        """The error for a fault at a place."""
        return SceneError(f"{self.place(key, index)}: {text}")

    def apply(
        self, function: Callable[_Arguments, _Value], /, *values: _Arguments.args, **named: _Arguments.kwargs
    ) -> _Value:
        """The result of a function of the object's values. A SceneError that it raises gets their place."""
        try:
            return function(*values, **named)
        except SceneError as error:
            raise self.fault(str(error)) from None

    def object(self, key: str, required: bool = False) -> "Element":
        """The object under a key; an empty one if it is absent, unless it is required."""
        value = self.values.get(key)
        if value is None and not required:
            value = {}
        if type(value) is not dict:
            raise self._unfit(value, "an object", key)
        return Element(value, key, self)

    def objects(self, key: str) -> list["Element"]:
        """The objects of an array, which may be absent."""
        values = self._array(key)
        for index, value in enumerate(values):
            if type(value) is not dict:
                raise self._unfit(value, "an object", key, index)
        return [Element(value, key, self, index) for index, value in enumerate(values)]

    def extension(self, name: str) -> "Element":
        """An extension of the object (3.12); one without any keys where it has none."""
        return self.object("extensions").object(name)

    def has_extension(self, name: str) -> bool:
        """Whether the object has an extension."""
        return "extensions" in self and name in self.object("extensions")

    @property
    def extras(self) -> dict[str, Any]:
        """Application-specific data (3.13), any JSON; empty unless it is an object."""
        extras = self.values.get("extras")
        return extras if isinstance(extras, dict) else {}

    @property
    def pica(self) -> "Element":
        """The part of the extras for pica; extras of any other form belong to other applications."""
        return Element(self.extras, "extras", self).object("pica")

    @property
    def name(self) -> str:
        """The name; empty if it is absent."""
        name = self.values.get("name")
        return name if isinstance(name, str) else ""

    def integer(self, key: str, low: int = 0, high: int = MOST, default: int | None = None) -> int:
        """An integer from low to high."""
        value = self.values.get(key)
        if value is None and default is not None:
            return default
        whole = _whole(value)
        if whole is None or not low <= whole <= high:
            raise self._unfit(value, f"a whole number{_span(low, high)}", key)
        return whole

    def integers(self, key: str, low: int = 0, high: int = MOST) -> list[int]:
        """The integers of an array, each from low to high; it may be absent."""
        values = self._array(key)
        integers = []
        for index, value in enumerate(values):
            whole = _whole(value)
            if whole is None or not low <= whole <= high:
                raise self._unfit(value, f"a whole number{_span(low, high)}", key, index)
            integers.append(whole)
        return integers

    def number(
        self, key: str, low: float = -LARGEST, high: float = LARGEST, default: float | None = None
    ) -> float:  # fmt: skip
        """A finite number from low to high."""
        value: Any = self.values.get(key)
        if value is None and default is not None:
            return default
        if type(value) not in (float, int) or not low <= value <= high:
            raise self._unfit(value, f"a number{_span(low, high)}", key)
        return float(value)

    def numbers(
        self, key: str, count: int, low: float = -LARGEST, high: float = LARGEST,
        default: tuple[float, ...] | None = None,
    ) -> tuple[Any, ...]:  # fmt: skip
        """`count` finite numbers from low to high."""
        values = self.values.get(key)
        if values is None and default is not None:
            return default
        if type(values) is not list or len(values) != count:
            raise self._unfit(values, f"a list of {count} numbers", key)
        for index, value in enumerate(values):
            if type(value) not in (float, int) or not low <= value <= high:
                raise self._unfit(value, f"a number{_span(low, high)}", key, index)
        return tuple(map(float, values))

    def flag(self, key: str, default: bool) -> bool:
        """True or false."""
        value = self.values.get(key)
        if value is None:
            return default
        if type(value) is not bool:
            raise self._unfit(value, "true or false", key)
        return value

    def text(self, key: str, default: str | None = None) -> str:
        """A string."""
        value = self.values.get(key)
        if value is None and default is not None:
            return default
        if type(value) is not str:
            raise self._unfit(value, "text", key)
        return value

    def texts(self, key: str) -> list[str]:
        """The strings of an array, which may be absent."""
        values = self._array(key)
        for index, value in enumerate(values):
            if type(value) is not str:
                raise self._unfit(value, "text", key, index)
        return values

    def choice(self, key: str, choices: Mapping[Any, _Value], default: _Value | None = None) -> _Value:
        """What `choices` has for the string or integer."""
        value = self.values.get(key)
        if value is None and default is not None:
            return default
        option = value if type(value) is str else _whole(value)
        if option not in choices:
            raise self._unfit(value, f"one of {', '.join(map(str, choices))}", key)
        return choices[option]

    def reference(self, key: str, entries: Sequence["Element"]) -> "Element":
        """The one of `entries` that an integer refers to."""
        value = self.values.get(key)
        if type(value) is int and 0 <= value < len(entries):
            return entries[value]
        if isinstance(value, Element):  # no JSON has one
            return value
        return self._referred(value, entries, key)

    def references(self, key: str, entries: Sequence["Element"]) -> list["Element"]:
        """The `entries` that an array of integers refers to; the array may be absent."""
        values = self._array(key)
        if set(map(type, values)) == {int} and min(values) >= 0 and max(values) < len(entries):
            return [entries[value] for value in values]
        return [self._referred(value, entries, key, index) for index, value in enumerate(values)]

    def _referred(
        self, value: Any, entries: Sequence["Element"], key: str, index: int | None = None
    ) -> "Element":  # fmt: skip
        whole = _whole(value)
        if whole is None:
            raise self._unfit(value, "a whole number", key, index)
        if not 0 <= whole < len(entries):
            raise self.fault(f"{shown(value)} is out of range (count {len(entries)})", key, index)
        return entries[whole]

    def _array(self, key: str) -> list[Any]:
        value = self.values.get(key)
        if value is None:
            return []
        if type(value) is not list:
            raise self._unfit(value, "an array", key)
        return value

    def _unfit(self, value: Any, expected: str, key: str, index: int | None = None) -> SceneError:
        if value is None and index is None:
            return self.fault("is missing", key)
        return self.fault(f"{shown(value)} is not {expected}", key, index)


def _whole(value: Any) -> int | None:
    """The integer that a JSON number is; None where it is none."""
    if type(value) is int:
        return value
    return int(value) if type(value) is float and value.is_integer() else None  # some exporters write 3.0


def _span(low: float, high: float) -> str:
    if high not in (MOST, LARGEST):
        return f" from {low} to {high}"
    return "" if low == -LARGEST else f" of at least {low}"
