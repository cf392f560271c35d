"""Fields of dataclasses that check assigned values, so that an error points at the assignment."""

from collections.abc import Callable
from typing import Any, Generic, NoReturn, TypeVar, overload

import numpy as np

from pica.errors import SceneError, shown
from pica.names import kind_of
from pica.scene.values import Check, UnfitError

_Value = TypeVar("_Value")
_REQUIRED = object()


class CheckedField(Generic[_Value]):
    """A field that stores the result of its check for an assigned value. Raises SceneError, with the field's name.

    A descriptor for dataclasses. The default is not checked; a class as default is instantiated for each object.
    Without a default the field is required. Values change only by assignment, which can be checked and
    tracked: arrays are read-only views, and dictionaries are immutable.
    """

    def __init__(self, check: Check[_Value], default: Any = _REQUIRED) -> None:
        self.check, self._default = check, default
        self._make: Callable[[], Any] | None = default if isinstance(default, type) else None

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, holder: None, owner: type) -> _Value: ...
    @overload
    def __get__(self, holder: object, owner: type) -> _Value: ...
    def __get__(self, holder: object | None, owner: type) -> _Value:
        if holder is not None:
            try:
                return holder.__dict__[self._name]
            except KeyError:
                pass
        if holder is not None or self._default is _REQUIRED:
            raise AttributeError(f"{owner.__name__} has no {self._name}")
        return self._default

    def __set__(self, holder: object, value: _Value) -> None:
        if value is not self._default:
            value = fitting(holder, self._name, self.check, value)
        elif self._make is not None:
            value = self._make()
        holder.__dict__[self._name] = read_only(value)

    def check_again(self, holder: object) -> None:
        """Raises SceneError if an array is invalid after writes into it."""
        CheckedField.__set__(self, holder, self.__get__(holder, type(holder)))


class ReadOnlyDict(dict[Any, Any]):
    """A dictionary that is assigned as a whole."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise SceneError("a dictionary of a scene is read-only; assign a new one, such as {**old, name: value}")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return ReadOnlyDict, (dict(self),)


def read_only(value: Any) -> Any:
    """The value, such that it cannot be written into: an array as a view of itself, a dictionary as a copy."""
    if isinstance(value, np.ndarray):
        if value.flags.writeable:
            value = value.view()
            value.setflags(write=False)
    elif type(value) is dict:
        return ReadOnlyDict(value)
    return value


class ReadOnlyCopies:
    """Make a copied or unpickled value's arrays read-only, which NumPy's own copies are not."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        arrays = {name: read_only(value) for name, value in state.items() if isinstance(value, np.ndarray)}
        vars(self).update(state | arrays)


def fitting(holder: object, field: str, check: Check[_Value], value: Any) -> _Value:
    """The value to store in a field of an object. Raises SceneError if it is invalid."""
    try:
        return check(value)
    except UnfitError as unfit:
        raise SceneError(f"{described(holder)}: {field}: {unfit}") from None


def check_again(holder: object) -> None:
    """Check all fields of an object, after possible writes into their arrays. Raises SceneError."""
    for field in vars(type(holder)).values():
        if isinstance(field, CheckedField):
            field.check_again(holder)


def described(holder: object) -> str:
    """An object in a message: its class and, if set already, its name."""
    kind = kind_of(type(holder))
    name = vars(holder).get("name")
    return f"{kind} {shown(name)}" if isinstance(name, str) and name else kind
