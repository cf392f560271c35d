"""Typed access to the JSON of a file."""

import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.gltf import read
from pica.scene.gltf.element import Element
from tests.scene.gltf_files import TRIANGLE, GltfFile


def element(**values: Any) -> Element:
    """The object nodes[3].extras of a file."""
    return Element(values, "extras", Element({}, "nodes", Element({}), 3))


def test_places_are_json_paths() -> None:
    assert Element({}).place("scene") == "scene"
    assert element().place() == "nodes[3].extras"
    assert element().place("light", 2) == "nodes[3].extras.light[2]"
    assert element(light={}).object("light").place("color") == "nodes[3].extras.light.color"
    assert element(parts=[{}, {}]).objects("parts")[1].place() == "nodes[3].extras.parts[1]"
    assert element().extension("KHR_x").place("y") == "nodes[3].extras.extensions.KHR_x.y"


@pytest.mark.parametrize(
    ("ask", "expected"),
    [
        (lambda e: e.integer("x", default=7), 7),
        (lambda e: e.number("x", default=0.5), 0.5),
        (lambda e: e.numbers("x", 2, default=(1.0, 2.0)), (1.0, 2.0)),
        (lambda e: e.flag("x", default=True), True),
        (lambda e: e.text("x", default="a"), "a"),
        (lambda e: e.choice("x", {"a": 1}, default=2), 2),
        (lambda e: (e.texts("x"), e.integers("x"), e.objects("x"), e.references("x", [])), ([], [], [], [])),
        (lambda e: ("x" in e, e.has_extension("x"), "y" in e.object("x")), (False, False, False)),
    ],
)
def test_what_is_absent_or_null_is_the_default(ask: Any, expected: Any) -> None:
    assert ask(element()) == expected
    assert ask(element(x=None)) == expected


def test_values_come_as_they_are_asked_for() -> None:
    assert element(x=3.0).integer("x") == 3 and type(element(x=3.0).integer("x")) is int
    assert element(x=3).number("x") == 3 and type(element(x=3).number("x")) is float
    assert element(x=[1, 2.5]).numbers("x", 2) == (1.0, 2.5)
    assert element(x=4.0).choice("x", {4: "four"}) == "four"
    entries = [Element({}) for _ in range(3)]
    assert element(x=2).reference("x", entries) is entries[2]
    assert element(x=[2, 0]).references("x", entries) == [entries[2], entries[0]]


@pytest.mark.parametrize(
    ("ask", "value", "fault"),
    [
        (lambda e: e.integer("x"), None, "x: is missing"),
        (lambda e: e.integer("x"), 1.5, "x: 1.5 is not a whole number of at least 0"),
        (lambda e: e.integer("x"), True, "x: True is not a whole number"),
        (lambda e: e.integer("x", high=6), 7, "x: 7 is not a whole number from 0 to 6"),
        (lambda e: e.integers("x"), [0, "a"], "x[1]: 'a' is not a whole number"),
        (lambda e: e.number("x"), float("nan"), "x: nan is not a number"),
        (lambda e: e.number("x"), float("inf"), "x: inf is not a number"),
        (lambda e: e.number("x"), 10**400, "x: 1000"),
        (lambda e: e.number("x", low=0), -1, "x: -1 is not a number of at least 0"),
        (lambda e: e.numbers("x", 2), [1], "x: [1] is not a list of 2 numbers"),
        (lambda e: e.numbers("x", 2), [1, False], "x[1]: False is not a number"),
        (lambda e: e.flag("x", default=True), 1, "x: 1 is not true or false"),
        (lambda e: e.text("x"), 1, "x: 1 is not text"),
        (lambda e: e.texts("x"), ["a", 1], "x[1]: 1 is not text"),
        (lambda e: e.choice("x", {"a": 1, "b": 2}), [], "x: [] is not one of a, b"),
        (lambda e: e.choice("x", {1: 1}), True, "x: True is not one of 1"),
        (lambda e: e.object("x"), [1], "x: [1] is not an object"),
        (lambda e: e.object("x", required=True), None, "x: is missing"),
        (lambda e: e.objects("x"), [{}, None], "x[1]: None is not an object"),
        (lambda e: e.objects("x"), {}, "x: {} is not an array"),
        (lambda e: e.reference("x", []), 0, "x: 0 is out of range (count 0)"),
        (lambda e: e.reference("x", []), None, "x: is missing"),
        (lambda e: e.reference("x", []), -1, "x: -1 is out of range"),
        (lambda e: e.references("x", []), ["a"], "x[0]: 'a' is not a whole number"),
        (lambda e: e.text("x", default="") and e.integer("x"), "y" * 999, "x: 'yyyy"),
    ],
)
def test_a_value_that_does_not_fit_is_named_with_its_place(ask: Any, value: Any, fault: str) -> None:
    with pytest.raises(SceneError) as caught:
        ask(element(x=value))
    assert str(caught.value).startswith(f"nodes[3].extras.{fault}")
    assert len(str(caught.value)) < 200


