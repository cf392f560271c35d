"""The file itself: its JSON as objects, and the bytes of its buffers and images."""

import base64
import binascii
import json
import warnings
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import pygltflib

from pica.errors import SceneError
from pica.scene.gltf.checks import listing, shown, whole

_GLB_MAGIC = b"glTF"
_GLB_HEADERS_BYTES = 20
"""The file's header and that of its first chunk."""

_ARRAYS = (
    "accessors", "animations", "buffers", "bufferViews", "cameras", "images", "materials", "meshes", "nodes",
    "samplers", "scenes", "skins", "textures",
)  # fmt: skip


class Document:
    """An open glTF file. Buffers are read when first asked for."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.gltf, self.json = _parse(read_file(path, "the file"))
        self._buffers: dict[int, bytes] = {}
        self._warned: set[str] = set()
        _check_version(self.gltf.asset)

    def warn(self, text: str) -> None:
        """Warn once, naming the file."""
        if text not in self._warned:
            self._warned.add(text)
            warnings.warn(f"{self.path}: {text}", stacklevel=2)

    def item(self, array: str, index: object, where: str) -> Any:
        """Entry `index` of one of the file's arrays, such as "accessors"; `where` is what refers to it."""
        entries = listing(getattr(self.gltf, array), array)
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(entries):
            raise SceneError(f"{where}: {array}[{shown(index)}] does not exist ({len(entries)} in the file)")
        return entries[index]

    def view(self, index: object, where: str) -> tuple[memoryview, int | None]:
        """The bytes of a buffer view, and its stride if it gives one (3.6.1)."""
        view = self.item("bufferViews", index, where)
        name = f"bufferViews[{index}]"
        content = self._buffer(view.buffer, name)
        offset = whole(view.byteOffset, f"{name}.byteOffset", default=0)
        length = whole(view.byteLength, f"{name}.byteLength", low=1)
        if offset + length > len(content):
            raise SceneError(
                f"{name}: reaches past buffers[{view.buffer}] (bytes {offset} to {offset + length} of {len(content)})"
            )
        stride = None if view.byteStride is None else whole(view.byteStride, f"{name}.byteStride", low=1, high=252)
        return memoryview(content)[offset : offset + length], stride

    def resolve(self, uri: object, where: str) -> bytes | Path:
        """The bytes of a data URI, or the path of a file beside this one (2.8)."""
        if not isinstance(uri, str):
            raise SceneError(f"{where}.uri: {shown(uri)} is not text")
        if uri.startswith("data:"):
            return _data_uri(uri, where)
        name = unquote(uri)
        if "://" in name or name.startswith(("/", "file:")) or "\0" in name:
            raise SceneError(f"{where}.uri: {shown(uri)} is not a path relative to the file")
        return self.path.parent / name

    def _buffer(self, index: int, where: str) -> bytes:
        buffer = self.item("buffers", index, where)
        if index not in self._buffers:
            name = f"buffers[{index}]"
            length = whole(buffer.byteLength, f"{name}.byteLength", low=1)
            content = self._buffer_content(buffer.uri, index, length, name)
            if len(content) < length:
                raise SceneError(f"{name}: holds {len(content)} bytes where byteLength says {length}")
            self._buffers[index] = content[:length]
        return self._buffers[index]

    def _buffer_content(self, uri: object, index: int, length: int, name: str) -> bytes:
        if uri is not None:
            source = self.resolve(uri, name)
            return source if isinstance(source, bytes) else read_file(source, f"{name}.uri: {shown(uri)}", length)
        blob: bytes | None = self.gltf.binary_blob()
        if index != 0 or blob is None:
            raise SceneError(f"{name}: has neither a uri nor a binary chunk")
        return blob


def read_file(path: Path, what: str, length: int = -1) -> bytes:
    """The first `length` bytes of a file, all by default. Raises SceneError, which calls it `what`."""
    try:
        if not path.is_file():  # neither folders nor devices that never end
            raise SceneError(f"{what}: no such file" if not path.exists() else f"{what}: not a file")
        with path.open("rb") as file:
            return file.read(min(length, path.stat().st_size))
    except OSError as error:
        raise SceneError(f"{what}: cannot be read ({error.strerror})") from None


def _parse(content: bytes) -> tuple[pygltflib.GLTF2, dict[str, Any]]:
    """The file's JSON as objects, and as it is. pygltflib takes much on trust, so the outline is checked first."""
    binary = content.startswith(_GLB_MAGIC)
    try:
        source = (_json_chunk(content) if binary else content).decode("utf-8-sig")
        root = json.loads(source)
        _check_outline(root)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pygltflib's own, about unknown chunks
            gltf = pygltflib.GLTF2.load_from_bytes(content) if binary else pygltflib.GLTF2.gltf_from_json(source)
            return gltf, root
    except json.JSONDecodeError as error:
        raise SceneError(f"not valid JSON ({error})" if binary else f"neither binary glTF nor JSON ({error})") from None
    except UnicodeDecodeError:
        raise SceneError("neither binary glTF nor JSON text") from None


def _json_chunk(content: bytes) -> bytes:
    """The first chunk of a .glb, after checking the header that precedes it (4.4)."""
    version, length, chunk_length = (int.from_bytes(content[at : at + 4], "little") for at in (4, 8, 12))
    if len(content) < length or len(content) < _GLB_HEADERS_BYTES + chunk_length:
        raise SceneError(f"truncated at {len(content)} bytes")
    if version != 2:
        raise SceneError(f"binary glTF of version {version}; only 2 can be read")
    if length < _GLB_HEADERS_BYTES or content[16:20] != b"JSON":
        raise SceneError("binary glTF that does not begin with a JSON chunk")
    return content[_GLB_HEADERS_BYTES:][:chunk_length]


def _check_outline(root: object) -> None:
    """The root is an object and its arrays hold objects (5.17)."""
    if not isinstance(root, dict):
        raise SceneError(f"its JSON is not an object but {shown(root)}")
    if not isinstance(root.get("asset"), dict) or "version" not in root["asset"]:
        raise SceneError("asset.version is missing")
    for array in _ARRAYS:
        for index, entry in enumerate(listing(root.get(array), array)):
            if not isinstance(entry, dict):
                raise SceneError(f"{array}[{index}]: {shown(entry)} is not an object")


def _check_version(asset: pygltflib.Asset) -> None:
    if not isinstance(asset.version, str) or not asset.version.startswith("2."):
        raise SceneError(f"asset.version: {shown(asset.version)} is not glTF 2")
    if asset.minVersion not in (None, "2.0"):
        raise SceneError(f"asset.minVersion: {shown(asset.minVersion)} is newer than 2.0, which is what can be read")


def _data_uri(uri: str, where: str) -> bytes:
    header, _, body = uri.partition(",")
    content = unquote_to_bytes(body)
    if not header.endswith(";base64"):
        return content
    try:
        return base64.b64decode(content, validate=True)
    except binascii.Error as error:
        raise SceneError(f"{where}.uri: broken base64 ({error})") from None
