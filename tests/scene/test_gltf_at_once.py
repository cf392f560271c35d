"""What large files are read by, many objects at once, gives what one object after the other gives."""

import gc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.animation import Channel
from pica.scene.construction import unchecked_constructor
from pica.scene.gltf import columns, read
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.gltf.prefetch import SmallAccessors
from pica.scene.gltf.section_batch import SectionBatch
from pica.scene.loading import load
from pica.scene.material import Image, Material, Texture
from pica.scene.model import Mesh, Node, Scene, Section
from tests.scene.gltf_files import GltfFile

RANDOM = np.random.default_rng(5)
ARRAYS = ("positions", "normals", "tangents", "uv0", "uv1", "colors", "indices")


def floats(file: GltfFile, count: int, width: int, **entry: Any) -> int:
    return file.accessor(RANDOM.uniform(-1, 1, (count, width)), **entry)


def mixed() -> GltfFile:
    """Small meshes that lack one thing or another, nodes below nodes, and channels of several kinds."""
    file = GltfFile()
    materials = [
        file.add("materials", name=f"paint {i}", pbrMetallicRoughness={"metallicFactor": i / 9}) for i in range(9)
    ]
    for number in range(40):
        count = 3 + number % 5
        attributes = {}
        if number % 3:
            attributes["NORMAL"] = floats(file, count, 3) if number % 7 else file.accessor(np.zeros((count, 3)))
        if number % 4 == 1:
            attributes["TANGENT"] = floats(file, count, 4)
        if number % 2:
            attributes["TEXCOORD_0"] = floats(file, count, 2)
        if number % 5 == 0:
            attributes["TEXCOORD_1"] = file.accessor(RANDOM.integers(0, 255, (count, 2)), "u1", normalized=True)
        if number % 4:
            attributes["COLOR_0"] = file.accessor(RANDOM.uniform(0, 1, (count, 3 + number % 2)))
        indices = {"indices": file.accessor([0, 1, 2, 2, 1, count - 1, 1, 1, 0], "u2")} if number % 6 else {}
        place = {"translation": [number, 0.5, 0], "rotation": [0, 0.6, 0, 0.8]} if number % 8 else {"matrix": MATRIX}
        node = {"name": f"node {number}", "extras": {"kind": number}, **place}
        file.mesh(floats(file, count, 3), node, attributes=attributes, material=materials[number % 9], **indices)
    interleaved = file.view(RANDOM.uniform(-1, 1, (5, 6)).astype("<f4").tobytes(), byteStride=24)
    entry = {"bufferView": interleaved, "componentType": 5126, "count": 5, "type": "VEC3"}
    normals = file.add("accessors", byteOffset=12, **entry)
    file.mesh(file.add("accessors", **entry), {"name": "interleaved"}, attributes={"NORMAL": normals})
    file.json["nodes"][1]["children"] = [2, 3]
    file.json["nodes"][3]["children"] = [8, 9]
    times = file.accessor([0, 0.5, 2])
    samplers = [
        {"input": times, "output": floats(file, 3, 4 if path == "rotation" else 3), "interpolation": kind}
        for path in ("translation", "rotation", "scale")
        for kind in ("LINEAR", "STEP")
    ]
    samplers.append({"input": times, "output": floats(file, 9, 3), "interpolation": "CUBICSPLINE"})
    paths = ["translation"] * 2 + ["rotation"] * 2 + ["scale"] * 2 + ["translation"]
    targets = [{"node": node, "path": path} for node, path in enumerate(paths, start=1)]
    channels = [{"sampler": index, "target": target} for index, target in enumerate(targets)]
    file.add("animations", samplers=samplers, channels=channels)
    return file


MATRIX = [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 5, 6, 7, 1]


def one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SectionBatch, "takes", lambda *_: False)
    monkeypatch.setattr(SmallAccessors, "prefetch", lambda *_: None)
    monkeypatch.setattr("pica.scene.gltf.nodes._PLAIN", set())


def described(scene: Scene) -> list[Any]:
    """All that the scene holds, in a form that can be compared."""
    found: list[Any] = []
    for node in scene.nodes():
        parent = node.parent.name if node.parent is not None else ""
        found.append((node.name, parent, [child.name for child in node.children], node.transform.tolist()))
        above = np.eye(4) if node.parent is None else node.parent.world
        np.testing.assert_allclose(node.world, above @ node.transform, atol=1e-12)
        found.append(
            (node.world.round(12).tolist(), node.pose and [part.tolist() for part in vars(node.pose).values()])
        )
        found.append({name: value for name, value in vars(node).items() if type(value) in (str, bool, frozenset, dict)})
        assert node.mesh is not None and node in scene
        for section in node.mesh.sections:
            section.check()
            found.append([(name, getattr(section, name).tolist()) for name in ARRAYS])
            found.append((section.flat, section.joints, {**vars(section.material)}))
    for channel in scene.animations[0].channels:
        found.append((channel.node.name, channel.path, channel.interpolation))
        found.append((channel.times.tolist(), channel.values.tolist(), channel.values.dtype))
    return found


def test_at_once_is_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = mixed().write(tmp_path)
    at_once = described(read(path))
    one_by_one(monkeypatch)
    assert at_once == described(read(path))


