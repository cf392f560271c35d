"""Hides nodes with all below them, and shows them again as they were."""

from typing import Any
from weakref import WeakKeyDictionary

from pica.scene.node import Node
from pica.viewer.edits import Change

_HIDDEN: dict[str, Any] = {
    "visible_to_camera": False,
    "visible_to_reflections": False,
    "casts_shadows": False,
    "light": None,
}
"""Values of the fields that show a node."""


class Visibility:
    """Whether nodes are visible, and what makes them so."""

    def __init__(self) -> None:
        self._shown: WeakKeyDictionary[Node, dict[str, Any]] = WeakKeyDictionary()
        """Values of the fields by node, from before it was hidden."""

    def shows(self, node: Node) -> bool | None:
        """Whether a mesh or a light of the node or below it is visible; None: there are none."""
        parts = [below for below in node.walk() if below.mesh is not None or below.light or below in self._shown]
        return any(map(_is_visible, parts)) if parts else None

    def changes(self, node: Node, visible: bool) -> list[Change]:
        """The changes that show or hide a node with all below it."""
        changes: list[Change] = []
        for below in node.walk():
            if _is_visible(below) == visible:
                continue
            if visible:
                values = self._shown.get(below) or dict.fromkeys(list(_HIDDEN)[:3], True)
            else:
                self._shown[below] = {name: getattr(below, name) for name in _HIDDEN}
                values = _HIDDEN
            changes += [(below, name, value) for name, value in values.items()]
        return changes


def _is_visible(node: Node) -> bool:
    return node.light is not None or (node.mesh is not None and node.visible_to_camera)
