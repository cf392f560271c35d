"""KHR_draco_mesh_compression: primitives whose indices and attributes are compressed together.

The library runs in a process of its own with limits on time and memory, since forged content of a kilobyte makes it
run for minutes or take gigabytes (docs/guide/security.md).
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.gltf.accessor_table import COMPONENTS, WIDTHS
from pica.scene.gltf.draco_worker import LENGTH_BYTES
from pica.scene.gltf.element import Element

if TYPE_CHECKING:
    from pica.scene.gltf.container import Document

WORKER = Path(__file__).with_name("draco_worker.py")
EXTENSION = "KHR_draco_mesh_compression"

_TRIANGLES = 4
_READ = ("POSITION", "NORMAL", "TANGENT", "TEXCOORD_", "COLOR_0", "JOINTS_", "WEIGHTS_")
"""How the names of attributes begin that are decoded."""
_MEMORY_FACTOR = 10
"""Memory for decoding as a multiple of its result; seven times was measured, of triangles without shared vertices."""
_FREE_MEMORY = 1 << 27
"""Bytes that any decoding may take besides."""
_FREE_SECONDS, _BYTE_SECONDS = 2.0, 2e-5
"""Processor time for decoding all of a file, and per compressed byte: 200 times what was measured."""
_LEAST_SECONDS = 0.01
_LONGEST_REPLY = 1 << 16
"""Bytes of the JSON of a reply."""


class _Wanted(NamedTuple):
    """An attribute of the primitive."""

    name: str
    number: int
    """In the compressed data."""
    accessor: Element
    width: int
    dtype: np.dtype[Any]


def decoded(document: "Document", primitive: Element) -> Element:
    """The primitive with accessors that hold its decoded content; itself if it is not compressed. Raises SceneError."""
    if not primitive.has_extension(EXTENSION):
        return primitive
    extension = primitive.extension(EXTENSION)
    if primitive.integer("mode", default=_TRIANGLES) != _TRIANGLES:
        raise primitive.fault("only triangles can be decoded", "mode")
    accessors = document.entries("accessors")
    indices = primitive.reference("indices", accessors)
    wanted = list(_wanted(document, primitive, extension))
    corners = indices.integer("count", low=1)
    vertices = max((attribute.accessor.integer("count", low=1) for attribute in wanted), default=0)
    if not wanted:
        raise extension.fault("has no attribute that is read", "attributes")
    size = 4 * corners + vertices * sum(attribute.width * attribute.dtype.itemsize for attribute in wanted)
    document.take(extension, bytes=(1 + _MEMORY_FACTOR) * size)
    content = document.view(extension)[0]
    request = {
        "bytes": len(content),
        "corners": corners,
        "vertices": vertices,
        "attributes": [(attribute.number, attribute.width, attribute.dtype.str) for attribute in wanted],
        "memory": _FREE_MEMORY + _MEMORY_FACTOR * size,
    }
    order, *values = extension.apply(document.draco.decode, request, content)
    document.budget.decompressed(order.nbytes + sum(array.nbytes for array in values))
    attributes = dict(primitive.object("attributes").values)
    for attribute, array in zip(wanted, values, strict=True):
        attributes[attribute.name] = _holder(document, attribute.accessor, array)
    return primitive.replaced(attributes=attributes, indices=_holder(document, indices, order[:, None], 5125))


def _wanted(document: "Document", primitive: Element, extension: Element) -> Iterator[_Wanted]:
    numbers, attributes = extension.object("attributes", required=True), primitive.object("attributes")
    for name in numbers.values:
        if name in attributes and name.startswith(_READ):
            accessor = attributes.reference(name, document.entries("accessors"))
            dtype, width = accessor.choice("componentType", COMPONENTS), accessor.choice("type", WIDTHS)
            yield _Wanted(name, numbers.integer(name), accessor, width, dtype)


def _holder(document: "Document", accessor: Element, array: NDArray[Any], component: int | None = None) -> Element:
    """An accessor in the place of one of the file, which several primitives may name, that holds an array."""
    given = accessor.values
    values = {"type": given.get("type"), "normalized": given.get("normalized"), "count": len(array)}
    holder = accessor.with_values(values | {"componentType": component or given.get("componentType")})
    document.decoded[holder] = array
    return holder


class DracoDecoder:
    """The process that decodes, started with the first request."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._seconds = _FREE_SECONDS
        """Processor time that is left."""

    def decode(self, request: dict[str, Any], content: memoryview) -> list[NDArray[Any]]:
        """(corners,) indices and (vertices, width) attributes, which are at most as many as requested.

        `request`: as draco_worker reads it. Raises SceneError.
        """
        process = self._running()
        assert process.stdin is not None
        self._seconds += _BYTE_SECONDS * len(content)
        text = json.dumps(request | {"seconds": self._seconds}).encode()
        try:
            process.stdin.write(len(text).to_bytes(LENGTH_BYTES, "little") + text)
            process.stdin.write(content)
            process.stdin.flush()
            answer = json.loads(self._read(_length(self._read(LENGTH_BYTES))))
        except (BrokenPipeError, EOFError):
            raise SceneError(self._why_it_ended(len(content))) from None
        if "fault" in answer:
            raise SceneError(answer["fault"])
        self._seconds = max(self._seconds - answer["seconds"], _LEAST_SECONDS)
        corners, vertices = answer["corners"], answer["vertices"]
        if not (0 <= corners <= request["corners"] and 0 <= vertices <= request["vertices"]):
            raise SceneError("cannot be decoded (the decoder's counts are not those of the accessors)")
        arrays = [np.frombuffer(self._read(4 * corners), "<u4")]
        for _, width, kind in request["attributes"]:
            dtype = np.dtype(kind)
            arrays.append(np.frombuffer(self._read(vertices * width * dtype.itemsize), dtype).reshape(-1, width))
        return arrays

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _running(self) -> "subprocess.Popen[bytes]":
        if self._process is None:
            try:
                self._process = subprocess.Popen(
                    [sys.executable or "python", "-P", WORKER],  # its folder has modules of common names
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},  # threads would take time and address space
                )
            except OSError as error:
                raise SceneError(f"its decoder cannot be started ({error.strerror})") from None
        return self._process

    def _read(self, length: int) -> bytes:
        assert self._process is not None and self._process.stdout is not None
        content = self._process.stdout.read(length)
        if len(content) < length:
            raise EOFError
        return content

    def _why_it_ended(self, length: int) -> str:
        assert self._process is not None
        code = self._process.wait()
        if hasattr(signal, "SIGPROF") and code == -signal.SIGPROF:
            return f"takes more than {self._seconds:.1f} s to decode, which {length} bytes do not need"
        return f"cannot be decoded (the decoder ended with code {code})"


def _length(head: bytes) -> int:
    length = int.from_bytes(head, "little")
    if length > _LONGEST_REPLY:
        raise EOFError
    return length
