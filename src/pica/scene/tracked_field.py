"""Fields that tell who follows a scene when they are set anew."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

if TYPE_CHECKING:
    from pica.scene.model import Node

_Value = TypeVar("_Value")


class TrackedField(Generic[_Value]):
    """A field of Node: setting it puts the node among its scene's altered ones.

    A descriptor, as dataclasses know them; `checked` gives the value to keep, or raises SceneError.
    """

    def __init__(self, default: _Value, checked: Callable[[Any], _Value] | None = None) -> None:
        self._default, self._checked = default, checked

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, node: None, owner: type) -> _Value: ...
    @overload
    def __get__(self, node: "Node", owner: type) -> _Value: ...
    def __get__(self, node: "Node | None", owner: type) -> _Value:
        return self._default if node is None else node.__dict__[self._name]

    def __set__(self, node: "Node", value: _Value) -> None:
        node.__dict__[self._name] = self._checked(value) if self._checked else value
        for listener in node._listeners or ():
            listener.altered[node] = None
