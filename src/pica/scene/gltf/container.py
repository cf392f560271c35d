"""The file itself: its JSON, and the bytes of its buffers and images."""

import base64
import binascii
import json
import warnings
from contextlib import ExitStack
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

from numpy.typing import NDArray

from pica.errors import SceneError, shown
from pica.scene.conversion.formats import SUFFIXES
from pica.scene.gltf.accessor_table import AccessorTable
from pica.scene.gltf.asset_files import AssetFiles
from pica.scene.gltf.draco import DracoDecoder
from pica.scene.gltf.element import Element
from pica.scene.gltf.meshopt_views import CompressedBytes, decompressed, redirected
from pica.scene.gltf.pointers import animated
from pica.scene.gltf.prefetch import SmallAccessors
from pica.scene.limits import Budget
from pica.text import printable

_GLB_MAGIC = b"glTF"
_GLB_HEADER_BYTES, _CHUNK_HEADER_BYTES = 12, 8
_MOST_WARNINGS = 20
_NO_GLTF = f"of no format that is read ({', '.join(SUFFIXES)}); convert it, in Blender for one; it is no JSON"

_JSON_BYTES = {b"{": 256, b"[": 72, b",": 32, b'"': 20}
"""Bytes of parsed JSON per character of objects, arrays, further values and strings;
about as measured with CPython 3.11, including an Element for each object."""


class Document:
    """An open glTF file. Its arrays and buffers are read at first use.

    The budget counts them and all that is made from them. `allow_outside`: whether it may name files
    outside its folder. `content`: that of a .glb, instead of the file's. To be closed with `with`, which ends what
    decodes parts of it.
    """

    def __init__(
        self,
        path: Path,
        budget: Budget | None = None,
        allow_outside: bool = False,
        variant: str | None = None,
        content: bytes | None = None,
    ) -> None:
        self._path = path
        self.variant = variant
        """The name of the one of KHR_materials_variants that is shown."""
        self.budget = Budget() if budget is None else budget
        self._files = AssetFiles(path, self.budget, allow_outside)
        content = self._files.read_asset() if content is None else content
        self._binary_chunk: memoryview | None = None
        if content.startswith(_GLB_MAGIC):
            text, self._binary_chunk = _chunks(content)
            self.root = Element(self._parse(text, "its first chunk is not JSON"))
        else:
            self.root = Element(self._parse(content, _NO_GLTF if self._is_foreign else "neither binary glTF nor JSON"))
        """The file's whole JSON."""
        self._arrays: dict[str, list[Element]] = {}
        self._buffers: dict[Element, memoryview] = {}
        self.decoded: dict[Element, NDArray[Any]] = {}
        """Content, (count, components), of accessors that are not in a buffer."""
        self.draco = DracoDecoder()
        self.closing = ExitStack()
        """What is to end with the load."""
        self.closing.callback(self.draco.close)
        self._warned: set[str] = set()
        _check_version(self.root.object("asset"))

    def __enter__(self) -> "Document":
        return self

    def __exit__(self, *_: object) -> None:
        self.closing.close()

    @property
    def suffix(self) -> str:
        """That of the file's name, without its dot."""
        return self._path.suffix.removeprefix(".")

    @property
    def _is_foreign(self) -> bool:
        """Whether its suffix is that of another format, such as .obj."""
        return self._path.suffix.lower() not in (".gltf", ".glb", ".json", "")

    def take(self, source: Element, key: str = "", **amounts: int) -> None:
        """Count amounts by the names of Limits, before they are allocated. Raises SceneError."""
        try:
            self.budget.take(**amounts)
        except SceneError as error:
            raise source.fault(str(error), key) from None

    def warn(self, text: str) -> None:
        """Warn once, naming the file; after twenty warnings no more."""
        if text not in self._warned and len(self._warned) <= _MOST_WARNINGS:
            self._warned.add(text)
            if len(self._warned) > _MOST_WARNINGS:
                text = "there is more that is not as it should be; further warnings are left out"
            warnings.warn(f"{printable(self._path)}: {text}", stacklevel=2)

    def entries(self, array: str) -> list[Element]:
        """One of the file's arrays, such as "accessors"; the same elements each time, so that they can be keys."""
        if array not in self._arrays:
            objects = self.root.objects(array)
            self._arrays[array] = [redirected(view) for view in objects] if array == "bufferViews" else objects
        return self._arrays[array]

    @cached_property
    def dense_accessors(self) -> AccessorTable:
        """The accessors that can be read together."""
        try:
            views = self.entries("bufferViews")
        except SceneError:  # raised by the reader of the accessor
            views = []
        return AccessorTable(self.entries("accessors"), views)

    @cached_property
    def small_accessors(self) -> SmallAccessors:
        """The accessors that have been read together."""
        return SmallAccessors(self)

    @cached_property
    def animated_pointers(self) -> list[str]:
        """What animations set by KHR_animation_pointer."""
        return animated(self.root.values)

    def view(self, source: Element, key: str = "bufferView") -> tuple[memoryview, int | None]:
        """The bytes of the buffer view that `source` refers to, and its stride if there is one (3.6.1)."""
        view = source.reference(key, self.entries("bufferViews"))
        content = self.part(view)
        stride = view.integer("byteStride", low=1, high=252) if "byteStride" in view else None
        return content, stride

    def part(self, view: Element) -> memoryview:
        """The bytes from byteOffset of the buffer that a buffer view, or an object with the same keys, refers to."""
        content = self.buffer(view.reference("buffer", self.entries("buffers")))
        offset = view.integer("byteOffset", default=0)
        length = view.integer("byteLength", low=1)
        if offset + length > len(content):
            raise view.fault(f"reaches past its buffer (bytes {offset} to {offset + length} of {len(content)})")
        return content[offset : offset + length]

    def resource(self, source: Element, length: int = -1) -> bytes:
        """The first `length` bytes, all by default, of the uri of `source`: embedded data, or a file (2.8).

        No other file is opened.
        """
        uri = source.text("uri")
        if uri.startswith("data:"):
            self.take(source, "uri", bytes=2 * len(uri))
            return _data(uri, source)
        return self._files.read(uri, source.place("uri"), length)

    def buffer(self, buffer: Element) -> memoryview:
        """The content of a buffer."""
        if buffer not in self._buffers and isinstance(buffer, CompressedBytes):
            self._buffers[buffer] = decompressed(self, buffer)
        if buffer not in self._buffers:
            length = buffer.integer("byteLength", low=1)
            if "uri" in buffer:
                content = memoryview(self.resource(buffer, length))
            elif buffer is self.entries("buffers")[0] and self._binary_chunk is not None:
                content = self._binary_chunk
            else:
                raise buffer.fault("has neither a uri nor a binary chunk")
            if len(content) < length:
                raise buffer.fault(f"holds {len(content)} bytes where byteLength says {length}")
            self._buffers[buffer] = content[:length]
        return self._buffers[buffer]

    def _parse(self, content: bytes, otherwise: str) -> dict[str, Any]:
        """The parsed JSON object. Raises SceneError, with the text `otherwise` if it is no JSON."""
        taken = len(content) * (1 if content.isascii() else 4)  # as text, with bytes enough for its widest character
        taken += sum(content.count(sign) * size for sign, size in _JSON_BYTES.items())
        try:
            self.budget.take(bytes=taken)
        except SceneError as error:
            raise SceneError(f"its JSON: {error}") from None
        try:
            root = json.loads(content.decode("utf-8-sig"))
        except UnicodeDecodeError:
            raise SceneError(f"{otherwise} text") from None
        except RecursionError:
            raise SceneError("its JSON is nested too deeply") from None
        except ValueError as error:  # JSONDecodeError, and errors for integers of thousands of digits
            raise SceneError(f"{otherwise} ({error})") from None
        if not isinstance(root, dict):
            raise SceneError(f"its JSON is not an object but {shown(root)}")
        return root


