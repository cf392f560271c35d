"""The tree of nodes, and widgets for the properties of what is selected."""

from collections.abc import Callable
from functools import partial
from typing import Protocol

from slangpy import ui

from pica.scene.node import Node
from pica.viewer.properties import Property, environment_properties, property_groups
from pica.viewer.tree import tree_lines
from pica.viewer.viewer import Viewer
from pica.viewer.window.fields import Choice, Field, checkbox, color, explain, number, slider, vector

_NOTHING = "(nothing)"
_ROWS = 10
"""Of the tree that are in sight."""
_FASTER = 50
"""Pixels that the mouse is dragged until a number without a limit has doubled."""
_INDENT = "    "


class SceneActions(Protocol):
    """What the panel asks the window for; it is done once the panel is drawn."""

    def change(self, act: Callable[[], object]) -> None:
        """Do something to the viewer, between two pictures."""

    def open(self, name: str) -> None:
        """Show another scene, or light this one by another environment."""


class SceneSection:
    """The widgets, which show the viewer as of the newest `refresh`."""

    def __init__(self, parent: ui.Widget, viewer: Viewer, actions: SceneActions) -> None:
        self._viewer, self._change = viewer, actions.change
        self._lines: dict[str, Node] = {}
        tree = ui.ListBox(parent, "Node", height_in_items=_ROWS)
        self._tree = Choice(tree, (_NOTHING,), self._select)
        self._undo = ui.Button(parent, "Undo", lambda: self._change(viewer.edits.undo))
        self._redo = ui.Button(parent, "Redo", lambda: self._change(viewer.edits.redo))
        self._selected = ui.Group(parent, "Selected")
        self._fields: list[tuple[Property, Field]] = []
        self._layout: object = None
        """What the widgets are for."""
        self._environment_place = ui.Group(parent, "Environment")
        self._environment: list[tuple[Property, Field]] = []
        file = ui.Group(parent, "File")
        name = ui.InputText(file, "Name", value="")
        ui.Button(file, "Open", lambda: actions.open(name.value))
        explain(file, "A scene, as for pica view, or an environment, .hdr or .exr. Or drop a file onto the window.")
        self.refresh()

    def refresh(self) -> None:
        """Show the viewer as it is."""
        viewer = self._viewer
        self._lines = {line.replace("\u2003", _INDENT): node for line, node in tree_lines(viewer.scene).items()}
        self._tree.offer([_NOTHING, *self._lines])
        self._tree.show(next((line for line, node in self._lines.items() if node is viewer.node), _NOTHING))
        self._undo.enabled, self._redo.enabled = viewer.edits.can_undo, viewer.edits.can_redo
        layout = viewer.node, viewer.materials, None if viewer.node is None else type(viewer.node.light)
        if layout != self._layout:
            self._layout = layout
            self._build()
        if bool(self._environment) != (viewer.scene.environment is not None):
            self._environment_place.remove_all_children()
            properties = environment_properties(viewer.scene)
            self._environment = [(each, self._field(self._environment_place, each)) for each in properties]
        for of, field in (*self._fields, *self._environment):
            field.show(of.read())

    def _build(self) -> None:
        self._selected.remove_all_children()
        self._fields = []
        node = self._viewer.node
        if node is None:
            explain(self._selected, "Click a surface, or a node of the tree.")
            return
        for group in property_groups(node, self._viewer.materials, self._viewer.visibility):
            place = ui.Group(self._selected, group.label)
            self._fields += [(each, self._field(place, each)) for each in group.properties]

    def _field(self, parent: ui.Widget, of: Property) -> Field:
        def changed(value: object) -> None:
            self._change(lambda: self._viewer.edits.apply(of.changes(value)))

        match of.kind:
            case "boolean":
                made = checkbox(parent, of.label, changed)
            case "number":
                made = number(parent, of.label, 0.0, float("inf"), changed, max(abs(of.read()), 0.5) / _FASTER)
            case "share":
                made = slider(parent, of.label, 0.0, 1.0, changed)
            case "angle":
                made = slider(parent, of.label, -180.0, 180.0, changed)
            case "vector":
                made = vector(parent, of.label, changed)
            case "color":
                made = color(parent, of.label, changed)
        explain(parent, of.hint)
        return made

    def _select(self, line: str) -> None:
        self._change(partial(self._select_line, line))

    def _select_line(self, line: str) -> None:
        self._viewer.select(self._lines.get(line))
