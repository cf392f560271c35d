"""Suggestions for misspelt names, in the same line."""

import functools
import re
from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import Any, TypeVar

from pica.errors import PicaError, shown

_Made = TypeVar("_Made")
_MOST = 3
"""Names that a message suggests."""


def near_names(name: object, candidates: Iterable[str], most: int = _MOST) -> list[str]:
    """The candidates with nearly the same spelling, or that contain the name; best first."""
    import difflib  # slower to import than the rest of this module

    if not isinstance(name, str) or not name or len(name) > 100:
        return []
    names = list(dict.fromkeys(candidates))
    if close := difflib.get_close_matches(name, names, most, cutoff=0.85):
        return close
    close = difflib.get_close_matches(name, names, most)
    close += [other for other in names if name.lower() in other.lower() and other not in close]
    return close[:most]


def did_you_mean(name: object, candidates: Iterable[str]) -> str:
    """ "; did you mean 'a' or 'b'?", to end a message with; empty if no candidate is near."""
    near = [shown(candidate) for candidate in near_names(name, candidates)]
    return f"; did you mean {' or '.join(filter(None, [', '.join(near[:-1]), *near[-1:]]))}?" if near else ""


def unknown(name: str, candidates: Iterable[str]) -> str:
    """The message for an unknown field name, with near or available ones."""
    names = [candidate for candidate in candidates if not candidate.startswith("_")]
    return f"no field {shown(name)}{did_you_mean(name, names) or '; there are ' + ', '.join(names)}"


def kind_of(made: type) -> str:
    """A class in messages: "point light" for PointLight."""
    return re.sub("(?<!^)(?=[A-Z])", " ", made.__name__).lower()


def checked_names(error: type[PicaError]) -> Callable[[type[_Made]], type[_Made]]:
    """A decorator on top of a dataclass's: arguments that are no fields raise an error of one line, and so does
    assignment to an object of a frozen one."""

    def decorated(made: type[_Made]) -> type[_Made]:
        construct: Callable[..., None] = made.__init__
        parameters = [field.name for field in fields(made) if field.init]  # type: ignore[arg-type]  # of a dataclass

        @functools.wraps(construct)
        def checked(self: Any, *values: Any, **named: Any) -> None:
            try:
                construct(self, *values, **named)
            except TypeError:
                for name in named.keys() - set(parameters):
                    raise error(f"{kind_of(made)}: {unknown(name, parameters)}") from None
                raise

        def refuse(self: Any, name: str, value: Any = None) -> None:
            if type(self) is not made and name not in parameters:  # of a subclass
                return object.__setattr__(self, name, value)
            fault = f"stays as it was made; make another: dataclasses.replace(..., {name}=...)"
            if name not in parameters:
                fault = unknown(name, parameters)
                raise error(f"{kind_of(made)}: {fault}")
            raise error(f"{kind_of(made)}: {name}: {fault}")

        made.__init__ = checked  # type: ignore[method-assign]
        if made.__dataclass_params__.frozen:  # type: ignore[attr-defined]
            made.__setattr__ = refuse  # type: ignore[method-assign]
        return made

    return decorated
