"""Accessors: typed arrays inside buffers (3.6.2)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.gltf.accessor_table import COMPONENTS, DenseAccessor
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.values import LARGEST

_SHAPES = {
    "SCALAR": (1, 1), "VEC2": (1, 2), "VEC3": (1, 3), "VEC4": (1, 4), "MAT2": (2, 2), "MAT3": (3, 3), "MAT4": (4, 4),
}  # fmt: skip
"""Columns and rows; matrices are stored column by column."""
_INDEX_COMPONENTS: dict[int, np.dtype[Any]] = {5121: np.dtype("u1"), 5123: np.dtype("<u2"), 5125: np.dtype("<u4")}

_COPIES = 8
"""Bytes that a component counts as: it is read, and becomes a 32-bit number."""

Rows = NDArray[np.intp]
"""(n,) which elements to read."""


def element_count(document: Document, source: Element, key: str) -> int:
    """How many elements the accessor has that `source` refers to under `key`."""
    dense = document.dense_accessors.get(source.values.get(key))
    if dense is not None:
        return dense.elements
    return _accessor(document, source, key).integer("count", low=1)


def read_accessor(
    document: Document, source: Element, key: str, types: tuple[str, ...], subset: Rows | None = None
) -> NDArray[Any]:
    """(count, components) as stored, of the accessor that `source` refers to under `key`; only `subset` rows if given.

    The budget counts the rows that are read. Raises SceneError unless the accessor's type is one of `types`.
    """
    index: Any = source.values.get(key)
    dense = document.dense_accessors.get(index)
    if dense is not None and dense.kind in types:
        array = document.small_accessors.get(index)
        if array is None:
            array = _dense(document, dense)
        if array is not None:
            rows = dense.elements if subset is None else len(subset)
            document.take(document.entries("accessors")[index], bytes=rows * dense.width * _COPIES)
            return array if subset is None else array[subset]
    accessor = _accessor(document, source, key)
    dtype = accessor.choice("componentType", COMPONENTS)
    kind, shape = accessor.text("type"), accessor.choice("type", _SHAPES)
    if kind not in types:
        raise source.fault(f"must be {' or '.join(types)}, not {kind} ({accessor.place()})", key)
    count, width = accessor.integer("count", low=1), shape[0] * shape[1]
    rows = count if subset is None else len(subset)
    sparse = "sparse" in accessor
    document.take(accessor, bytes=(rows + count * sparse) * width * _COPIES)
    if accessor in document.decoded:
        values = document.decoded[accessor]
    elif "bufferView" in accessor:
        values = _elements(document, accessor, count, shape, dtype)
    else:
        values = np.zeros((count if sparse else rows, width), dtype)
        subset = subset if sparse else None
    if sparse:
        values = _with_sparse(document, accessor.object("sparse"), values, shape)
    return values if subset is None else values[subset]


def read_floats(
    document: Document, source: Element, key: str, types: tuple[str, ...], subset: Rows | None = None
) -> NDArray[np.float32]:
    """(count, components) as numbers: normalized integers become 0 to 1 or -1 to 1; only `subset` rows if given.

    Raises SceneError unless they are finite.
    """
    values = read_accessor(document, source, key, types, subset)
    if values.dtype == np.float32 and document.small_accessors.get(source.values[key]) is not None:
        return values
    if values.dtype.kind != "f" and _accessor(document, source, key).flag("normalized", default=False):
        # 3.11, decoding normalized integers: c / 255, max(c / 127, -1) and so on
        scaled = values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max)
        return np.maximum(scaled, np.float32(-1))
    floats = values.astype(np.float32, copy=subset is None)  # a subset is a copy already
    # A finite sum of squares proves that all values are valid; otherwise they are searched.
    if not np.vdot(floats, floats) <= LARGEST and not np.isfinite(floats).all():
        raise source.fault(f"holds numbers that are not finite ({_accessor(document, source, key).place()})", key)
    return floats


def read_matrices(document: Document, source: Element, key: str) -> NDArray[np.float64]:
    """(count, 4, 4) of an accessor of matrices, which files have column by column."""
    return read_floats(document, source, key, ("MAT4",)).reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)


def read_indices(document: Document, source: Element, key: str, below: int) -> NDArray[np.uint32]:
    """(count,) vertex indices. Raises SceneError for any that is not below `below`."""
    values = read_accessor(document, source, key, ("SCALAR",))[:, 0]
    if values.dtype.kind != "u":
        raise source.fault(f"must be unsigned integers ({_accessor(document, source, key).place()})", key)
    most = np.maximum.reduce(values)  # twice as fast as values.max()
    if most >= below:
        raise source.fault(f"names vertex {most} of {below} ({_accessor(document, source, key).place()})", key)
    return values.astype(np.uint32)


def _accessor(document: Document, source: Element, key: str) -> Element:
    return source.reference(key, document.entries("accessors"))


def _dense(document: Document, accessor: DenseAccessor) -> NDArray[Any] | None:
    """(count, components) without a copy; None if its buffer is not as declared."""
    buffers = document.entries("buffers")
    if accessor.buffer >= len(buffers):
        return None
    content = document.buffer(buffers[accessor.buffer])
    if accessor.view_end > len(content):
        return None
    shape, strides = (accessor.elements, accessor.width), (accessor.stride, accessor.dtype.itemsize)
    return np.ndarray(shape, accessor.dtype, content, accessor.start, strides)


def _elements(
    document: Document, source: Element, count: int, shape: tuple[int, int], dtype: np.dtype[Any]
) -> NDArray[Any]:
    """(count, components) from the buffer view of `source`, without a copy if they are contiguous."""
    content, stride = document.view(source)
    offset = source.integer("byteOffset", default=0)
    columns, rows = shape
    # 3.6.2.4: every column of a matrix starts at a multiple of four bytes
    column_bytes = rows * dtype.itemsize if columns == 1 else -(-rows * dtype.itemsize // 4) * 4
    element_bytes = columns * column_bytes
    stride = stride or element_bytes
    if stride < element_bytes:
        raise source.fault(f"elements of {element_bytes} bytes overlap at a byteStride of {stride}", "bufferView")
    end = offset + stride * (count - 1) + element_bytes
    if end > len(content):
        raise source.fault(f"reaches past its buffer view (byte {end} of {len(content)})")
    strides = (stride, column_bytes, dtype.itemsize)
    values: NDArray[Any] = np.ndarray((count, columns, rows), dtype, content, offset, strides)
    return values.reshape(count, columns * rows)


def _with_sparse(
    document: Document, sparse: Element, values: NDArray[Any], shape: tuple[int, int]
) -> NDArray[Any]:  # fmt: skip
    """The values with some replaced (3.6.2.3)."""
    count = sparse.integer("count", low=1, high=len(values))
    document.take(sparse, bytes=count * (values.shape[1] + 1) * _COPIES)
    indices = sparse.object("indices", required=True)
    rows = _elements(document, indices, count, (1, 1), indices.choice("componentType", _INDEX_COMPONENTS))
    replacements = _elements(document, sparse.object("values", required=True), count, shape, values.dtype)
    if rows.max() >= len(values):
        raise indices.fault(f"replaces element {rows.max()} of {len(values)}")
    patched = values.copy()
    patched[rows[:, 0]] = replacements
    return patched
