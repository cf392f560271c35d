"""KHR_draco_mesh_compression: what is decoded, and what forged content leads to."""

import os
import sys
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import pytest
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.gltf import draco, read
from pica.scene.limits import Budget, Limits
from pica.scene.loading import load
from pica.scene.mesh import Section
from tests.assets import ASSETS, needs_assets
from tests.scene.compressed_files import DRACO, draco_bytes, draco_file, grid, plain_file
from tests.scene.gltf_files import GltfFile

BITS = 14


def only_section(path: Path) -> Section:
    (node,) = (node for node in read(path).nodes() if node.mesh)
    assert node.mesh is not None
    (section,) = node.mesh.sections
    return section


def corners(section: Section) -> NDArray[np.float32]:
    """(triangles, 3, values) positions, normals and texture coordinates, in an order of their own."""
    values = np.concatenate([section.positions, section.normals, section.uv0], axis=1)[section.indices]
    start = np.argmin(values[:, :, 0] + 7 * values[:, :, 1], axis=1)  # each triangle's first corner
    turned = np.stack([np.take_along_axis(values, (start[:, None] + i)[:, :, None] % 3, 1)[:, 0] for i in range(3)], 1)
    return turned[np.lexsort(np.round(turned.mean(1)[:, :2].T, 3))]


@pytest.mark.parametrize("level", [0, 5, 10])
@pytest.mark.parametrize("preserve", [True, False])
def test_the_mesh_is_that_without_compression(level: int, preserve: bool, tmp_path: Path) -> None:
    mesh = grid()
    file = draco_file(*mesh, compression_level=level, preserve_order=preserve, quantization_bits=BITS)
    compressed = only_section(file.write(tmp_path))
    plain = only_section(plain_file(*mesh).write(tmp_path, "plain.gltf"))
    assert len(compressed.positions) == 144 and compressed.indices.shape == (242, 3)
    np.testing.assert_allclose(corners(compressed), corners(plain), atol=1 / (1 << BITS))
    if preserve:
        np.testing.assert_array_equal(compressed.indices, plain.indices)
        np.testing.assert_array_equal(compressed.normals, plain.normals)


def test_joints_and_colors_have_the_accessors_types(tmp_path: Path) -> None:
    attributes, triangles = grid(4)
    numbers = np.arange(16)
    attributes["COLOR_0"] = np.stack([numbers * 16] * 4, axis=1).astype(np.uint8)
    attributes["JOINTS_0"] = np.stack([numbers % 3, numbers * 0, numbers * 0, numbers * 0], axis=1).astype(np.uint16)
    attributes["WEIGHTS_0"] = np.tile(np.float32([1, 0, 0, 0]), (16, 1))
    file = draco_file(attributes, triangles, preserve_order=True)
    for accessor in file.json["accessors"]:
        accessor["normalized"] = accessor["componentType"] == 5121
    joints = [file.add("nodes", name=str(number)) for number in range(3)]
    file.json["nodes"][0]["skin"] = file.add("skins", joints=joints)
    section = only_section(file.write(tmp_path))
    np.testing.assert_allclose(section.colors[:, 0], numbers * 16 / 255, atol=1e-6)
    assert section.joints is not None
    np.testing.assert_array_equal(section.joints[:, 0], numbers % 3)


def test_primitives_may_share_accessors(tmp_path: Path) -> None:
    attributes, triangles = grid()
    file = draco_file(attributes, triangles, preserve_order=True)
    flat = attributes | {"POSITION": attributes["POSITION"] * np.float32([1, 1, 0])}
    primitives = file.json["meshes"][0]["primitives"]
    second = draco_bytes(flat, triangles, preserve_order=True)
    extension = primitives[0]["extensions"][DRACO] | {"bufferView": file.view(second)}
    primitives.append(primitives[0] | {"extensions": {DRACO: extension}})
    (node,) = read(file.write(tmp_path)).nodes()
    assert node.mesh is not None
    first, other = node.mesh.sections
    assert first.positions[:, 2].max() > 0.25
    np.testing.assert_allclose(other.positions[:, 2], 0, atol=1e-4)


def test_an_attribute_that_is_not_compressed_is_read_as_usual(tmp_path: Path) -> None:
    attributes, triangles = grid()
    file = draco_file(attributes, triangles, preserve_order=True)
    primitive = file.json["meshes"][0]["primitives"][0]
    del primitive["extensions"][DRACO]["attributes"]["TEXCOORD_0"]
    primitive["attributes"]["TEXCOORD_0"] = file.accessor(attributes["TEXCOORD_0"] / 2)
    np.testing.assert_array_equal(only_section(file.write(tmp_path)).uv0, attributes["TEXCOORD_0"] / 2)


def test_fewer_vertices_than_the_accessors_have_are_fine(tmp_path: Path) -> None:
    file = draco_file(*grid())
    for accessor in file.json["accessors"]:
        accessor["count"] += 3
    assert len(only_section(file.write(tmp_path)).positions) == 144


def test_more_vertices_than_the_accessors_have_are_an_error(tmp_path: Path) -> None:
    file = draco_file(*grid())
    for accessor in file.json["accessors"][:3]:
        accessor["count"] -= 1
    with pytest.raises(SceneError, match=rf"{DRACO}: holds 144 vertices, and its accessors 143"):
        read(file.write(tmp_path))


