"""Widgets of ImGui that show values of the viewer, and change them."""

import textwrap
from collections.abc import Callable, Sequence
from typing import Any

import slangpy as spy
from slangpy import ui

COLUMNS = 62
"""Letters of a line of text, so that it fits the panel."""
_CLAMPED = ui.SliderFlags.always_clamp
_FINE = 200
"""Pixels that the mouse is dragged over the range of a number."""
_LARGEST = 1e9
"""Of numbers without a limit of their own."""

Changed = Callable[[Any], object]
"""Called with each value that the user sets, while the panel is drawn: it may not change widgets."""


class Field:
    """A widget, and the value of the viewer that it shows."""

    def __init__(self, widget: Any, changed: Changed, encode: Changed = lambda value: value) -> None:
        """`encode`: from the viewer's value to the widget's; a number more or less is no other value."""
        self.widget, self._encode = widget, encode
        self._shown: Any = None

        def on_change(value: Any) -> None:
            self._shown = None  # shown anew if the viewer refuses it
            changed(value)

        widget.callback = on_change

    def show(self, value: Any) -> None:
        """Show a value of the viewer."""
        if value != self._shown:
            self._shown, self.widget.value = value, self._encode(value)


class Choice(Field):
    """A choice among texts, in a combo box or a list; values are the texts."""

    def __init__(self, widget: "ui.ComboBox | ui.ListBox", options: Sequence[str], changed: Changed) -> None:
        super().__init__(widget, lambda number: changed(self.options[number]), self._number)
        self.options: Sequence[str] = ()
        self.offer(options)

    def offer(self, options: Sequence[str]) -> None:
        """Let the user choose among these."""
        if list(options) != list(self.options):
            self.options, self._shown = options, None
            self.widget.items = list(options)

    def _number(self, value: str) -> int:
        return self.options.index(value) if value in self.options else -1


def combo(parent: ui.Widget, label: str, options: Sequence[str], changed: Changed) -> Choice:
    """A choice that opens on a click."""
    return Choice(ui.ComboBox(parent, label), options, changed)


def checkbox(parent: ui.Widget, label: str, changed: Changed) -> Field:
    """Yes or no; None is no."""
    return Field(ui.CheckBox(parent, label), changed, bool)


def number(parent: ui.Widget, label: str, low: float, high: float, changed: Changed, speed: float = 0.0) -> Field:
    """A number of a wide range, which is dragged or, after a double click, typed. `speed`: change a pixel; 0: of the
    range."""
    speed = speed or (high - low) / _FINE
    made = ui.DragFloat(parent, label, speed=speed, min=low, max=min(high, _LARGEST), flags=_CLAMPED)
    return Field(made, lambda value: changed(rounded(value)))


def slider(parent: ui.Widget, label: str, low: float, high: float, changed: Changed) -> Field:
    """A number of a short range."""
    made = ui.SliderFloat(parent, label, min=low, max=high, flags=_CLAMPED)
    return Field(made, lambda value: changed(rounded(value)))


def whole_number(parent: ui.Widget, label: str, low: int, high: int, is_short: bool, changed: Changed) -> Field:
    """A whole number: of a short range by a slider, else dragged or typed."""
    if is_short:
        return Field(ui.SliderInt(parent, label, min=low, max=high, flags=_CLAMPED), changed)
    speed = (high - low) / _FINE
    return Field(ui.DragInt(parent, label, speed=speed, min=low, max=high, flags=_CLAMPED), changed)


def vector(parent: ui.Widget, label: str, changed: Changed) -> Field:
    """Three numbers, as a tuple."""
    made = ui.DragFloat3(parent, label, speed=0.01)
    return Field(made, lambda value: changed(tuple(map(rounded, value))), lambda value: spy.float3(*value))


def color(parent: ui.Widget, label: str, changed: Changed) -> Field:
    """A colour by three whole numbers, 0 to 255."""
    made = ui.SliderInt3(parent, label, min=0, max=255, flags=_CLAMPED)
    return Field(made, lambda value: changed(tuple(map(int, value))), lambda value: spy.int3(*value))


def explain(parent: ui.Widget, text: str) -> None:
    """Text below a widget: ImGui's widgets of SlangPy have no tooltips."""
    if text:
        ui.Text(parent, wrapped(text))


def wrapped(text: str) -> str:
    """Text in lines that fit the panel."""
    return "\n".join(line for part in text.splitlines() for line in textwrap.wrap(part, COLUMNS))


def rounded(value: float) -> float:
    """A number of single precision, as widgets have them, without the digits that it does not have."""
    return float(f"{value:.6g}")
