"""Inputs for the preset and every setting, made from their controls."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

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
from pica.viewer.web.inputs import Input

if TYPE_CHECKING:
    import viser

_OWN = "(own values)"
"""Shown where the values are of no preset or level."""

Change = Callable[[Callable[[Settings], Settings]], None]
"""Asks for other settings, as a function of those of now."""


class SettingsPanel:
    """The inputs, which show the settings of the newest `refresh`."""

    def __init__(self, gui: "viser.GuiApi", settings: Settings, change: Change) -> None:
        self._gui, self._change = gui, change
        self._inputs: dict[str, Input] = {}
        self._levels: dict[str, Input] = {}
        texts = presets()
        hint = " ".join(f"{name}: {text}" for name, text in texts.items())
        preset = gui.add_dropdown("Preset", (*texts, _OWN), initial_value=_OWN, hint=hint)
        self._preset = self._listening(preset, lambda name, _: Settings.preset(name))
        for group in setting_controls():
            with gui.add_folder(group.label, expand_by_default=False):
                self._add_group(group, settings)
        self.refresh(settings)

    def refresh(self, settings: Settings, again: bool = False) -> None:
        """Show these settings; `again` as Input.show."""
        values = settings.values()
        for path, shown in self._inputs.items():
            shown.show(values[path], again)
        for group, shown in self._levels.items():
            shown.show(level_of(group, settings) or _OWN, again)
        self._preset.show(preset_of(settings) or _OWN, again)

    def _add_group(self, group: ControlGroup, settings: Settings) -> None:
        if group.levels:
            hint = " ".join(f"{name}: {text}" for name, text in group.levels.items())
            level = self._gui.add_dropdown("Level", (*group.levels, _OWN), initial_value=_OWN, hint=hint)
            self._levels[group.name] = self._listening(level, partial(at_level, group.name))
        for control in group.controls:
            handle = self._made(control, settings.values()[control.path])
            self._inputs[control.path] = self._listening(handle, partial(with_value, control.path))

    def _made(self, control: SettingControl, value: Any) -> Any:
        gui, label, hint = self._gui, control.label, control.text
        if control.kind == "boolean":
            return gui.add_checkbox(label, value, hint=hint)
        if control.kind == "choice":
            return gui.add_dropdown(label, control.choices, initial_value=value, hint=hint)
        low, high = control.low, control.high
        assert low is not None and high is not None
        whole = control.kind == "integer"
        if control.fits_slider:
            return gui.add_slider(label, low, high, 1 if whole else 0.01, value, hint=hint)
        return gui.add_number(label, value, min=low, max=high, step=1 if whole else 0.1, hint=hint)

    def _listening(self, handle: Any, changed: Callable[[Any, Settings], Settings]) -> Input:
        return Input(handle, lambda value: value != _OWN and self._change(partial(changed, value)))