def test_full_batches_are_completed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = mixed().write(tmp_path)
    expected = described(read(path))
    monkeypatch.setattr("pica.scene.gltf.section_batch._FULL", 30)
    monkeypatch.setattr("pica.scene.gltf.prefetch._AT_ONCE", 3)
    assert described(read(path)) == expected


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda json: json["nodes"][9].update(translation=[0, "1", 2]), r"nodes\[9\].translation\[1\]: '1' is not"),
        (lambda json: json["nodes"][9].update(translation=[0, True, 2]), r"nodes\[9\].translation\[1\]: True is not"),
        (lambda json: json["nodes"][9].update(translation=[0, 10**400, 2]), r"nodes\[9\].translation\[1\]: 1000"),
        (lambda json: json["nodes"][9].update(translation=[0, 1]), r"nodes\[9\].translation: .* list of 3 numbers"),
        (lambda json: json["nodes"][9].update(translation="abc"), r"nodes\[9\].translation: 'abc' is not a list"),
        (lambda json: json["nodes"][9].update(rotation=[0] * 4), r"nodes\[9\].rotation: a quaternion of zeros"),
        (lambda json: json["nodes"][9].update(mesh=True), r"nodes\[9\].mesh: True is not a whole number"),
        (lambda json: json["nodes"][9].update(scale=[3e38] * 3), r"nodes\[9\]: node 'node 9': .* too large"),
        (lambda json: json["accessors"][1].update(count=2.5), r"accessors\[1\].count: 2.5 is not a whole"),
        (lambda json: json["accessors"][1].update(count=99), r"accessors\[1\]: reaches past its buffer view"),
        (lambda json: json["accessors"][1].update(byteOffset=-4), r"accessors\[1\].byteOffset: -4 is not"),
        (lambda json: json["bufferViews"][1].update(byteOffset=10**9), r"bufferViews\[1\]: reaches past its buffer"),
        (lambda json: json["bufferViews"][1].update(byteStride=2), r"byteStride of 2"),
        (lambda json: json["bufferViews"][1].update(buffer=1), r"bufferViews\[1\].buffer: 1 is out of range"),
        (lambda json: json["animations"][0]["samplers"][1].update(input=1), r"samplers\[1\].input: must be SCALAR"),
        (lambda json: json["animations"][0]["samplers"][2].update(output=1), r"samplers\[2\].output: must be VEC4"),
        (lambda json: json["animations"][0]["channels"][2]["target"].update(node=0), r"nodes\[0\] has a matrix"),
    ],
)
def test_faults_among_many_are_named(change: Callable[[Any], Any], fault: str, tmp_path: Path) -> None:
    file = mixed()
    change(file.json)
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


def test_numbers_of_small_accessors_are_finite(tmp_path: Path) -> None:
    file = mixed()
    at = file.json["bufferViews"][1]["byteOffset"] + 4
    file.buffer[at : at + 4] = np.float32(np.nan).tobytes()
    with pytest.raises(SceneError, match=r"POSITION: holds numbers that are not finite \(accessors\[\d+\]\)"):
        read(file.write(tmp_path))


def test_a_rotation_of_zeros_among_many_is_named(tmp_path: Path) -> None:
    file = mixed()
    file.json["animations"][0]["samplers"][3]["output"] = file.accessor([[0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 1, 0]])
    with pytest.raises(SceneError, match=r"animations\[0\].samplers\[3\].output: a quaternion of zeros"):
        read(file.write(tmp_path))


def test_what_is_read_ahead_counts(tmp_path: Path) -> None:
    """Accessors that all have the same bytes."""
    file = GltfFile()
    file.mesh(floats(file, 300, 3))
    accessor = file.json["accessors"][0]
    indices = [file.add("accessors", **accessor) for _ in range(1000)]
    document = Document(file.write(tmp_path, "model.glb"))
    before = document.budget._taken["bytes"]
    document.small_accessors.prefetch(indices)
    kept = sum(document.small_accessors.get(index).nbytes for index in indices)  # type: ignore[union-attr]
    assert kept == 1000 * 3600 and document.budget._taken["bytes"] - before >= kept


def test_columns_are_what_elements_say() -> None:
    rows: list[Any] = [[1, 2.5], None, [3, -4]]
    entries = [Element({"x": row}) for row in rows]
    np.testing.assert_array_equal(columns.numbers(entries, "x", 2, (7.0, 8.0)), [[1, 2.5], [7, 8], [3, -4]])
    assert columns.numbers([], "x", 2).shape == (0, 2)
    values: list[Any] = [3, True, 2.0, None, -1, 1 << 60, "4", 10**30]
    found = columns.integers([Element({"x": value}) for value in values] + [Element({})], "x", 5)
    assert found.tolist() == [3, -1, -1, -1, -1, -1, -1, -1, 5]


def test_unchecked_objects_are_like_others() -> None:
    triangle = np.eye(3, dtype=np.float32)
    flat = {name: np.zeros((3, width), np.float32) for name, width in (("uv0", 2), ("uv1", 2), ("colors", 4))}
    arrays = {"positions": triangle, "normals": triangle, "tangents": np.ones((3, 4), np.float32), **flat}
    values: dict[type[Any], dict[str, Any]] = {
        Node: {"name": "a"},
        Material: {"name": "b", "metallic": 0.5},
        Texture: {"image": Image(np.zeros((1, 1, 4), np.uint8))},
        Section: {**arrays, "indices": np.array([[0, 1, 2]], np.uint32), "material": Material()},
        Channel: {"node": Node(), "path": "scale", "times": np.zeros(1), "values": np.ones((1, 3))},
        Mesh: {"name": "c"},
    }
    for made, given in values.items():
        quick, slow = unchecked_constructor(made)(**given), made(**given)
        assert type(quick) is made and vars(quick).keys() >= vars(slow).keys()
        assert repr(quick) == repr(slow)
    first, second = (unchecked_constructor(Material)() for _ in range(2))
    assert first.parameters is not second.parameters and first.extras is not second.extras


def test_the_collector_goes_on_after_a_fault(tmp_path: Path) -> None:
    with pytest.raises(SceneError):
        load(tmp_path / "gone.gltf")
    assert gc.isenabled()
