"""Checks for the fields of a scene: they return the value to store, or raise why it is invalid.

A check is a function of the user's value. Its UnfitError contains only the fault; the caller,
`checked` or a CheckedField, makes a SceneError of it with the field's name. Checks of arrays are in arrays.py.
"""

import math
from collections.abc import Callable, Iterator
from itertools import islice
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np

from pica.errors import PicaError, SceneError, plain, shown

_Value = TypeVar("_Value")
Check = Callable[[Any], _Value]

LARGEST = float(np.finfo(np.float32).max)
"""Of the numbers that shaders can hold."""
BRIGHTEST = 1e36
"""Nits, candela or lux: sums and products of light on its way to a picture must stay finite too."""
_SMALLEST = float(np.finfo(np.float32).tiny)
"""Above 0, likewise."""
TOO_LARGE = "is too large for 32-bit floats"


class UnfitError(Exception):
    """Why a value is invalid, such as "nan is not finite"."""


def checked(what: str, check: Check[_Value], value: Any, error: type[PicaError] = SceneError) -> _Value:
    """The value to store in `what`, such as "spline: points". Raises the error if it is invalid."""
    try:
        return check(value)
    except UnfitError as unfit:
        raise error(f"{what}: {unfit}") from None


def number(low: float = -LARGEST, high: float = LARGEST) -> Check[float]:
    """A finite number from low to high."""

    def check(value: Any) -> float:
        if type(value) is not float:
            value = _real(value)
        if not low <= value <= high:
            raise UnfitError(f"{shown(value)} {_outside(value, low, high)}")
        return float(value)

    return check


def angle(low: float, high: float) -> Check[float]:
    """Radians from low to high."""
    any_number = number()

    def check(value: Any) -> float:
        number = any_number(value)
        if not low <= number <= high:
            hint = f"; for degrees, write math.radians({number:g})" if number > 2 * math.pi else ""
            raise UnfitError(f"{shown(number)} is not from {low:g} to {high:g} radians{hint}")
        return number

    return check


def positive(high: float = LARGEST) -> Check[float]:
    """A finite number above 0."""
    within = number(high=high)

    def check(value: Any) -> float:
        number = within(value)
        if number < _SMALLEST:
            raise UnfitError(f"{shown(number)} is not above 0")
        return number

    return check


def whole(low: int = -(1 << 63), high: int = (1 << 63) - 1) -> Check[int]:
    """A whole number from low to high: of 64 bits by default."""

    def check(value: Any) -> int:
        number = plain(value)
        if isinstance(number, bool) or not isinstance(number, Integral):
            raise UnfitError(f"{shown(value)} is not a whole number")
        if not low <= int(number) <= high:
            raise UnfitError(f"{shown(value)} is not from {low} to {high}")
        return int(number)

    return check


def vector(count: int, low: float = -LARGEST, high: float = LARGEST) -> Check[tuple[Any, ...]]:
    """So many finite numbers from low to high, in any iterable."""
    one = number(low, high)

    def check(values: Any) -> tuple[float, ...]:
        items = values if type(values) is tuple else tuple(islice(_each(values), count + 1))
        if len(items) != count:
            raise UnfitError(f"{shown(values)} is not {count} numbers")
        return tuple(one(value) for value in items)

    return check


def flag(value: Any) -> bool:
    """True or false."""
    if type(value) is bool:
        return value
    if isinstance(value, np.bool_):
        return bool(value)
    raise UnfitError(f"{shown(value)} is not True or False")


def text(value: Any) -> str:
    """Text."""
    if isinstance(value, str):
        return value
    raise UnfitError(f"{shown(value)} is not text")


def choice(*options: str) -> Check[Any]:
    """One of some words."""

    def check(value: Any) -> str:
        if isinstance(value, str) and value in options:
            return value
        raise UnfitError(f"{shown(value)} is not one of {', '.join(options)}")

    return check


def instance(*kinds: type[Any]) -> Check[Any]:
    """An object of one of some classes."""

    def check(value: Any) -> Any:
        if isinstance(value, kinds):
            return value
        wanted = " or ".join(kind.__name__ for kind in kinds)
        raise UnfitError(f"{shown(value)} is not {_article(wanted)} {wanted}")

    return check


def items(*kinds: type[Any]) -> Check[tuple[Any, ...]]:
    """Objects of one of some classes, in any iterable."""
    one = instance(*kinds)
    return lambda values: tuple(one(value) for value in _each(values))


def optional(check: Check[_Value]) -> Check[_Value | None]:
    """None, or a value that passes the check."""
    return lambda value: None if value is None else check(value)


def _each(values: Any) -> Iterator[Any]:
    if isinstance(values, str | bytes):
        raise UnfitError(f"{shown(values)} is text, not several values")
    try:
        yield from values
    except UnfitError:
        raise
    except Exception:  # raised by iteration
        raise UnfitError(f"{shown(values)} is not several values") from None


def _real(value: Any) -> Any:
    number = plain(value)
    if isinstance(number, bool) or not isinstance(number, Real):
        raise UnfitError(f"{shown(value)} is not a number")
    return number


def _outside(value: Any, low: float, high: float) -> str:
    """Why a number is not from low to high."""
    try:
        finite = math.isfinite(value)
    except OverflowError:  # an integer beyond all floats
        finite = True
    if not finite:
        return "is not finite"
    if abs(value) > LARGEST:
        return TOO_LARGE
    if value < 0 == low:
        return "is negative"
    if high == LARGEST:
        return f"is less than {low:g}"
    return f"is not from {low:g} to {high:g}"


def _article(noun: str) -> str:
    return "an" if noun[0] in "AEIOU" else "a"
