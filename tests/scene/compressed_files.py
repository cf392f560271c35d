"""Compressed meshes for the tests, made from known ones."""

from contextlib import suppress
from typing import Any

import DracoPy
import meshopt
import numpy as np
from numpy.typing import NDArray

from tests.scene.gltf_files import GltfFile

DRACO = "KHR_draco_mesh_compression"


def grid(side: int = 12) -> tuple[dict[str, NDArray[Any]], NDArray[np.uint32]]:
    """Attributes of a curved square of (side, side) vertices, and its (triangles, 3)."""
    u, v = (values.reshape(-1) for values in np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side)))
    normals = np.stack([-np.cos(3 * u), np.sin(2 * v), np.full(side * side, 3.0)], axis=1)
    first = np.arange(side * side).reshape(side, side)
    a, b, c, d = (corner.reshape(-1) for corner in (first[:-1, :-1], first[:-1, 1:], first[1:, :-1], first[1:, 1:]))
    attributes = {
        "POSITION": np.stack([u, v, 0.3 * np.sin(3 * u) * np.cos(2 * v)], axis=1).astype(np.float32),
        "NORMAL": (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32),
        "TEXCOORD_0": np.stack([u, v], axis=1).astype(np.float32),
    }
    return attributes, np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)]).astype(np.uint32)


def plain_file(attributes: dict[str, NDArray[Any]], triangles: NDArray[np.uint32]) -> GltfFile:
    """The mesh without compression."""
    file = GltfFile()
    accessors = {name: file.accessor(values, values.dtype.str[1:]) for name, values in attributes.items()}
    file.mesh(accessors.pop("POSITION"), attributes=accessors, indices=file.accessor(triangles.reshape(-1), "u4"))
    return file


def draco_bytes(attributes: dict[str, NDArray[Any]], triangles: NDArray[np.uint32], **options: Any) -> bytes:
    """The mesh as Draco with 14 bits for positions and lossless others; other attributes have ids from 20."""
    given = {name: attributes[name].astype(np.float64) for name in ("NORMAL", "TEXCOORD_0") if name in attributes}
    others = [name for name in attributes if name not in ("POSITION", "NORMAL", "TEXCOORD_0")]
    settings = {"quantization_bits": 14, "compression_level": 7} | options
    return DracoPy.encode(
        attributes["POSITION"], triangles,
        normals=given.get("NORMAL"), tex_coord=given.get("TEXCOORD_0"),
        generic_attributes={20 + number: attributes[name] for number, name in enumerate(others)} or None,
        **settings,
    )  # fmt: skip


def draco_file(
    attributes: dict[str, NDArray[Any]], triangles: NDArray[np.uint32], content: bytes | None = None, **options: Any
) -> GltfFile:  # fmt: skip
    """The mesh as a primitive of Draco, or with other content."""
    file = GltfFile()
    content = draco_bytes(attributes, triangles, **options) if content is None else content
    count, kinds = len(attributes["POSITION"]), {2: "VEC2", 3: "VEC3", 4: "VEC4"}
    types = {np.dtype("f4"): 5126, np.dtype("u1"): 5121, np.dtype("u2"): 5123}
    accessors = {
        name: file.add("accessors", count=count, type=kinds[values.shape[1]], componentType=types[values.dtype])
        for name, values in attributes.items()
    }
    order = file.add("accessors", count=triangles.size, type="SCALAR", componentType=5125)
    extension = {"bufferView": file.view(content), "attributes": ids_of(content, attributes)}
    file.mesh(accessors.pop("POSITION"), attributes=accessors, indices=order, extensions={DRACO: extension})
    file.json |= {"extensionsUsed": [DRACO], "extensionsRequired": [DRACO]}
    return file


def ids_of(content: bytes, attributes: dict[str, NDArray[Any]]) -> dict[str, int]:
    """The attributes' ids in the compressed data; what cannot be decoded has those that DracoPy gives first."""
    kinds = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 3}
    found = {0: 0, 1: 2, 3: 1}
    with suppress(DracoPy.FileTypeException):
        found |= {entry["attribute_type"]: entry["unique_id"] for entry in DracoPy.decode(content).attributes}
    others = [name for name in attributes if name not in kinds]
    return {name: found[kinds[name]] if name in kinds else 20 + others.index(name) for name in attributes}


def meshopt_view(
    file: GltfFile, values: NDArray[Any], mode: str, filter_name: str | None = None, version: int = 0,
    prefix: str = "EXT",
) -> int:  # fmt: skip
    """A compressed buffer view of rows, whose own buffer has no content."""
    values = np.ascontiguousarray(values)
    rows, stride = len(values), values.nbytes // len(values)
    content = meshopt.encode_gltf_buffer(values, mode, version)
    name = f"{prefix}_meshopt_compression"
    file.view(content)
    extension = file.json["bufferViews"].pop() | {"byteStride": stride, "count": rows, "mode": mode}
    if filter_name is not None:
        extension["filter"] = filter_name
    if not file.more_buffers:
        file.more_buffers = [{"byteLength": 1 << 24, "extensions": {name: {"fallback": True}}}]
    file.json["extensionsUsed"] = file.json["extensionsRequired"] = [name, "KHR_mesh_quantization"]
    return file.add("bufferViews", buffer=1, byteLength=rows * stride, extensions={name: extension})
