"""Widgets for the preset and every setting, made from their controls."""

from collections.abc import Callable
from functools import partial
from typing import Any

from slangpy import ui

from pica.settings import Settings
from pica.viewer.setting_controls import (
    ControlGroup,
    SettingControl,
    at_level,
    level_of,
    preset_of,
    presets,
    setting_controls,
    with_value,
)
from pica.viewer.window.fields import (
    Choice,
    Field,
    checkbox,
    combo,
    explain,
    number,
    slider,
    whole_number,
    wrapped,
)

_OWN = "(own values)"
"""Shown where the values are of no preset or level."""

Change = Callable[[Callable[[Settings], Settings]], object]
"""Asks for other settings, as a function of those of now."""


class SettingsSection:
    """The widgets, which show the settings of the newest `refresh`; of the groups one at a time."""

    def __init__(self, parent: ui.Widget, change: Change) -> None:
        self._change = change
        self._texts = presets()
        self._preset = combo(parent, "Preset", [*self._texts, _OWN], self._listening(_at_preset))
        self._preset_text = ui.Text(parent)
        groups = {group.label: group for group in setting_controls()}
        self._group = combo(parent, "Group", list(groups), self._open)
        self._fields: dict[str, Field] = {}
        self._levels: dict[str, Choice] = {}
        self._places = {label: ui.Group(parent, label) for label in groups}
        for label, group in groups.items():
            self._add_group(self._places[label], group)
        self._open(next(iter(groups)))

    def refresh(self, settings: Settings) -> None:
        """Show these settings."""
        values = settings.values()
        for path, field in self._fields.items():
            field.show(values[path])
        for group, level in self._levels.items():
            level.show(level_of(group, settings) or _OWN)
        preset = preset_of(settings)
        self._preset.show(preset or _OWN)
        self._preset_text.text = wrapped(self._texts.get(preset, ""))

    def _open(self, label: str) -> None:
        self._group.show(label)
        for each, place in self._places.items():
            place.visible = each == label

    def _add_group(self, parent: ui.Widget, group: ControlGroup) -> None:
        explain(parent, group.text)
        if group.levels:
            level = combo(parent, "Level", [*group.levels, _OWN], self._listening(partial(at_level, group.name)))
            self._levels[group.name] = level
            explain(parent, "\n".join(f"{name}: {text}" for name, text in group.levels.items()))
        for control in group.controls:
            self._fields[control.path] = self._made(parent, control)
            explain(parent, control.text)

    def _made(self, parent: ui.Widget, control: SettingControl) -> Field:
        changed = self._listening(partial(with_value, control.path))
        if control.kind == "boolean":
            return checkbox(parent, control.label, changed)
        if control.kind == "choice":
            return combo(parent, control.label, control.choices, changed)
        low, high = control.low, control.high
        assert low is not None and high is not None
        if control.kind == "integer":
            return whole_number(parent, control.label, int(low), int(high), control.fits_slider, changed)
        return (slider if control.fits_slider else number)(parent, control.label, low, high, changed)

    def _listening(self, changed: Callable[[Any, Settings], Settings]) -> Callable[[Any], object]:
        return lambda value: value != _OWN and self._change(partial(changed, value))


def _at_preset(name: str, _: Settings) -> Settings:
    return Settings.preset(name)
