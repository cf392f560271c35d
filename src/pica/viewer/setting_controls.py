"""Controls for all settings, made from their schema: a new setting brings its own."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pica.settings import Settings
from pica.settings.setting import Value

_FEW = 64
"""Whole numbers that a slider has room for."""
_NARROW = 10
"""Length of a range of numbers that a slider has room for."""


@dataclass(frozen=True)
class SettingControl:
    """How one setting is shown and changed."""

    path: str
    """Its dotted name, for `Settings.with_values`."""
    label: str
    """Its name in the group, in words."""
    kind: Literal["integer", "number", "choice", "boolean"]
    text: str
    """Description, with what higher and lower values or the choices do."""
    default: Value
    low: float | None = None
    """Of numbers."""
    high: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def fits_slider(self) -> bool:
        """Whether the range of a number is so short that a slider can set all of its values."""
        assert self.low is not None and self.high is not None
        return self.high - self.low <= (_FEW if self.kind == "integer" else _NARROW)


@dataclass(frozen=True)
class ControlGroup:
    """The controls of one group of settings."""

    name: str
    """"" of the settings outside of all groups."""
    label: str
    text: str
    levels: Mapping[str, str]
    """Texts of the levels by name, from cheap to dear."""
    controls: tuple[SettingControl, ...]


def setting_controls() -> list[ControlGroup]:
    """All groups with all of their settings, in the order of the schema."""
    schema = Settings.schema()
    groups: dict[str, list[SettingControl]] = {name: [] for name in (*schema["groups"], "")}
    for path, setting in schema["settings"].items():
        groups[path.rpartition(".")[0]].append(_control(path, setting))
    texts = {**schema["groups"], "": {"text": "Outside of all groups.", "levels": {}}}
    return [
        ControlGroup(name, _words(name) or "Others", texts[name]["text"], texts[name]["levels"], tuple(controls))
        for name, controls in groups.items()
        if controls
    ]


def presets() -> dict[str, str]:
    """Texts of the presets, by name."""
    return {name: preset["text"] for name, preset in Settings.schema()["presets"].items()}


def level_of(group: str, settings: Settings) -> str:
    """The level that a group is at; "" if its values are of none."""
    values = settings.values()
    for level in Settings.schema()["groups"].get(group, {}).get("levels", ()):
        if settings.with_values({group: level}).values() == values:
            return str(level)
    return ""


def preset_of(settings: Settings) -> str:
    """The preset that the settings equal; "" if they are none."""
    return next((name for name in presets() if Settings.preset(name) == settings), "")


def at_level(group: str, level: str, settings: Settings) -> Settings:
    """The settings with a group at a level. Raises SettingsError."""
    return settings.with_values({group: level})


def with_value(path: str, value: Value, settings: Settings) -> Settings:
    """The settings with another value of one, whose whole numbers may come as 2.0. Raises SettingsError."""
    whole = isinstance(settings.values()[path], int) and isinstance(value, float) and value.is_integer()
    return settings.with_values({path: int(value) if whole else value})


def _control(path: str, setting: Mapping[str, Any]) -> SettingControl:
    low, high = setting.get("range", (None, None))
    return SettingControl(
        path=path,
        label=_words(path.rpartition(".")[2]),
        kind=setting["type"],
        text=_text(setting),
        default=setting["default"],
        low=low,
        high=high,
        choices=tuple(setting.get("choices", ())),
    )


def _text(setting: Mapping[str, Any]) -> str:
    parts = [setting["text"]]
    if unit := setting.get("unit"):
        low, high = setting["range"]
        parts.append(f"{low:g} to {high:g} {unit}.")
    parts += [f"{word.capitalize()}: {setting[word]}" for word in ("higher", "lower") if setting.get(word)]
    parts += [f"{choice}: {text}" for choice, text in setting.get("choices", {}).items()]
    return " ".join(parts)


def _words(name: str) -> str:
    return name.replace("_", " ").capitalize()
