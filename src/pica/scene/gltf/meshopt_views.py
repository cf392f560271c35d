"""Buffer views of EXT_meshopt_compression, and of KHR_meshopt_compression, which adds a filter and a version.

The library decodes in this process: mutated content neither crashed it nor held it up (docs/guide/security.md), and the
file declares how much it writes.
"""

from typing import TYPE_CHECKING

import numpy as np

from pica.scene.gltf.element import Element
from pica.text import first_line

if TYPE_CHECKING:
    from pica.scene.gltf.container import Document

EXTENSIONS = ("KHR_meshopt_compression", "EXT_meshopt_compression")

_NO_FILTER = "NONE"
_MODES = {"ATTRIBUTES": range(4, 257, 4), "TRIANGLES": range(2, 5, 2), "INDICES": range(2, 5, 2)}
"""Each with the strides that it can have."""
_FILTERS = {
    _NO_FILTER: range(2, 257, 2), "OCTAHEDRAL": range(4, 9, 4), "QUATERNION": range(8, 9),
    "EXPONENTIAL": range(4, 257, 4), "COLOR": range(4, 9, 4),
}  # fmt: skip
_LONGEST = 200
"""Characters of the library's message."""


class CompressedBytes(Element):
    """The extension of a buffer view, which stands in the place of its buffer."""

    __slots__ = ()


def redirected(view: Element) -> Element:
    """The buffer view as one of a buffer that is decoded at first use, if it is compressed; otherwise itself.

    Its own buffer, with the same content for readers without the extension, is never read.
    """
    extensions = view.values.get("extensions")
    if type(extensions) is dict:
        for name in EXTENSIONS:
            if type(extensions.get(name)) is dict:
                compressed = CompressedBytes(extensions[name], name, view.object("extensions"))
                return view.replaced(buffer=compressed, byteOffset=0)
    return view


def decompressed(document: "Document", source: CompressedBytes) -> memoryview:
    """The bytes that a buffer view holds. Raises SceneError."""
    import meshopt

    mode, name = source.text("mode"), source.text("filter", default=_NO_FILTER)
    strides, filtered = source.choice("mode", _MODES), source.choice("filter", _FILTERS, default=_FILTERS[_NO_FILTER])
    count, stride = source.integer("count", low=1), source.integer("byteStride", low=1)
    if stride not in strides or stride not in filtered or (mode != "ATTRIBUTES" and name != _NO_FILTER):
        raise source.fault(f"{mode} with the filter {name} cannot have a stride of {stride}", "byteStride")
    if mode == "TRIANGLES" and count % 3:
        raise source.fault(f"{count} indices are no triangles", "count")
    content = document.part(source)
    document.take(source, bytes=count * stride)
    try:
        rows = meshopt.decode_gltf_buffer(content, count, stride, mode, name)
    except (ValueError, RuntimeError) as error:
        raise source.fault(f"cannot be decoded ({first_line(error)[:_LONGEST]})") from None
    document.budget.decompressed(count * stride)
    return memoryview(rows.reshape(-1).view(np.uint8).data)