def test_a_message_shows_little_of_a_value_however_large_or_deep() -> None:
    deep: Any = 1
    for _ in range(100_000):
        deep = [deep]
    values = [deep, [deep] * 99, {"a": deep}, "y" * 10**7, list(range(10**6)), {str(i): i for i in range(10**5)}]
    for value in [*values, 10**4000, -(10**4000), "\x1b[31m\n\u202e" * 99]:
        start = time.process_time()
        with pytest.raises(SceneError, match=r"^nodes\[3\].extras.x: ") as caught:
            element(x=value).flag("x", default=True)
        assert len(str(caught.value)) < 200 and str(caught.value).isprintable()
        assert time.process_time() - start < 0.1


def test_numbers_are_what_a_device_can_hold() -> None:
    largest = float(np.finfo(np.float32).max)
    assert element(x=largest).number("x") == largest
    for value in (2 * largest, 1e308, -1e300, 10**400, float("inf"), float("nan")):
        with pytest.raises(SceneError, match=r"nodes\[3\].extras.x: .* is not a number"):
            element(x=value).number("x")
        with pytest.raises(SceneError, match=r"nodes\[3\].extras.x\[1\]: .* is not a number"):
            element(x=[1, value]).numbers("x", 2)


def test_what_a_function_finds_wrong_gets_its_place() -> None:
    def refuse(value: int, *, named: int) -> None:
        raise SceneError(f"{value} and {named} do not go together")

    with pytest.raises(SceneError, match=r"^nodes\[3\].extras: 1 and 2 do not go together$"):
        element().apply(refuse, 1, named=2)
    assert element().apply(max, 1, 2) == 2


def test_extras_and_names_may_be_any_json(tmp_path: Path) -> None:
    for extras in ([1], "text", 3, True, None, {"a": 1}):
        file = everything()
        for entries in file.json.values():
            for entry in entries if isinstance(entries, list) else [entries]:
                if isinstance(entry, dict):
                    entry["extras"] = extras
        file.json["extras"] = extras
        scene = read(file.write(tmp_path))
        node = next(node for node in scene.nodes() if node.mesh)
        kept = extras if isinstance(extras, dict) else {}
        assert node.extras == kept and node.mesh.sections[0].material.extras == kept


