"""One key of many JSON objects: checked together, and one by one only if that fails.

A file of a million nodes would be several times as slow otherwise. Element has the error messages.
"""

from collections.abc import Sequence
from contextlib import suppress
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.gltf.element import MOST, Element
from pica.scene.values import LARGEST


def numbers(
    entries: Sequence[Element], key: str, count: int, default: tuple[float, ...] | None = None
) -> NDArray[np.float64]:
    """(entries, count) results of Element.numbers for each."""
    rows: list[Any] = [entry.values.get(key, default) for entry in entries]
    if default is not None and rows.count(default) == len(rows):
        return np.tile(default, (len(rows), 1))
    if set(map(type, rows)) <= {list, tuple} and set(map(len, rows)) == {count}:
        flat = list(chain.from_iterable(rows))
        if set(map(type, flat)) <= {float, int}:
            try:
                array = np.array(flat, np.float64)
            except OverflowError:  # an integer beyond all floats
                array = np.full(1, np.inf)
            if (np.abs(array) <= LARGEST).all():
                return array.reshape(-1, count)
    checked = [entry.numbers(key, count, default=default) for entry in entries]
    return np.array(checked, np.float64).reshape(-1, count)


def integers(entries: Sequence[Element], key: str, default: int = -1) -> NDArray[np.int64]:
    """(entries,) the values that are integers of at least 0, and -1 for others, which Element checks."""
    values = [entry.values.get(key, default) for entry in entries]
    if set(map(type, values)) <= {int}:
        with suppress(OverflowError):
            array = np.array(values, np.int64)
            return np.where((array >= 0) & (array <= MOST), array, -1)
    fitting = [value if type(value) is int and 0 <= value <= MOST else -1 for value in values]
    return np.array(fitting, np.int64)
