"""Accessors: typed arrays inside buffers (3.6.2)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.gltf.checks import choice, shown, whole
from pica.scene.gltf.container import Document

MAX_ZERO_BYTES = 1 << 26
"""Accessors without data are zeros; a broken file could ask for any number of them."""

_COMPONENTS = {
    5120: np.dtype("i1"), 5121: np.dtype("u1"), 5122: np.dtype("<i2"),
    5123: np.dtype("<u2"), 5125: np.dtype("<u4"), 5126: np.dtype("<f4"),
}  # fmt: skip
_SHAPES = {
    "SCALAR": (1, 1), "VEC2": (1, 2), "VEC3": (1, 3), "VEC4": (1, 4), "MAT2": (2, 2), "MAT3": (3, 3), "MAT4": (4, 4),
}  # fmt: skip
"""Columns and rows; matrices are stored column by column."""
_INDEX_COMPONENTS = {5121: np.dtype("u1"), 5123: np.dtype("<u2"), 5125: np.dtype("<u4")}


def read_accessor(document: Document, index: object, where: str, types: tuple[str, ...]) -> NDArray[Any]:
    """(count, components) as stored. Raises SceneError unless the accessor's type is one of `types`."""
    accessor = document.item("accessors", index, where)
    name = f"accessors[{index}]"
    dtype = choice(accessor.componentType, f"{name}.componentType", _COMPONENTS)
    shape = choice(accessor.type, f"{name}.type", _SHAPES)
    if accessor.type not in types:
        raise SceneError(f"{name}: {where} must be {' or '.join(types)}, not {accessor.type}")
    count = whole(accessor.count, f"{name}.count", low=1)
    offset = whole(accessor.byteOffset, f"{name}.byteOffset", default=0)
    if accessor.bufferView is not None:
        values = _elements(document, accessor.bufferView, offset, count, shape, dtype, name)
    elif count * shape[0] * shape[1] * dtype.itemsize > MAX_ZERO_BYTES:
        raise SceneError(f"{name}: {count} elements without a buffer view are too many")
    else:
        values = np.zeros((count, shape[0] * shape[1]), dtype)
    return values if accessor.sparse is None else _with_sparse(document, accessor.sparse, values, shape, name)


def read_floats(document: Document, index: object, where: str, types: tuple[str, ...]) -> NDArray[np.float32]:
    """(count, components) as numbers: normalized integers become 0 to 1 or -1 to 1. Raises SceneError unless finite."""
    values = read_accessor(document, index, where, types)
    if values.dtype.kind != "f" and document.item("accessors", index, where).normalized:
        # 3.11, decoding normalized integers: c / 255, max(c / 127, -1) and so on
        scaled = values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max)
        return np.maximum(scaled, np.float32(-1))
    floats = values.astype(np.float32)
    if not np.isfinite(floats).all():
        raise SceneError(f"accessors[{index}]: {where} holds numbers that are not finite")
    return floats


def read_indices(document: Document, index: object, where: str, below: int) -> NDArray[np.uint32]:
    """(count,) vertex indices. Raises SceneError for any that is not below `below`."""
    values = read_accessor(document, index, where, ("SCALAR",))[:, 0]
    if values.dtype not in _INDEX_COMPONENTS.values():
        raise SceneError(f"accessors[{index}]: {where} must be unsigned integers")
    if values.max() >= below:
        raise SceneError(f"accessors[{index}]: {where} names vertex {values.max()} of {below}")
    return values.astype(np.uint32)


def _elements(
    document: Document, view: object, offset: int, count: int, shape: tuple[int, int], dtype: np.dtype[Any], name: str
) -> NDArray[Any]:
    """(count, components) out of a buffer view, without a copy where they lie one after the other."""
    content, stride = document.view(view, name)
    columns, rows = shape
    # 3.6.2.4: every column of a matrix starts at a multiple of four bytes
    column_bytes = rows * dtype.itemsize if columns == 1 else -(-rows * dtype.itemsize // 4) * 4
    element_bytes = columns * column_bytes
    stride = stride or element_bytes
    if stride < element_bytes:
        raise SceneError(
            f"{name}: elements of {element_bytes} bytes overlap at bufferViews[{view}].byteStride {stride}"
        )
    end = offset + stride * (count - 1) + element_bytes
    if end > len(content):
        raise SceneError(f"{name}: reaches past its buffer view (byte {end} of {len(content)})")
    strides = (stride, column_bytes, dtype.itemsize)
    values: NDArray[Any] = np.ndarray((count, columns, rows), dtype, content, offset, strides)
    return values.reshape(count, columns * rows)


def _with_sparse(
    document: Document, sparse: Any, values: NDArray[Any], shape: tuple[int, int], name: str
) -> NDArray[Any]:
    """The values with some replaced (3.6.2.3)."""
    count = whole(sparse.count, f"{name}.sparse.count", low=1, high=len(values))
    if sparse.indices is None or sparse.values is None:
        raise SceneError(f"{name}.sparse: lacks its indices or its values")
    index_type = choice(sparse.indices.componentType, f"{name}.sparse.indices.componentType", _INDEX_COMPONENTS)
    rows, replacements = (
        _elements(
            document, part.bufferView, whole(part.byteOffset, f"{name}.sparse.byteOffset", default=0), count,
            part_shape, dtype, f"{name}.sparse",
        )
        for part, part_shape, dtype in ((sparse.indices, (1, 1), index_type), (sparse.values, shape, values.dtype))
    )  # fmt: skip
    if rows.max() >= len(values):
        raise SceneError(f"{name}.sparse: replaces element {shown(int(rows.max()))} of {len(values)}")
    patched = values.copy()
    patched[rows[:, 0]] = replacements
    return patched
