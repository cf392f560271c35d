"""How objects of a scene's classes are made, and which attributes they have: their fields alone."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields
from typing import Any, ClassVar, TypeVar

from pica.errors import SceneError
from pica.names import checked_names, unknown
from pica.scene.checked_field import CheckedField, ReadOnlyCopies, described, read_only

_Made = TypeVar("_Made")
_put = object.__setattr__


class FieldsOnly(ReadOnlyCopies):
    """Rejects assignment to attributes that are no fields, such as misspelt ones, which would have no effect.

    Fields are the annotated ones of a class, and its settable properties; a subclass may declare its own.
    """

    _assignable: ClassVar[frozenset[str]] = frozenset()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        properties = {name for name, value in vars(cls).items() if isinstance(value, property) and value.fset}
        cls._assignable = cls._assignable.union(vars(cls).get("__annotations__", ()), properties)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._assignable and not name.startswith("_"):
            is_attribute = hasattr(type(self), name)
            fault = f"{name}: cannot be assigned" if is_attribute else unknown(name, sorted(self._assignable))
            raise SceneError(f"{described(self)}: {fault}")
        _put(self, name, value)


def fields_only(made: type[_Made]) -> type[_Made]:
    """A decorator over that of a dataclass of FieldsOnly: objects are made without asking for each field whether it is
    one, and without checking defaults. Arguments that are no fields are a SceneError."""
    plain: Callable[..., None] = made.__init__
    parameters = list(inspect.signature(plain).parameters.values())[1:]
    names = frozenset(parameter.name for parameter in parameters)
    required = frozenset(parameter.name for parameter in parameters if parameter.default is inspect.Parameter.empty)
    in_order = [parameter.name for parameter in parameters if parameter.kind is not inspect.Parameter.KEYWORD_ONLY]
    rank = {parameter.name: place for place, parameter in enumerate(parameters)}
    defaults, factories = _defaults(made)
    complete = getattr(made, "__post_init__", None)

    @functools.wraps(plain)
    def construct(self: Any, *values: Any, **named: Any) -> None:
        given = dict(zip(in_order, values, strict=False)) | named if values else named
        if len(given) < len(values) + len(named) or not required <= given.keys() <= names:
            plain(self, *values, **named)  # which raises the precise error
        attributes = vars(self)
        attributes.update(defaults)
        for name, factory in factories.items():
            attributes[name] = factory()
        for name in sorted(given, key=rank.__getitem__):  # names of objects come before values that may be invalid
            _put(self, name, given[name])
        if complete is not None:
            self.__post_init__()

    made.__init__ = construct  # type: ignore[method-assign]
    return checked_names(SceneError)(made)


def unchecked_constructor(made: type[_Made]) -> Callable[..., _Made]:
    """A constructor of a dataclass for valid values, many times as fast as the class itself.

    Nothing is checked or converted, `__post_init__` is not called, and omitted fields have their defaults.
    For readers of large files, which have checked the values.
    """
    defaults, factories = _defaults(made)
    checked = {name for name, value in vars(made).items() if isinstance(value, CheckedField)}

    def construct(**values: Any) -> _Made:
        attributes = defaults | values
        for name, factory in factories.items():
            if name not in values:
                attributes[name] = factory()
        for name in checked.intersection(values):
            attributes[name] = read_only(values[name])
        constructed = object.__new__(made)
        _put(constructed, "__dict__", attributes)  # classes may be frozen
        return constructed

    return construct


def _defaults(made: type) -> tuple[dict[str, Any], dict[str, Callable[[], Any]]]:
    """Defaults of fields: shared values, and factories."""
    shared: dict[str, Any] = {}
    factories: dict[str, Callable[[], Any]] = {}
    for field in fields(made):
        factory = field.default if isinstance(field.default, type) else field.default_factory
        if callable(factory) and isinstance(vars(made).get(field.name), CheckedField):
            shared[field.name] = read_only(factory())
        elif callable(factory):
            factories[field.name] = factory
        elif field.default is not MISSING:
            shared[field.name] = field.default
    return shared, factories
