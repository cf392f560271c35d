"""Hypothesis strategies that break what is whole: JSON at any place, and bytes."""

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

from hypothesis import strategies as st

Place = tuple[Any, ...]

NUMBERS = [0, -1, 1, 3, 255, 256, 65536, 5_000_000, 2**31 - 1, 2**31, 2**32, 2**53, 2**64, 10**40]
NUMBERS += [-0.0, 0.5, -1.5, 1e-320, 1e38, 1e39, 1e308, float("nan"), float("inf"), -float("inf")]
TEXTS = [
    "",
    " ",
    "\n",
    "\0",
    "\x1b[2J",
    "\ud800",
    "..",
    "../x",
    "/dev/zero",
    "file:///etc/passwd",
    "%2e%2e/x",
    "x" * 5000,
]
TEXTS += [
    "data:,",
    "data:;base64,!",
    "data:application/octet-stream;base64,AAAA",
    "VEC3",
    "MAT4",
    "BLEND",
    "nan",
    "true",
]
VALUES: list[Any] = [*NUMBERS, *TEXTS, None, True, False, [], {}, [[]], [0], [None], {"extras": [1]}, [1e308] * 16]
hostile = st.sampled_from(VALUES) | st.integers() | st.floats() | st.text(max_size=20)


def places(value: Any, place: Place = ()) -> Iterator[Place]:
    """The way to every part of some JSON."""
    yield place
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from places(inner, (*place, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from places(inner, (*place, index))


def at(value: Any, place: Place) -> Any:
    """The part at a place."""
    for step in place:
        value = value[step]
    return value


@st.composite
def broken_json(draw: st.DrawFn, whole: dict[str, Any]) -> dict[str, Any]:
    """Up to three parts of `whole` are left out, repeated, or replaced by something else or by each other."""
    value = deepcopy(whole)
    for _ in range(draw(st.integers(1, 3))):
        ways = list(places(value))[1:]
        if not ways:
            break
        *outer, last = draw(st.sampled_from(ways))
        container = at(value, tuple(outer))
        match draw(st.sampled_from(["replace", "replace", "replace", "remove", "copy", "repeat", "add"])):
            case "replace":
                container[last] = draw(hostile)
            case "remove":
                del container[last]
            case "copy":
                container[last] = deepcopy(at(value, draw(st.sampled_from(ways))))
            case "repeat" if isinstance(container, list):
                container.extend(deepcopy(container[last]) for _ in range(draw(st.integers(1, 50))))
            case "add" if isinstance(container, dict):
                container[draw(st.text(max_size=8))] = draw(hostile)
    return value


@st.composite
def broken_bytes(draw: st.DrawFn, whole: bytes) -> bytes:
    """`whole` cut short, with some bytes changed, taken out or put in."""
    content = bytearray(whole)
    for _ in range(draw(st.integers(1, 8))):
        start = draw(st.integers(0, max(len(content) - 1, 0)))
        match draw(st.sampled_from(["change", "change", "word", "cut", "remove", "insert"])):
            case "change" if content:
                content[start] = draw(st.integers(0, 255))
            case "word":
                word = draw(st.sampled_from([0, 1, 2**31 - 1, 2**31, 2**32 - 1]))
                content[start : start + 4] = word.to_bytes(4, draw(st.sampled_from(["little", "big"])))
            case "cut":
                del content[start:]
            case "remove":
                del content[start : start + draw(st.integers(1, 64))]
            case "insert":
                content[start:start] = draw(st.binary(max_size=64))
    return bytes(content)
