"""EXT_meshopt_compression and KHR_meshopt_compression: every mode and filter, and what does not fit."""

from pathlib import Path
from typing import Any

import meshopt
import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.gltf import read
from pica.scene.gltf.accessors import read_accessor, read_floats
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.limits import Budget, Limits
from pica.scene.loading import load
from tests.assets import ASSETS, needs_assets
from tests.scene.compressed_files import grid, meshopt_view
from tests.scene.gltf_files import GltfFile

ROWS = np.random.default_rng(5).normal(size=(40, 4)).astype(np.float32)
UNIT = ROWS / np.linalg.norm(ROWS, axis=1, keepdims=True)
NAME = "EXT_meshopt_compression"


def values_of(
    file: GltfFile, view: int, folder: Path, components: int, component_type: int, floats: bool = True
) -> Any:
    accessor = file.add(
        "accessors",
        bufferView=view, type=f"VEC{components}", count=40, componentType=component_type,
        normalized=component_type != 5126,
    )  # fmt: skip
    document = Document(file.write(folder, "model.glb"))
    source = Element({"key": accessor}, "test")
    return (read_floats if floats else read_accessor)(document, source, "key", (f"VEC{components}",))


@pytest.mark.parametrize(("prefix", "version"), [("EXT", 0), ("KHR", 0), ("KHR", 1)])
def test_attributes_are_exact(prefix: str, version: int, tmp_path: Path) -> None:
    file = GltfFile()
    view = meshopt_view(file, ROWS, "ATTRIBUTES", version=version, prefix=prefix)
    np.testing.assert_array_equal(values_of(file, view, tmp_path, 4, 5126), ROWS)


@pytest.mark.parametrize(("stride", "bits", "component_type"), [(4, 8, 5120), (8, 12, 5122)])
def test_octahedral(stride: int, bits: int, component_type: int, tmp_path: Path) -> None:
    file, normals = GltfFile(), ROWS.copy()
    normals[:, :3] /= np.linalg.norm(ROWS[:, :3], axis=1, keepdims=True)
    normals[:, 3] = np.where(ROWS[:, 3] > 0, 1, -1)
    view = meshopt_view(file, meshopt.encode_filter_oct(normals, stride, bits), "ATTRIBUTES", "OCTAHEDRAL")
    decoded = values_of(file, view, tmp_path, 4, component_type)
    np.testing.assert_allclose(decoded, normals, atol=2.5 / (1 << (bits - 1)))


def test_quaternions(tmp_path: Path) -> None:
    file = GltfFile()
    view = meshopt_view(file, meshopt.encode_filter_quat(UNIT, 8, 12), "ATTRIBUTES", "QUATERNION")
    decoded = values_of(file, view, tmp_path, 4, 5122)
    same = np.sign((decoded * UNIT).sum(axis=1, keepdims=True))  # -q is the same rotation
    np.testing.assert_allclose(decoded * same, UNIT, atol=2 / (1 << 11))


def test_exponential(tmp_path: Path) -> None:
    file = GltfFile()
    view = meshopt_view(file, meshopt.encode_filter_exp(1000 * ROWS, 16), "ATTRIBUTES", "EXPONENTIAL")
    decoded = values_of(file, view, tmp_path, 4, 5126)
    np.testing.assert_allclose(decoded, 1000 * ROWS, atol=1000 * np.abs(ROWS).max() / (1 << 14))


def test_colors(tmp_path: Path) -> None:
    file, colors = GltfFile(), np.abs(UNIT)
    encoded = meshopt.encode_filter_color(colors, 4, 8)
    view = meshopt_view(file, encoded, "ATTRIBUTES", "COLOR", 1, "KHR")
    np.testing.assert_allclose(values_of(file, view, tmp_path, 4, 5121), colors, atol=3 / 255)