def everything() -> GltfFile:
    """A file in which a scene uses every kind of thing that is read."""
    file = GltfFile()
    targets = [{"POSITION": file.accessor(TRIANGLE)}]
    sparse = {
        "count": 1,
        "indices": {"bufferView": file.view(np.array([1], "<u2").tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(np.ones(3, "<f4").tobytes()), "byteOffset": 0},
    }
    attributes = {
        "NORMAL": file.accessor([[0, 0, 1]] * 3, sparse=sparse),
        "JOINTS_0": file.accessor([[0, 0, 0, 0]] * 3, "u1"),
        "WEIGHTS_0": file.accessor([[1, 0, 0, 0]] * 3),
        "TEXCOORD_0": file.accessor([[0, 0], [1, 0], [0, 1]]),
    }
    pixel = bytes.fromhex(
        "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d49444154789c63f8cfc0f01f0005"
        "0001ff89993d1d0000000049454e44ae426082"
    )
    file.add("images", name="pixel", mimeType="image/png", bufferView=file.view(pixel))
    file.add("samplers", wrapS=10497, wrapT=33071, magFilter=9728)
    file.add("textures", source=0, sampler=0, extensions={"EXT_texture_webp": {"source": 0}})
    transform = {"offset": [0, 0.5], "rotation": 0.1, "scale": [1, 2], "texCoord": 0}
    texture = {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": transform}}
    material = {
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "baseColorTexture": texture},
        "normalTexture": {"index": 0, "scale": 0.5}, "occlusionTexture": {"index": 0, "strength": 0.5},
        "emissiveFactor": [1, 1, 1], "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True,
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 2},
            "KHR_materials_ior": {"ior": 1.4},
            "KHR_materials_specular": {"specularFactor": 1, "specularColorFactor": [1, 1, 1]},
            "KHR_materials_transmission": {"transmissionFactor": 0.5},
            "KHR_materials_volume": {"thicknessFactor": 1},
            "KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.5},
        },
    }  # fmt: skip
    instances = {"attributes": {"TRANSLATION": file.accessor([[0, 0, 0], [1, 0, 0]])}}
    pica = {"pica": {"visible_to_camera": True, "lighting_channels": [0], "radius": 0.5}}
    placed = {"translation": [1, 2, 3], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1], "weights": [0.5]}
    node = placed | {"name": "body", "skin": 0, "extras": pica, "extensions": {"EXT_mesh_gpu_instancing": instances}}
    indices = file.accessor([0, 1, 2], "u1")
    file.mesh(
        node=node,
        attributes=attributes,
        targets=targets,
        indices=indices,
        mode=4,
        material=file.add("materials", **material),
    )
    file.json["meshes"][0]["weights"] = [0.25]
    lens = {"yfov": 1, "znear": 0.1}
    file.add("cameras", type="perspective", perspective=lens)
    file.add("cameras", type="orthographic", orthographic={"xmag": 1, "ymag": 1, "znear": 0, "zfar": 9})
    lights = [{"type": "spot", "color": [1, 1, 1], "intensity": 2, "range": 9, "spot": {"outerConeAngle": 0.5}}]
    lights.append({"type": "directional", "extras": {"pica": {"angular_diameter": 0.01}}})
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    for camera in (0, 1):
        file.add("nodes", camera=camera, extensions={"KHR_lights_punctual": {"light": camera}})
    panel = {"type": "rectangle", "radiance": 5, "width": 2, "height": 1, "color": [1, 1, 1]}
    matrix = [float(value) for value in np.eye(4).reshape(-1)]
    file.add("nodes", children=[0, 1], matrix=matrix, extras={"pica": {"light": panel}})
    binds = file.add("accessors", componentType=5126, type="MAT4", count=1)
    file.add("skins", joints=[1], inverseBindMatrices=binds)
    sampler = {"input": file.accessor([0, 1]), "output": file.accessor(np.eye(2, 3)), "interpolation": "LINEAR"}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    file.add("animations", samplers=[sampler], channels=[channel])
    file.json |= {"scenes": [{"nodes": [2, 3]}], "scene": 0, "extensionsUsed": ["KHR_lights_punctual"]}
    file.json["asset"]["minVersion"] = "2.0"
    return file


def holders(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every object or array of the JSON below `value` with each of its keys."""
    for key in list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        yield value, key
        yield from holders(value[key])


@pytest.mark.filterwarnings("ignore::UserWarning", "error::RuntimeWarning")
@pytest.mark.parametrize(
    "wrong",
    [None, 2.5, -1, 3e38, 1e-320, 1e308, 10**400, "\ud800", "\0", [[]], {"pica": [1], "extensions": 1},
     [1e38, 1e38], [1e38, 1e38, -1e38], [1e38, 1e38, 1e38, 1], [1e30] * 16, {"index": 0, "bufferView": 0, "source": 0}],
    ids=lambda wrong: ascii(wrong)[:12],
)  # fmt: skip
def test_any_value_of_a_wrong_kind_loads_or_ends_in_its_place(wrong: Any, tmp_path: Path) -> None:
    """Each value of a file that uses all that is read is replaced in turn."""
    path = everything().write(tmp_path)
    document = json.loads(path.read_text())
    refused = 0
    for holder, key in list(holders(document)):
        right, holder[key] = holder[key], wrong
        path.write_text(json.dumps(document))
        holder[key] = right
        try:
            read(path)
        except SceneError as error:
            refused += 1
            place = str(error).removeprefix(f"{path}: ")
            assert re.match(r"[a-zA-Z]+[\w.\[\]]*: |needs ", place), place
            assert "\n" not in place and len(place) < 300
    assert refused > 50


def test_nodes_load_in_microseconds(tmp_path: Path) -> None:
    file = GltfFile()
    meshes = [{"primitives": [{"attributes": {"POSITION": file.accessor(TRIANGLE)}}]} for _ in range(100)]
    nodes = [{"name": "leaf", "mesh": i % 100, "translation": [i, 0.5, 0], "scale": [1, 2, 1]} for i in range(20_000)]
    file.json |= {"meshes": meshes, "nodes": nodes}
    path = file.write(tmp_path)
    start = time.process_time()
    scene = read(path)
    assert time.process_time() - start < 20_000 * 80e-6  # several times what it takes
    assert sum(1 for _ in scene.nodes()) == 20_000
