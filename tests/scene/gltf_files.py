"""Small glTF files for the tests, put together in memory."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

COMPONENT_TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


class GltfFile:
    """The JSON of a file and its one buffer, in the making."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}}
        self.buffer = bytearray()
        self.more_buffers: list[dict[str, Any]] = []
        """Those after the one that is embedded."""

    def add(self, array: str, **entry: Any) -> int:
        """Append to one of the file's arrays and return the index."""
        self.json.setdefault(array, []).append(entry)
        return len(self.json[array]) - 1

    def view(self, content: bytes, **entry: Any) -> int:
        """A buffer view with the given content."""
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        offset = len(self.buffer)
        self.buffer += content
        return self.add("bufferViews", buffer=0, byteOffset=offset, byteLength=len(content), **entry)

    def accessor(self, values: ArrayLike, dtype: str = "f4", **entry: Any) -> int:
        """A tightly packed accessor, (count, components) or (count,)."""
        array = np.asarray(values, np.dtype(dtype).newbyteorder("<"))
        components = 1 if array.ndim == 1 else array.shape[1]
        fields = {
            "bufferView": self.view(array.tobytes()),
            "componentType": COMPONENT_TYPES[dtype],
            "count": len(array),
            "type": TYPES[components],
        }
        return self.add("accessors", **(fields | entry))

    def mesh(self, positions: int | None = None, node: dict[str, Any] | None = None, **primitive: Any) -> int:
        """A mesh of one primitive (a single triangle by default) and the node that shows it; returns the node."""
        attributes = {"POSITION": self.accessor(TRIANGLE) if positions is None else positions}
        attributes |= primitive.pop("attributes", {})
        mesh = self.add("meshes", primitives=[{"attributes": attributes, **primitive}])
        return self.add("nodes", mesh=mesh, **(node or {}))

    def write(self, folder: Path, name: str = "model.gltf") -> Path:
        """Write the file with its buffer embedded."""
        path = folder / name
        if name.endswith(".glb"):
            path.write_bytes(self.binary())
            return path
        document = dict(self.json)
        if self.buffer:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.buffer).decode()
            document.setdefault("buffers", [{"uri": uri, "byteLength": len(self.buffer)}, *self.more_buffers])
        path.write_text(json.dumps(document))
        return path

    def binary(self) -> bytes:
        """The file as .glb."""
        buffers = [{"byteLength": len(self.buffer)}, *self.more_buffers]
        document = json.dumps(self.json | {"buffers": buffers}).encode()
        chunks = b""
        for kind, content, filler in ((b"JSON", document, b" "), (b"BIN\0", bytes(self.buffer), b"\0")):
            content += filler * (-len(content) % 4)
            chunks += len(content).to_bytes(4, "little") + kind + content
        return b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks


def rotation_y(angle: float) -> NDArray[np.float64]:
    """(3, 3) right-handed rotation about +Y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
