"""Fields of dataclasses that keep only what fits them, so that an error points at the line that set it."""

from collections.abc import Callable
from typing import Any, Generic, NoReturn, TypeVar, overload

import numpy as np

from pica.errors import SceneError, shown
from pica.names import kind_of
from pica.scene.values import Check, UnfitError

_Value = TypeVar("_Value")
_REQUIRED = object()


class CheckedField(Generic[_Value]):
    """A field that keeps what its check gives for the value that it is set to. Raises SceneError, naming the field.

    A descriptor, as dataclasses know them. The default is not checked; a class stands for a new object of it each time.
    Without a default the field must be given. Values are changed by assignment alone, which can be checked and
    followed: arrays are read-only views, and dictionaries refuse to be written into.
    """

    def __init__(self, check: Check[_Value], default: Any = _REQUIRED) -> None:
        self._check, self._default = check, default
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
            value = fitting(holder, self._name, self._check, value)
        elif self._make is not None:
            value = self._make()
        holder.__dict__[self._name] = read_only(value)

    def check_again(self, holder: object) -> None:
        """Raises SceneError when what was written into an array since does not fit."""
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
    """What is copied or pickled with its arrays read-only, as NumPy's own copies of them are not."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        arrays = {name: read_only(value) for name, value in state.items() if isinstance(value, np.ndarray)}
        vars(self).update(state | arrays)


def fitting(holder: object, field: str, check: Check[_Value], value: Any) -> _Value:
    """The value to keep in a field of an object. Raises SceneError where it does not fit."""
    try:
        return check(value)
    except UnfitError as unfit:
        raise SceneError(f"{described(holder)}: {field}: {unfit}") from None


def check_again(holder: object) -> None:
    """Check all fields of an object, for what was written into their arrays. Raises SceneError."""
    for field in vars(type(holder)).values():
        if isinstance(field, CheckedField):
            field.check_again(holder)


def described(holder: object) -> str:
    """What a message calls an object: its class and, where it is known by then, its name."""
    kind = kind_of(type(holder))
    name = vars(holder).get("name")
    return f"{kind} {shown(name)}" if isinstance(name, str) and name else kind
