"""Curves of fields that are functions of animated keys."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.gltf.pointer_fields import Derived
from pica.scene.keyframes import Floats, Interpolation

_STEPS = 64
"""Linear pieces between two keys of what is not linear between them."""
_SAMPLE_BYTES = 64
"""Bytes per number that is sampled."""


class Curve(NamedTuple):
    """The keys of a channel."""

    times: Floats
    values: Floats
    """As FieldChannel.values."""
    interpolation: Interpolation


def derive(derived: Derived, curves: Mapping[str, Curve], document: Document, entry: Element) -> dict[str, Curve]:
    """The curve of each field; keys without a curve keep their default.

    What is not linear between keys becomes linear pieces, splines too: they may leave the range of a field. Raises
    SceneError where the budget does not suffice.
    """
    moved = {key: curves[key] for key in derived.keys if key in curves}
    steps = all(curve.interpolation == "STEP" for curve in moved.values())
    one = next(iter(moved.values())) if len(moved) == 1 and moved.keys() <= derived.linear else None
    if one is not None and one.interpolation != "CUBICSPLINE":
        interpolation, times = one.interpolation, one.times
        _take(document, entry, derived, len(times))
        values = {
            key: moved[key].values if key in moved else _constant(derived, key, len(times)) for key in derived.keys
        }
    else:
        interpolation = "STEP" if steps else "LINEAR"
        times = np.unique(np.concatenate([curve.times for curve in moved.values()] or [np.zeros(1)]))
        _take(document, entry, derived, len(times) * (1 if steps else 2 * _STEPS))
        times = times if steps else _subdivided(times)
        values = {
            key: _sampled(moved[key], times) if key in moved else _constant(derived, key, len(times))
            for key in derived.keys
        }
        if not steps and any(map(_jumps, moved.values())):  # two keys at the same time are a jump
            before = {key: _sampled(curve, times, before=True) for key, curve in moved.items()}
            values = {key: np.stack([before.get(key, each), each], 1) for key, each in values.items()}
            values = {key: each.reshape(-1, each.shape[-1]) for key, each in values.items()}
            times = np.repeat(times, 2)
    fields = derived.function(*values.values())
    return {name: Curve(times, each, interpolation) for name, each in zip(derived.fields, fields, strict=True)}


def _take(document: Document, entry: Element, derived: Derived, samples: int) -> None:
    document.take(entry, bytes=samples * _SAMPLE_BYTES * sum(map(len, derived.keys.values())))


def _constant(derived: Derived, key: str, count: int) -> Floats:
    return np.tile(derived.keys[key], (count, 1))


def _subdivided(times: Floats) -> Floats:
    between = times[:-1, None] + np.diff(times)[:, None] * np.arange(_STEPS) / _STEPS
    return np.append(between.reshape(-1), times[-1])


def _jumps(curve: Curve) -> bool:
    return curve.interpolation == "STEP" or bool((np.diff(curve.times) == 0).any())


def _sampled(curve: Curve, at: Floats, before: bool = False) -> Floats:
    """(n, components) values at times; `before`: just before them."""
    last = len(curve.times) - 1
    rows = np.clip(np.searchsorted(curve.times, at, "left" if before else "right") - 1, 0, last)
    following = np.minimum(rows + 1, last)
    start, length = curve.times[rows], curve.times[following] - curve.times[rows]
    t = np.clip((at - start) / np.where(length > 0, length, 1), 0, 1)[:, None]
    values = curve.values
    if curve.interpolation == "STEP":
        return values[rows]
    if curve.interpolation == "LINEAR":
        return values[rows] * (1 - t) + values[following] * t
    # glTF 2.0, appendix C.5
    value, leaving = values[rows, 1], values[rows, 2] * length[:, None]
    next_value, arriving = values[following, 1], values[following, 0] * length[:, None]
    t2, t3 = t * t, t * t * t
    first = (2 * t3 - 3 * t2 + 1) * value + (t3 - 2 * t2 + t) * leaving
    return first + (3 * t2 - 2 * t3) * next_value + (t3 - t2) * arriving
