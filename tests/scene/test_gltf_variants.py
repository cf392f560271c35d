"""KHR_materials_variants, KHR_node_visibility, and extensions that are ignored by purpose."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.gltf import read
from pica.scene.loading import load
from pica.scene.model import Scene
from tests.scene.gltf_files import GltfFile

VARIANTS, VISIBILITY = "KHR_materials_variants", "KHR_node_visibility"


def shoe() -> GltfFile:
    file = GltfFile()
    for name in ("plain", "red", "blue"):
        file.add("materials", name=name)
    mappings = [{"variants": [0, 2], "material": 1}, {"variants": [1], "material": 2}]
    file.mesh(material=0, extensions={VARIANTS: {"mappings": mappings}})
    file.mesh(material=0)
    file.json["extensions"] = {VARIANTS: {"variants": [{"name": "Red"}, {"name": "Blue"}, {"name": "Evening"}]}}
    file.json["extensionsUsed"] = [VARIANTS]
    return file


def material_names(scene: Scene) -> list[str]:
    return [node.mesh.sections[0].material.name for node in scene.nodes() if node.mesh]


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(("variant", "shown"), [(None, "plain"), ("Red", "red"), ("Blue", "blue"), ("Evening", "red")])
def test_variants(variant: str | None, shown: str, tmp_path: Path) -> None:
    scene = load(shoe().write(tmp_path), variant=variant)
    assert scene.variants == ("Red", "Blue", "Evening")
    assert material_names(scene) == [shown, "plain"]


def test_a_variant_that_is_not_there(tmp_path: Path) -> None:
    path = shoe().write(tmp_path)
    with pytest.raises(SceneError, match=r"model.gltf: no variant 'Bleu'; did you mean 'Blue'\?$"):
        load(path, variant="Bleu")
    with pytest.raises(SceneError, match=r"model.gltf: no variant 'x'; there are 'Red', 'Blue', 'Evening'$"):
        load(path, variant="x")
    with pytest.raises(SceneError, match=r"load: variant: 3 is not"):
        load(path, variant=3)  # type: ignore[arg-type]
    file = GltfFile()
    file.mesh()
    with pytest.raises(SceneError, match=r"no variant 'x'; there are none$"):
        load(file.write(tmp_path), variant="x")


def test_faults_of_variants_are_named(tmp_path: Path) -> None:
    file = shoe()
    file.json["meshes"][0]["primitives"][0]["extensions"][VARIANTS]["mappings"][1]["material"] = 9
    assert material_names(read(file.write(tmp_path), variant="Red"))[0] == "red"
    with pytest.raises(SceneError, match=r"mappings\[1\].material: 9 is out of range"):
        read(file.write(tmp_path), variant="Blue")


def test_hidden_nodes_show_nothing_but_move_what_is_seen(tmp_path: Path) -> None:
    file = GltfFile()
    light = {"KHR_lights_punctual": {"light": 0}}
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    hidden = file.mesh(node={"name": "hidden", "translation": [1, 0, 0]})
    below = file.mesh(node={"name": "below", "extensions": {VISIBILITY: {"visible": True}, **light}})
    camera = file.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1})
    seeing = file.add("nodes", name="seeing", camera=camera)
    file.mesh(node={"name": "shown", "extensions": {VISIBILITY: {"visible": True}}})
    file.json["nodes"][hidden] |= {"children": [below, seeing], "extensions": {VISIBILITY: {"visible": False}}}
    scene = read(file.write(tmp_path))
    nodes = {node.name: node for node in scene.nodes()}
    assert [name for name, node in nodes.items() if node.mesh is not None] == ["shown"]
    assert not any(node.light for node in nodes.values())
    assert len(list(scene.cameras())) == 1
    np.testing.assert_array_equal(nodes["seeing"].world[:3, 3], [1, 0, 0])


def test_a_hidden_node_may_be_animated(tmp_path: Path) -> None:
    file = GltfFile()
    targets = [{"POSITION": file.accessor([[0, 0, 1.0]] * 3)}]
    node = file.mesh(targets=targets, node={"extensions": {VISIBILITY: {"visible": False}}})
    file.mesh()
    times = file.accessor([0.0, 1.0])
    outputs = {"weights": file.accessor([0.0, 1.0]), "translation": file.accessor([[0, 0, 0], [2.0, 0, 0]])}
    file.add(
        "animations",
        samplers=[{"input": times, "output": output} for output in outputs.values()],
        channels=[{"sampler": i, "target": {"node": node, "path": path}} for i, path in enumerate(outputs)],
    )
    scene = read(file.write(tmp_path))
    scene.animate(0.5)
    np.testing.assert_allclose(next(scene.nodes()).world[0, 3], 1)


def test_extensions_without_which_a_file_shows_what_it_has_to(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(node={"extensions": {"MSFT_lod": {"ids": [1]}, "KHR_xmp_json_ld": {"packet": 0}}})
    file.mesh()
    file.json["scenes"] = [{"nodes": [0], "extensions": {"EXT_lights_image_based": {"light": 0}}}]
    file.json["extensionsUsed"] = file.json["extensionsRequired"] = ["MSFT_lod", "KHR_xmp_json_ld"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = read(file.write(tmp_path))
    said = [str(warning.message).partition(": ")[2] for warning in caught]
    assert said == [
        "ignores EXT_lights_image_based: its environment is left out, another one can be given",
        "ignores MSFT_lod: the finest level of detail is shown",
    ]
    assert scene.triangle_count() == 1