@pytest.mark.parametrize(
    ("mode", "dtype"), [("TRIANGLES", "u2"), ("TRIANGLES", "u4"), ("INDICES", "u2"), ("INDICES", "u4")]
)
def test_a_mesh(mode: str, dtype: str, tmp_path: Path) -> None:
    attributes, triangles = grid()
    file = GltfFile()
    accessors = {}
    for name, values in attributes.items():
        view = meshopt_view(file, values, "ATTRIBUTES")
        kind = f"VEC{values.shape[1]}"
        accessors[name] = file.add("accessors", bufferView=view, type=kind, count=144, componentType=5126)
    view = meshopt_view(file, triangles.reshape(-1).astype(dtype), mode)
    order = file.add(
        "accessors", bufferView=view, type="SCALAR", count=triangles.size, componentType=5123 if dtype == "u2" else 5125
    )
    file.mesh(accessors.pop("POSITION"), attributes=accessors, indices=order)
    (node,) = read(file.write(tmp_path, "model.glb")).nodes()
    assert node.mesh is not None
    section = node.mesh.sections[0]
    np.testing.assert_array_equal(section.positions, attributes["POSITION"])
    np.testing.assert_array_equal(section.uv0, attributes["TEXCOORD_0"])

    def turned(order: Any) -> set[tuple[int, ...]]:  # the triangles' codec may begin with another corner
        return {tuple(np.roll(corners, -int(np.argmin(corners))).tolist()) for corners in order}

    assert turned(section.indices) == turned(triangles)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"byteStride": 6}, "ATTRIBUTES with the filter NONE cannot have a stride of 6"),
        ({"byteStride": 260}, "cannot have a stride of 260"),
        ({"filter": "QUATERNION"}, "ATTRIBUTES with the filter QUATERNION cannot have a stride of 16"),
        ({"filter": "other"}, "'other' is not one of NONE, OCTAHEDRAL"),
        ({"mode": "TRIANGLES", "byteStride": 4}, "40 indices are no triangles"),
        ({"mode": "INDICES", "byteStride": 2, "filter": "EXPONENTIAL"}, "INDICES with the filter EXPONENTIAL"),
        ({"mode": "other"}, "'other' is not one of ATTRIBUTES"),
        ({"mode": None}, "mode: is missing"),
        ({"count": 20}, "cannot be decoded"),
        ({"count": 400}, "cannot be decoded"),
        ({"count": 1 << 53}, "would take .* of memory"),
        ({"count": 0}, "0 is not a whole number"),
        ({"byteOffset": 1 << 40}, "reaches past its buffer"),
        ({"buffer": 2}, "2 is out of range"),
        ({"buffer": 1}, r"buffers\[1\]: has neither a uri nor a binary chunk"),
    ],
)
def test_what_does_not_fit_is_one_line(change: dict[str, Any], fault: str, tmp_path: Path) -> None:
    file = GltfFile()
    view = meshopt_view(file, ROWS, "ATTRIBUTES")
    file.json["bufferViews"][view]["extensions"][NAME] |= change
    with pytest.raises(SceneError, match=fault) as caught:
        values_of(file, view, tmp_path, 4, 5126)
    assert str(caught.value).startswith(("bufferViews[0].extensions", "buffers[1]"))


def test_a_view_that_is_longer_than_its_content(tmp_path: Path) -> None:
    file = GltfFile()
    view = meshopt_view(file, ROWS, "ATTRIBUTES")
    file.json["bufferViews"][view]["byteLength"] += 1
    with pytest.raises(SceneError, match=r"bufferViews\[0\]: reaches past its buffer \(bytes 0 to 641 of 640\)"):
        values_of(file, view, tmp_path, 4, 5126)


def test_the_uncompressed_copy_is_not_read(tmp_path: Path) -> None:
    file = GltfFile()
    view = meshopt_view(file, ROWS, "ATTRIBUTES")
    file.more_buffers[0]["uri"] = "nowhere.bin"
    np.testing.assert_array_equal(values_of(file, view, tmp_path, 4, 5126), ROWS)


def test_content_is_decoded_once_and_counted_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    whole = meshopt.decode_gltf_buffer
    monkeypatch.setattr(meshopt, "decode_gltf_buffer", lambda *asked: calls.append(asked[1]) or whole(*asked))
    file = GltfFile()
    meshopt_view(file, ROWS, "ATTRIBUTES")
    for _ in range(2):
        file.add("accessors", bufferView=0, type="VEC4", count=40, componentType=5126)
    document = Document(file.write(tmp_path, "model.glb"))
    for key in range(2):
        read_accessor(document, Element({"key": key}, "test"), "key", ("VEC4",))
    assert calls == [40]
    file.json["bufferViews"][0]["extensions"][NAME]["count"] = 10**6
    document = Document(file.write(tmp_path, "model.glb"), Budget(Limits(bytes=10**7)))
    with pytest.raises(SceneError, match=rf"{NAME}: would take 16 MB of memory.*; the limit is 10 MB"):
        read_accessor(document, Element({"key": 0}, "test"), "key", ("VEC4",))
    assert calls == [40]


@needs_assets
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_compressed_fox_is_the_fox() -> None:
    plain, compressed = load(ASSETS / "Fox" / "Fox.glb"), load(ASSETS / "Derived_compressed" / "Fox_meshopt.glb")
    for scene in (plain, compressed):
        scene.animate(0.4, 1)
    by_name = {node.name: node for node in compressed.nodes()}
    moved = 0
    for node in plain.nodes():
        if node.mesh is None:
            np.testing.assert_allclose(by_name[node.name].world[:3, 3], node.world[:3, 3], atol=0.5)
            moved += 1
    assert moved > 20
    first, second = (
        next(node.mesh for node in scene.nodes() if node.mesh).sections[0] for scene in (plain, compressed)
    )
    np.testing.assert_allclose(second.uv0, first.uv0, atol=1e-3)
    assert first.joints is not None and second.joints is not None
    np.testing.assert_array_equal(second.joints.max(), first.joints.max())
