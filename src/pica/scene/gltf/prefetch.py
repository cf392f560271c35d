"""Reads many small accessors together: one by one, NumPy's calls would take most of the time."""

from collections.abc import Iterable, Iterator
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.gltf.accessor_table import DenseAccessor

if TYPE_CHECKING:
    from pica.scene.gltf.container import Document

_SMALL = 1 << 10
"""Numbers in an accessor that is read with others."""
_AT_ONCE = 1 << 12
"""Accessors."""
_NUMBER_BYTES = 16
"""Temporary memory per number."""


class SmallAccessors:
    """The content of small accessors, once prefetched."""

    def __init__(self, document: "Document") -> None:
        self._document = document
        self._found: dict[int, NDArray[Any]] = {}

    def get(self, index: Any) -> NDArray[Any] | None:
        """(count, components) of an accessor, read-only, floats finite; None unless that has been prefetched."""
        return self._found.get(index) if type(index) is int else None

    def prefetch(self, indices: Iterable[Any]) -> None:
        """Read the accessors that are small, dense and valid. Others are left to their readers.

        Raises SceneError for a buffer that cannot be read: give accessors that the scene needs.
        """
        alike: dict[tuple[int, str, int, int], dict[int, DenseAccessor]] = {}
        table = self._document.dense_accessors
        for index in dict.fromkeys(index for index in indices if type(index) is int and index not in self._found):
            dense = table.get(index)
            if dense is not None and dense.elements * dense.width <= _SMALL:
                alike.setdefault((dense.buffer, dense.dtype.str, dense.width, dense.stride), {})[index] = dense
        for group in alike.values():
            left = iter(group.items())
            while some := dict(islice(left, _AT_ONCE)):
                self._found.update(self._read(some))

    def _read(self, group: dict[int, DenseAccessor]) -> Iterator[tuple[int, NDArray[Any]]]:
        """The content of accessors that differ only in offset and count."""
        one = next(iter(group.values()))
        buffers = self._document.entries("buffers")
        if one.buffer >= len(buffers):
            return
        content = self._document.buffer(buffers[one.buffer])
        size = one.dtype.itemsize
        starts = np.array([dense.start for dense in group.values()])
        counts = np.array([dense.elements for dense in group.values()])
        ends = np.array([dense.view_end for dense in group.values()])
        fits = (ends <= len(content)) & (starts % size == 0)
        if one.stride % size or not fits.any():
            return
        starts, counts = starts[fits], counts[fits]
        bounds = np.cumsum([0, *counts.tolist()])
        self._document.take(self._document.root, "accessors", bytes=int(bounds[-1]) * one.width * _NUMBER_BYTES)
        within = np.arange(bounds[-1]) - np.repeat(bounds[:-1], counts)
        places = (np.repeat(starts, counts) + within * one.stride) // size
        numbers = np.frombuffer(content, one.dtype, len(content) // size)
        values = numbers[places[:, None] + np.arange(one.width)]
        values.setflags(write=False)
        sound = np.ones(len(starts), bool)
        if one.dtype.kind == "f":
            sound = np.logical_and.reduceat(np.isfinite(values).all(axis=1), bounds[:-1])
        kept = [index for index, fit in zip(group, fits.tolist(), strict=True) if fit]
        for index, (start, end), is_sound in zip(kept, pairwise(bounds.tolist()), sound.tolist(), strict=True):
            if is_sound:
                yield index, values[start:end]
