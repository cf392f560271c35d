"""Which accessors of a file are as nearly all are, found all at once: large files have hundreds of thousands."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from pica.scene.gltf.columns import integers
from pica.scene.gltf.element import Element

COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("i1"), 5121: np.dtype("u1"), 5122: np.dtype("<i2"),
    5123: np.dtype("<u2"), 5125: np.dtype("<u4"), 5126: np.dtype("<f4"),
}  # fmt: skip
"""By the numbers that files have for them."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
"""Components of the types that are not matrices."""


_SPECIAL = {"sparse", "normalized"}


class DenseAccessor(NamedTuple):
    """An accessor with contiguous or strided elements in a buffer view, dense and not normalized."""

    kind: str
    dtype: np.dtype[Any]
    elements: int
    width: int
    buffer: int
    start: int
    """Of its first element in the buffer."""
    stride: int
    view_end: int
    """Of the buffer view in the buffer, which may be shorter than declared."""


class AccessorTable:
    """The dense accessors of a file. Faults are left to the reader of single accessors."""

    def __init__(self, accessors: Sequence[Element], views: Sequence[Element]) -> None:
        kinds = [entry.values.get("type") for entry in accessors]
        widths = np.array([WIDTHS.get(kind, 0) if type(kind) is str else 0 for kind in kinds], np.int64)
        types = integers(accessors, "componentType")
        sizes = np.zeros(len(accessors), np.int64)
        for component, dtype in COMPONENTS.items():
            sizes[types == component] = dtype.itemsize
        counts, offsets = integers(accessors, "count"), integers(accessors, "byteOffset", 0)
        view_rows = integers(accessors, "bufferView")
        plain = [entry.values.keys().isdisjoint(_SPECIAL) for entry in accessors]
        fits = (widths > 0) & (sizes > 0) & (counts > 0) & (offsets >= 0) & np.array(plain, bool)
        fits &= (view_rows >= 0) & (view_rows < len(views))

        rows = np.where(fits, view_rows, 0)
        buffers, starts, lengths, strides = (
            integers(views, key, default)[rows] if len(views) else np.full(len(rows), -1)
            for key, default in (("buffer", -1), ("byteOffset", 0), ("byteLength", -1), ("byteStride", 0))
        )
        strides = np.where(strides == 0, widths * sizes, strides)
        fits &= (buffers >= 0) & (starts >= 0) & (lengths > 0) & (strides >= widths * sizes) & (strides <= 252)
        # No product is beyond 64 bits: counts are below the length then, and strides are at most 252.
        fits &= counts <= lengths
        fits &= offsets + strides * (np.where(fits, counts, 1) - 1) + widths * sizes <= lengths
        columns = (counts, widths, buffers, starts + offsets, strides, starts + lengths)
        dtypes = [COMPONENTS.get(component) for component in types.tolist()]
        self._found = list(map(DenseAccessor, kinds, dtypes, *(column.tolist() for column in columns)))
        self._fits = fits.tolist()

    def get(self, index: Any) -> DenseAccessor | None:
        """The accessor that a value of the file refers to; None if it is not one of these."""
        return self._found[index] if type(index) is int and 0 <= index < len(self._fits) and self._fits[index] else None
