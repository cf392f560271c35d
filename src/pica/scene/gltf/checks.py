"""Typed access to values from a file: each check returns the value or raises SceneError that says where it stood."""

import math
from typing import Any

from pica.errors import SceneError

LONGEST = 80
"""Characters of a file's own text that a message shows."""


def shown(value: object) -> str:
    """A value from a file on one short line."""
    text = " ".join(str(value).split()) if isinstance(value, Exception) else repr(value)
    return text if len(text) <= LONGEST else text[:LONGEST] + "…"


def whole(value: object, where: str, low: int = 0, high: float = math.inf, default: int | None = None) -> int:
    """An integer from low to high; `default` where the file says nothing."""
    if value is None and default is not None:
        return default
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise SceneError(f"{where}: {shown(value)} is not a whole number{_span(low, high)}")
    return value


def number(
    value: object, where: str, low: float = -math.inf, high: float = math.inf, default: float | None = None
) -> float:
    """A finite number from low to high; `default` where the file says nothing."""
    if value is None and default is not None:
        return default
    if (
        isinstance(value, (int, float))
        and not isinstance(value, bool)
        and math.isfinite(value)
        and low <= value <= high
    ):
        return float(value)
    raise SceneError(f"{where}: {shown(value)} is not a number{_span(low, high)}")


def flag(value: object, where: str, default: bool) -> bool:
    """True or false; `default` where the file says nothing."""
    if value is None:
        return default
    if not isinstance(value, bool):
        raise SceneError(f"{where}: {shown(value)} is not true or false")
    return value


def numbers(
    value: object, count: int, where: str, low: float = -math.inf, high: float = math.inf,
    default: tuple[float, ...] | None = None,
) -> tuple[Any, ...]:  # fmt: skip
    """`count` finite numbers from low to high; `default` where the file says nothing."""
    if value is None and default is not None:
        return default
    if not isinstance(value, list) or len(value) != count:
        raise SceneError(f"{where}: {shown(value)} is not a list of {count} numbers")
    return tuple(number(entry, where, low, high) for entry in value)


def choice(value: object, where: str, known: dict[Any, Any]) -> Any:
    """What `known` gives for the value."""
    if isinstance(value, (str, int)) and value in known:
        return known[value]
    raise SceneError(f"{where}: {shown(value)} is not one of {', '.join(map(str, known))}")


def mapping(value: object, where: str) -> dict[str, Any]:
    """A JSON object; empty where the file says nothing."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise SceneError(f"{where}: {shown(value)} is not an object")
    return value


def listing(value: object, where: str) -> list[Any]:
    """A JSON array; empty where the file says nothing."""
    if value is None:
        return []
    if not isinstance(value, list):
        raise SceneError(f"{where}: {shown(value)} is not an array")
    return value


def text(value: object) -> str:
    """A name; empty where the file gives none."""
    return value if isinstance(value, str) else ""


def extension(holder: Any, name: str, where: str) -> dict[str, Any] | None:
    """The extension `name` of a glTF object; None where it has none."""
    extensions = mapping(holder.extensions, f"{where}.extensions")
    return mapping(extensions[name], f"{where}.extensions.{name}") if name in extensions else None


def _span(low: float, high: float) -> str:
    if low == -math.inf and high == math.inf:
        return ""
    return f" from {low} to {high}" if high != math.inf else f" of at least {low}"
