"""The file in the making: its JSON, its binary content, and files beside it."""

import json
from collections import Counter
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError, plain
from pica.images.saving import write_whole
from pica.scene.gltf.accessor_table import COMPONENTS, WIDTHS
from pica.text import printable

_NUMBERS = {dtype: number for number, dtype in COMPONENTS.items()}
_KINDS = {width: kind for kind, width in WIDTHS.items()} | {16: "MAT4"}
_XMP = "KHR_xmp_json_ld"
_LARGEST_BINARY = (1 << 32) - 1
"""Bytes of a .glb, which has their number in 32 bits (4.4.2)."""
VERTICES, INDICES = 34962, 34963
"""What buffer views are for (5.11.5)."""


class Asset:
    """What has been added so far; equal arrays are stored once. `write` ends it."""

    def __init__(self, path: Path, generator: str = "pica") -> None:
        self._path = path
        self.is_binary = path.suffix.lower() == ".glb"
        self._root: dict[str, Any] = {"asset": {"version": "2.0", "generator": generator}, "scene": 0}
        self._binary = bytearray()
        self._files: dict[str, bytes] = {}
        self._accessors: dict[tuple[Any, ...], int] = {}
        self._entries: dict[tuple[str, str, object], int] = {}
        self._used: set[str] = set()
        self._left_out: Counter[str] = Counter()

    def describe(self, copyright: str = "", generator: str = "", xmp: Mapping[str, Any] | None = None) -> None:
        """What the file says of itself (3.2), and its XMP metadata (KHR_xmp_json_ld)."""
        about = {"copyright": copyright, "generator": generator}
        self._root["asset"] |= {key: value for key, value in about.items() if value}
        packet = self.extras(dict(xmp or {}), {})
        if packet:
            place = self.add_once("packets", packet, extension=_XMP)
            self._root["asset"]["extensions"] = self.extensions(**{_XMP: {"packet": place}})

    def leave_out(self, what: str, count: int = 1) -> None:
        """Count content of a kind that cannot be saved."""
        self._left_out[what] += count

    def left_out(self) -> list[str]:
        """A line for each kind of content that is not in the file."""
        return [f"left out {what} ({count:,}), for which glTF has no place" for what, count in self._left_out.items()]

    def add(self, array: str, entry: dict[str, Any]) -> int:
        """Append to one of the file's arrays, without keys that are empty, and return the index."""
        return _append(self._root.setdefault(array, []), entry)

    def add_once(self, array: str, entry: dict[str, Any], extension: str = "", owner: object = None) -> int:
        """As `add`, or the index of an equal entry of the same owner; in an array of an extension of the file."""
        key = array, _encoded(entry), owner
        if key not in self._entries:
            entries = self._root.setdefault(array, []) if not extension else self._extension(extension, array)
            self._entries[key] = _append(entries, entry)
        return self._entries[key]

    def entry(self, array: str, index: int) -> dict[str, Any]:
        """An entry that was added."""
        found: dict[str, Any] = self._root[array][index]
        return found

    def extensions(self, **values: dict[str, Any] | None) -> dict[str, Any]:
        """The `extensions` of an object: those that are not None, which are used from now on."""
        given = {name: value for name, value in values.items() if value is not None}
        self._used |= given.keys()
        return given

    def extras(self, given: dict[str, Any], pica: dict[str, Any]) -> dict[str, Any]:
        """The `extras` of an object: the user's, as far as JSON can hold them, and what pica keeps there."""
        kept = {}
        for key, value in given.items():
            if key == "pica":  # as it was loaded: the fields have it
                continue
            try:
                kept[key] = json.loads(_encoded(plain(value)))
            except (TypeError, ValueError, RecursionError):
                self.leave_out("extras that JSON cannot hold")
        own = {key: value for key, value in pica.items() if value is not None}
        return kept | ({"pica": own} if own else {})

    def view(self, content: bytes, **entry: Any) -> int:
        """A buffer view of the content."""
        self._binary += b"\0" * (-len(self._binary) % 4)
        offset = len(self._binary)
        self._binary += content
        return self.add("bufferViews", {"buffer": 0, "byteOffset": offset, "byteLength": len(content)} | entry)

    def accessor(self, array: NDArray[Any], target: int | None = None, bounded: bool = False) -> int:
        """An accessor of (count,) or (count, components), or of matrices (count, 4, 4); `bounded`: with its range.

        Floats are stored with 32 bits, integers as they are.
        """
        if array.dtype.kind == "f":
            array = array.astype("<f4", copy=False)
        array = array.transpose(0, 2, 1) if array.ndim == 3 else array  # matrices are stored column by column
        rows = np.ascontiguousarray(array.reshape(len(array), -1))
        content = rows.tobytes()
        key = sha256(content).digest(), rows.dtype, rows.shape, target, bounded
        if key not in self._accessors:
            entry: dict[str, Any] = {
                "bufferView": self.view(content, **({} if target is None else {"target": target})),
                "componentType": _NUMBERS[rows.dtype],
                "count": len(rows),
                "type": _KINDS[rows.shape[1]],
            }
            if bounded:
                entry |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
            self._accessors[key] = self.add("accessors", entry)
        return self._accessors[key]

    def picture(self, png: bytes) -> tuple[dict[str, Any], str]:
        """The keys of an image that say where its picture is, and the name that the loader gives it otherwise."""
        if self.is_binary:
            return {"bufferView": self.view(png), "mimeType": "image/png"}, ""
        name = f"{self._path.stem}-{len(self._files)}"
        self._files[f"{name}.png"] = png
        return {"uri": quote(f"{name}.png")}, name

    def content(self) -> bytes:
        """The file itself, without those that it refers to."""
        root = self._root | ({"extensionsUsed": sorted(self._used)} if self._used else {})
        if self._binary:
            own = {} if self.is_binary else {"uri": quote(f"{self._path.stem}.bin")}
            root["buffers"] = [{"byteLength": len(self._binary)} | own]
        text = _encoded(root).encode()
        return self._in_chunks(text) if self.is_binary else text

    def write(self) -> None:
        """Write the file, after those that it refers to. Raises PicaError."""
        content = self.content()
        if self._binary and not self.is_binary:
            self._files[f"{self._path.stem}.bin"] = bytes(self._binary)
        for name, other in self._files.items():
            _write(self._path.with_name(name), other)
        _write(self._path, content)

    def _in_chunks(self, text: bytes) -> bytes:
        """The content of a .glb (4.4)."""
        chunks = [(b"JSON", text + b" " * (-len(text) % 4))]
        if self._binary:
            chunks.append((b"BIN\0", bytes(self._binary) + b"\0" * (-len(self._binary) % 4)))
        size = 12 + sum(8 + len(content) for _, content in chunks)
        if size > _LARGEST_BINARY:
            raise SceneError(f"{printable(self._path)}: {size:,} bytes are too many for a .glb; save as .gltf")
        parts = [b"glTF", _number(2), _number(size)]
        for kind, content in chunks:
            parts += [_number(len(content)), kind, content]
        return b"".join(parts)

    def _extension(self, extension: str, array: str) -> list[dict[str, Any]]:
        entries: list[dict[str, Any]] = (
            self._root.setdefault("extensions", {}).setdefault(extension, {}).setdefault(array, [])
        )
        return entries


def differing(**values: tuple[Any, Any]) -> dict[str, Any]:
    """Of pairs of a value and its default, the values that are not the default."""
    return {key: value for key, (value, default) in values.items() if value != default}


def _append(entries: list[dict[str, Any]], entry: dict[str, Any]) -> int:
    entries.append({key: value for key, value in entry.items() if value not in (None, "", {}, [])})
    return len(entries) - 1


def _encoded(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _number(value: int) -> bytes:
    return value.to_bytes(4, "little")


def _write(path: Path, content: bytes) -> None:
    write_whole(path, lambda temporary: temporary.write_bytes(content))