def _chunks(content: bytes) -> tuple[bytes, memoryview | None]:
    """The JSON of a .glb, and its binary chunk if it has one (4.4)."""
    version, length = _integers(content, at=4)
    if len(content) < max(length, _GLB_HEADER_BYTES + _CHUNK_HEADER_BYTES):
        raise SceneError(f"truncated at {len(content)} bytes")
    if version != 2:
        raise SceneError(f"binary glTF of version {version}; only 2 can be read")
    content = content[:length]
    kind, text, end = _chunk(content, _GLB_HEADER_BYTES)
    if kind != b"JSON":
        raise SceneError("binary glTF that does not begin with a JSON chunk")
    if end + _CHUNK_HEADER_BYTES > len(content):
        return bytes(text), None
    kind, binary, _ = _chunk(content, end)
    return bytes(text), binary if kind == b"BIN\0" else None


def _chunk(content: bytes, at: int) -> tuple[bytes, memoryview, int]:
    """Kind and bytes of a chunk, and where the next one begins."""
    (length,) = _integers(content, at, count=1)
    start = at + _CHUNK_HEADER_BYTES
    if start + length > len(content):
        raise SceneError(f"truncated at {len(content)} bytes")
    return content[at + 4 : start], memoryview(content)[start : start + length], start + length


def _integers(content: bytes, at: int, count: int = 2) -> list[int]:
    return [int.from_bytes(content[i : i + 4], "little") for i in range(at, at + 4 * count, 4)]


def _check_version(asset: Element) -> None:
    version, least = asset.text("version"), asset.text("minVersion", default="2.0")
    if not version.startswith("2."):
        raise asset.fault(f"{shown(version)} is not glTF 2", "version")
    if least != "2.0":
        raise asset.fault(f"{shown(least)} is newer than 2.0, which is what can be read", "minVersion")


def _data(uri: str, source: Element) -> bytes:
    header, _, body = uri.partition(",")
    content = unquote_to_bytes(body.encode("utf-8", "replace"))
    if not header.endswith(";base64"):
        return content
    try:
        return base64.b64decode(content, validate=True)
    except binascii.Error as error:
        raise source.fault(f"broken base64 ({error})", "uri") from None