def set_in(file: GltfFile, value: Any, *place: Any) -> None:
    inside: Any = file.json
    for step in place[:-1]:
        inside = inside[step]
    inside[place[-1]] = value


PRIMITIVE = ("meshes", 0, "primitives", 0)
EXTENSION = (*PRIMITIVE, "extensions", DRACO)


@pytest.mark.parametrize(
    ("place", "value", "fault"),
    [
        (("accessors", 3, "count"), 3, "holds 726 indices, and its accessor 3"),
        (("accessors", 0, "type"), "VEC4", "has 3 components in attribute"),
        (("accessors", 0, "type"), "MAT4", "is not one of SCALAR"),
        (("accessors", 2, "componentType"), 5121, "which its accessor's type does not hold"),
        ((*EXTENSION, "attributes", "POSITION"), 99, "has no attribute 99"),
        ((*EXTENSION, "attributes"), {}, "has no attribute that is read"),
        ((*EXTENSION, "bufferView"), 7, "7 is out of range"),
        ((*PRIMITIVE, "mode"), 5, "only triangles can be decoded"),
        ((*PRIMITIVE, "indices"), None, "indices: is missing"),
        (("accessors", 3, "count"), 1 << 53, "would take .* of memory"),
        (("accessors", 0, "count"), 1 << 53, "would take .* of memory"),
    ],
)
def test_what_does_not_fit_is_one_line(place: tuple[Any, ...], value: Any, fault: str, tmp_path: Path) -> None:
    file = draco_file(*grid())
    set_in(file, value, *place)
    with pytest.raises(SceneError, match=fault) as caught:
        read(file.write(tmp_path))
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"DRACO", b"x" * 100, draco_bytes(*grid())[:300]], ids=range(4))
def test_broken_content_is_one_line(content: bytes, tmp_path: Path) -> None:
    file = draco_file(*grid(), content=content or b"\0")
    with pytest.raises(SceneError, match=rf"{DRACO}: cannot be decoded \(") as caught:
        read(file.write(tmp_path))
    assert "\n" not in str(caught.value)


def test_points_are_no_mesh(tmp_path: Path) -> None:
    attributes, triangles = grid()
    file = draco_file(attributes, triangles, content=DracoPy.encode(attributes["POSITION"]))
    with pytest.raises(SceneError, match="holds points without triangles"):
        read(file.write(tmp_path))


def worker(script: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another process instead of the one that decodes; it has what comes before its loop."""
    path = tmp_path / "worker.py"
    path.write_text(Path(draco.__file__).with_name("draco_worker.py").read_text().replace("DracoPy.decode", script))
    monkeypatch.setattr(draco, "WORKER", path)


@pytest.mark.parametrize(
    ("script", "fault"),
    [
        ("(lambda content: [0 for zero in iter(int, 1) if zero])", r"takes more than 0\.\d s to decode"),
        ("(lambda content: bytearray(1 << 33))", "takes more memory to decode than its accessors account for"),
        ("(lambda content: os.kill(os.getpid(), signal.SIGSEGV))", r"cannot be decoded \(.*code -11\)"),
        ("(lambda content: os._exit(0))", r"cannot be decoded \(.*code 0\)"),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="the limits are those of Linux")
def test_a_decoder_that_fails_costs_one_error(
    script: str, fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    worker(script, tmp_path, monkeypatch)
    monkeypatch.setattr(draco, "_FREE_SECONDS", 0.3)
    with pytest.raises(SceneError, match=fault):
        read(draco_file(*grid()).write(tmp_path))


def test_time_is_that_of_all_primitives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    delay = "[0 for _ in iter(lambda end=time.process_time() + 0.2: time.process_time() > end, True)]"
    worker(f"(lambda content: ({delay}, DracoPy.decode.__call__(content))[1])", tmp_path, monkeypatch)
    monkeypatch.setattr(draco, "_FREE_SECONDS", 0.5)
    file = draco_file(*grid())
    assert read(file.write(tmp_path)).triangle_count() == 242
    file.json["meshes"][0]["primitives"] *= 4
    with pytest.raises(SceneError, match=r"primitives\[[23]\].* takes more than"):
        read(file.write(tmp_path))


def test_no_process_is_left(tmp_path: Path) -> None:
    def children() -> set[str]:
        path = Path(f"/proc/self/task/{os.getpid()}/children")
        return set(path.read_text().split()) if path.exists() else set()

    before = children()
    read(draco_file(*grid()).write(tmp_path))
    with pytest.raises(SceneError):
        read(draco_file(*grid(), content=b"x").write(tmp_path))
    assert children() <= before


def test_decoding_is_counted_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(draco.DracoDecoder, "decode", lambda *_: pytest.fail("decoded"))
    path = draco_file(*grid()).write(tmp_path)
    with pytest.raises(SceneError, match=rf"{DRACO}: would take .*; the limit is 0.05 MB"):
        read(path, Budget(Limits(bytes=50_000)))


@needs_assets
@pytest.mark.parametrize(
    ("name", "triangles"), [("heart_draco", 180), ("cave", 595_410), ("chess-board", 178_848), ("jet-fighter", 36_446)]
)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_assets(name: str, triangles: int) -> None:
    scene = load(ASSETS / "playcanvas" / name / f"{name}.glb")
    assert scene.triangle_count() == triangles
    for node in scene.nodes():
        for section in node.mesh.sections if node.mesh else ():
            np.testing.assert_allclose(np.linalg.norm(section.normals, axis=1), 1, atol=1e-3)
