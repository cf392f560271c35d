"""Fields that tell who follows a scene when they are set anew."""

from typing import TYPE_CHECKING, TypeVar

from pica.scene.checked_field import CheckedField

if TYPE_CHECKING:
    from pica.scene.model import Node

_Value = TypeVar("_Value")


class TrackedField(CheckedField[_Value]):
    """A field of Node: setting it puts the node among its scene's altered ones."""

    def __set__(self, node: "Node", value: _Value) -> None:  # type: ignore[override]
        super().__set__(node, value)
        for listener in node._listeners or ():
            listener.altered[node] = None
