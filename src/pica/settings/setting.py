"""Kinds of settings. One declaration here makes the checks, the messages, the schema and the settings page."""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, ClassVar, Protocol, TypeVar

from pica.errors import SettingsError, plain, shown

Value = bool | int | float | str
_N = TypeVar("_N", int, float)
_C = TypeVar("_C", bound=str)


class Setting(Protocol):
    """One setting of a group."""

    @property
    def default(self) -> Value:
        """The default value."""

    @property
    def text(self) -> str:
        """The description."""

    def read(self, text: str) -> Value:
        """The value that a text such as "0.5" or "false" means; the text itself if it means none."""

    def fault(self, value: Any) -> str:
        """The fault of a value, such as "is outside 0 to 1"; empty if there is none."""

    def describe(self) -> dict[str, Any]:
        """Type, limits and texts for the schema, JSON-able."""


@dataclass(frozen=True)
class _Number:
    default: int | float
    range: tuple[int | float, int | float]
    unit: str
    text: str
    higher: str
    lower: str

    def read(self, text: str) -> Value:
        try:
            return type(self.default)(text)
        except ValueError:
            return text

    def fault(self, value: Any) -> str:
        whole, (low, high) = isinstance(self.default, int), self.range
        if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
            return "is not a whole number" if whole else "is not a number"
        # Written so that not-a-number fails the comparison too.
        return "" if low <= value <= high else f"is outside {low} to {high} {self.unit}".rstrip()

    def describe(self) -> dict[str, Any]:
        kind = "integer" if isinstance(self.default, int) else "number"
        return {"type": kind, **asdict(self), "range": list(self.range)}


@dataclass(frozen=True)
class _Choice:
    default: str
    text: str
    choices: Mapping[str, str]

    def read(self, text: str) -> Value:
        return text

    def fault(self, value: Any) -> str:
        known = isinstance(value, str) and value in self.choices
        return "" if known else f"is not one of {', '.join(self.choices)}"

    def describe(self) -> dict[str, Any]:
        return {"type": "choice", **asdict(self)}


@dataclass(frozen=True)
class _Switch:
    default: Value
    text: str

    def read(self, text: str) -> Value:
        return {"true": True, "false": False}.get(text.lower(), text)

    def fault(self, value: Any) -> str:
        return "" if isinstance(value, bool) else "is not true or false"

    def describe(self) -> dict[str, Any]:
        return {"type": "boolean", **asdict(self)}


def number(default: _N, *, range: tuple[_N, _N], unit: str, text: str, higher: str = "", lower: str = "") -> _N:
    """A number in a range that includes its ends; whole if the default is. `higher`, `lower`: what each buys."""
    return field(default=default, metadata={"setting": _Number(default, range, unit, text, higher, lower)})


def choice(default: _C, text: str, **choices: str) -> _C:
    """One of some words, each with what it does."""
    return field(default=default, metadata={"setting": _Choice(default, text, choices)})


def switch(default: bool, text: str) -> bool:
    """True or false."""
    return field(default=default, metadata={"setting": _Switch(default, text)})


@dataclass(frozen=True)
class Level:
    """A named quality of a group, or a preset of all: why, and by what it differs from the defaults."""

    text: str
    values: Mapping[str, Value] = field(default_factory=dict)


class Group:
    """Settings of one effect: a frozen dataclass whose fields are made by `number`, `choice` and `switch`.

    Raises SettingsError, which names the setting, the value and what is allowed.
    """

    levels: ClassVar[Mapping[str, Level]] = {}
    """From cheap to dear. A level changes how much is done, never which technique does it."""

    def __post_init__(self) -> None:
        for name, setting in declared(type(self)).items():
            value = plain(getattr(self, name))
            if fault := setting.fault(value):
                raise SettingsError(f"setting {dotted(type(self), name)}: {shown(value)} {fault}")
            object.__setattr__(self, name, value)

    @classmethod
    def level_values(cls, level: Any) -> dict[str, Value]:
        """All settings that levels of this group change, with their values at one of them. Raises SettingsError."""
        if not isinstance(level, str) or level not in cls.levels:
            known = f"is not one of {', '.join(cls.levels)}; or" if cls.levels else "is not a level, there are none;"
            group = group_name(cls)
            raise SettingsError(f"setting {group}: {shown(plain(level))} {known} write {group}.name=value")
        named = {name for item in cls.levels.values() for name in item.values}
        defaults = {name: setting.default for name, setting in declared(cls).items() if name in named}
        return defaults | dict(cls.levels[level].values)


def declared(group: type) -> dict[str, Setting]:
    """The settings of a group by name."""
    return {item.name: item.metadata["setting"] for item in fields(group) if "setting" in item.metadata}


def group_name(group: type) -> str:
    """Name of a group on the command line: "shadow_maps" of ShadowMapsSettings, "" of Settings."""
    return re.sub("(?<!^)(?=[A-Z])", "_", group.__name__.removesuffix("Settings")).lower()


def dotted(group: type, name: str) -> str:
    """Name of a setting on the command line, "shadows.mode", or "seed" outside of all groups."""
    return f"{group_name(group)}.{name}".lstrip(".")
