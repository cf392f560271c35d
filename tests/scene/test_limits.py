"""What small files may ask for, and how much of it they get."""

import base64
import io
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pica.errors import SceneError
from pica.scene.limits import FREE_BYTES, MESH_COMPRESSION, Budget, Limits
from pica.scene.loading import load
from tests.scene.gltf_files import GltfFile

MEASURED = """
import json, resource, sys, time, warnings
import pica.scene.gltf.nodes, pica.scene.loading
warnings.simplefilter("ignore")
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
before, start, error = peak(), time.process_time(), ""
try:
    pica.scene.loading.load(*sys.argv[1:])
except pica.errors.SceneError as caught:
    error = str(caught)
print(json.dumps([error, time.process_time() - start, peak() - before]))
"""


def measured(*arguments: Path) -> tuple[str, float, int]:
    """What loading these says, and the seconds and the bytes of memory that it takes."""
    done = subprocess.run([sys.executable, "-c", MEASURED, *arguments], capture_output=True, text=True, check=True)
    error, seconds, memory = json.loads(done.stdout)
    return error, seconds, memory


def zeros(file: GltfFile, count: int, kind: str = "VEC3", component: int = 5126, **entry: Any) -> int:
    """An accessor that nothing in the file stands for."""
    return file.add("accessors", componentType=component, count=count, type=kind, **entry)


def flat_png(width: int, height: int) -> bytes:
    """A grey picture without anything on it."""
    stream = io.BytesIO()
    Image.new("L", (width, height), 77).save(stream, "PNG")
    return stream.getvalue()


def many_zeros(file: GltfFile) -> None:
    file.mesh(zeros(file, 5_000_000))


def many_zeros_often(file: GltfFile) -> None:
    for _ in range(20):
        file.mesh(zeros(file, 1_000_000))


def zeros_of_one_accessor(file: GltfFile) -> None:
    positions, normals = zeros(file, 500_000), zeros(file, 500_000)
    for _ in range(1000):
        file.mesh(positions, attributes={"NORMAL": normals})


def one_buffer_view(file: GltfFile) -> None:
    positions = file.accessor(np.zeros((30_000, 3)))
    for _ in range(5000):
        file.mesh(file.add("accessors", **file.json["accessors"][positions]))


def tangents(file: GltfFile) -> None:
    file.add("images", bufferView=file.view(flat_png(1, 1)))
    file.add("textures", source=0)
    material = file.add("materials", normalTexture={"index": 0})
    file.mesh(zeros(file, 3_000_000), attributes={"TEXCOORD_0": zeros(file, 3_000_000, "VEC2")}, material=material)


def far_sparse(file: GltfFile) -> None:
    index = {"bufferView": file.view(b"\0\0\0\0"), "componentType": 5125}
    sparse = {"count": 1, "indices": index, "values": {"bufferView": file.view(b"\0" * 12)}}
    file.mesh(zeros(file, 100_000_000, sparse=sparse), indices=file.accessor([0, 1, 2], "u4"))


def repeated_indices(file: GltfFile) -> None:
    indices = zeros(file, 100_000_000, "SCALAR", 5125)
    file.mesh(indices=indices)


def instances(file: GltfFile) -> None:
    attributes = {"TRANSLATION": zeros(file, 20_000_000)}
    file.mesh(node={"extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}})


def nodes_with_instances(file: GltfFile) -> None:
    attributes = {"TRANSLATION": zeros(file, 1_000_000)}
    for _ in range(1000):
        file.add("nodes", extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}}, mesh=0)
    file.mesh()


def sections_with_instances(file: GltfFile) -> None:
    attributes = {"TRANSLATION": zeros(file, 200_000)}
    file.mesh(node={"extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}})
    file.json["meshes"][0]["primitives"] *= 1000


def shining_instances(file: GltfFile) -> None:
    attributes = {"TRANSLATION": zeros(file, 100_000)}
    node = {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}
    file.mesh(zeros(file, 30_000), node=node, material=file.add("materials", emissiveFactor=[1, 1, 1]))


def morphed_nodes(file: GltfFile) -> None:
    positions = zeros(file, 300_000)
    file.mesh(positions, targets=[{"POSITION": positions}])
    for _ in range(1000):
        file.add("nodes", mesh=0)


def skinned_nodes(file: GltfFile) -> None:
    count = 300_000
    attributes = {"JOINTS_0": zeros(file, count, "VEC4", 5121), "WEIGHTS_0": zeros(file, count, "VEC4")}
    file.mesh(zeros(file, count), attributes=attributes, node={"skin": 0})
    for _ in range(1000):
        file.add("nodes", mesh=0, skin=0)
    file.add("skins", joints=[0])


def morph_targets(file: GltfFile) -> None:
    file.mesh(zeros(file, 30_000), targets=[{}] * 100_000)


def joint_sets(file: GltfFile) -> None:
    names = [f"{name}_{number}" for number in range(2000) for name in ("JOINTS", "WEIGHTS")]
    accessors = {"JOINTS": zeros(file, 30_000, "VEC4", 5121), "WEIGHTS": zeros(file, 30_000, "VEC4")}
    file.mesh(zeros(file, 30_000), attributes={name: accessors[name.split("_")[0]] for name in names})


def animation_keys(file: GltfFile) -> None:
    file.mesh()
    file.add("nodes")
    sampler = {"input": zeros(file, 1_000_000, "SCALAR"), "output": zeros(file, 1_000_000)}
    channel = {"sampler": 0, "target": {"node": 1, "path": "scale"}}
    file.add("animations", samplers=[sampler], channels=[channel] * 1000)


def one_skin_for_all(file: GltfFile) -> None:
    joints = {"JOINTS_0": file.accessor([[0] * 4] * 3, "u1"), "WEIGHTS_0": file.accessor([[1, 0, 0, 0]] * 3)}
    file.mesh(attributes=joints)
    file.json["nodes"] = [{"mesh": 0, "skin": 0} for _ in range(20_000)]
    file.add("skins", joints=list(range(20_000)))


def pictures(file: GltfFile) -> None:
    for shade in range(4):
        content = flat_png(8192 - shade, 8192)
        file.add("images", bufferView=file.view(content))
        file.add("textures", source=shade)
        file.mesh(material=file.add("materials", emissiveTexture={"index": shade}))


def empty_nodes(file: GltfFile) -> None:
    file.json["nodes"] = [{}] * 600_000


def primitives(file: GltfFile) -> None:
    file.mesh()
    file.json["meshes"][0]["primitives"] *= 60_000


ATTACKS = {
    many_zeros: r"meshes\[0\].primitives\[0\].* files of \d+ bytes may become 500 times that, or 1 GB",
    many_zeros_often: r"meshes\[\d+\].primitives\[0\].* files of",
    zeros_of_one_accessor: r"meshes\[\d+\].primitives\[0\].* files of",
    one_buffer_view: r"meshes\[\d+\].primitives\[0\].* files of",
    tangents: r"meshes\[0\].primitives\[0\].* files of",
    far_sparse: r"accessors\[0\].* files of",
    repeated_indices: r"meshes\[0\].primitives\[0\].indices.* files of",
    instances: r"nodes\[0\].*20,000,000 instances.*the limit is 16,777,215",
    nodes_with_instances: r"nodes\[\d+\].* files of",
    sections_with_instances: r"nodes\[0\].*200,000,000 instances.*the limit is 16,777,215",
    shining_instances: r"nodes\[0\].*3,000,000,000 vertices.*the limit is 100,000,000",
    morphed_nodes: r"nodes\[\d+\].*300,000 vertices.*the limit is 100,000,000",
    skinned_nodes: r"nodes\[\d+\].skin.*300,000 vertices.*the limit is 100,000,000",
    morph_targets: r"meshes\[0\].primitives\[0\].targets",
    joint_sets: r"accessors\[\d\]",
    animation_keys: r"animations\[0\].samplers\[0\]|accessors",
    one_skin_for_all: r"nodes\[\d+\].skin",
    pictures: r"images\[\d\].* files of",
    empty_nodes: r"its JSON|nodes",
    primitives: r"meshes\[0\].primitives\[\d+\]",
}


@pytest.mark.thorough
@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_a_small_file_that_asks_for_much_is_refused(attack: Any, tmp_path: Path) -> None:
    file = GltfFile()
    attack(file)
    path = file.write(tmp_path, "model.glb")
    error, seconds, memory = measured(path)
    with pytest.raises(SceneError, match=f"model.glb: ({ATTACKS[attack]})"):
        raise SceneError(error)
    assert "unless pica.load(…, limits=pica.Limits(" in error and "\n" not in error and len(error) < 500
    assert memory < 1.5 * FREE_BYTES and seconds < 20


def test_eight_users_of_a_large_picture_take_it_once(tmp_path: Path) -> None:
    file = GltfFile()
    view = file.view(flat_png(16384, 8192))
    (tmp_path / "wall.png").write_bytes(flat_png(16384, 8192))
    (tmp_path / "same.png").symlink_to("wall.png")
    images = [{"bufferView": view}, {"bufferView": view, "name": "again"}, {"uri": "wall.png"}, {"uri": "./same.png"}]
    for number, image in enumerate(images * 2):
        file.add("images", **image)
        file.add("textures", source=number)
        file.mesh(material=file.add("materials", emissiveFactor=[1, 1, 1], emissiveTexture={"index": number}))
    error, _, memory = measured(file.write(tmp_path, "model.glb"))
    assert not error
    assert memory < 2.5 * 16384 * 8192 * 4  # once as decoded, once as pica keeps it


def test_users_of_one_picture_share_it(tmp_path: Path) -> None:
    file = GltfFile()
    grey, other = flat_png(2, 2), flat_png(2, 3)
    data = "data:image/png;base64," + base64.b64encode(grey).decode()
    for content in ({"bufferView": file.view(grey)}, {"uri": data}, {"bufferView": file.view(other)}):
        texture = file.add("textures", source=file.add("images", **content))
        file.mesh(material=file.add("materials", emissiveFactor=[1, 1, 1], emissiveTexture={"index": texture}))
    images = [node.mesh.sections[0].material.emissive_texture.image for node in load(file.write(tmp_path)).nodes()]  # type: ignore[union-attr]
    assert images[0] is images[1] is not images[2]


def test_parts_of_one_large_vertex_buffer_cost_what_they_show(tmp_path: Path) -> None:
    """Many exporters put the vertices of all meshes into one accessor."""
    file = GltfFile()
    count = 300_000
    positions = file.accessor(np.random.default_rng(0).random((count, 3)))
    for part in range(1000):
        file.mesh(positions, indices=file.accessor(part * 300 + np.arange(300), "u4"))
    path = file.write(tmp_path, "model.glb")
    error, seconds, memory = measured(path)
    assert not error and seconds < 5 and memory < 20 * path.stat().st_size


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_limits_are_raised_and_lowered_by_name(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(material=file.add("materials", normalTexture={"index": 0}))
    file.add("images", bufferView=file.view(flat_png(4, 4)))
    file.add("textures", source=0)
    path = file.write(tmp_path)
    load(path, limits=Limits(bytes=1e6, vertices=3, instances=1, pixels=16, expansion=0))
    for name, most in {"bytes": 1000, "vertices": 2, "instances": 0.5, "pixels": 15}.items():
        with pytest.raises(SceneError, match=rf"model.gltf: .* unless pica.load\(…, limits=pica.Limits\({name}=…\)\)"):
            load(path, limits=Limits(**{name: most}))


@pytest.mark.parametrize(
    ("most", "asks"),
    [
        (300, "the file"),
        (60_000, "its JSON"),
        (250_000, r"buffers\[1\].uri: 'more.bin'"),
        (1_050_000, r"buffers\[0\].uri"),
    ],
)
def test_the_bytes_of_files_count(most: float, asks: str, tmp_path: Path) -> None:
    file = GltfFile()
    (tmp_path / "more.bin").write_bytes(bytes(200_000))
    file.more_buffers = [{"uri": "more.bin", "byteLength": 200_000}]
    view = file.add("bufferViews", buffer=1, byteLength=36)
    file.mesh(file.add("accessors", bufferView=view, componentType=5121, count=9, type="VEC3"))
    file.mesh(file.accessor(np.zeros((3000, 3))))
    path = file.write(tmp_path)
    with pytest.raises(SceneError, match=rf"model.gltf: {asks}: would take .* MB of memory.*; the limit is"):
        load(path, limits=Limits(bytes=most))


def test_infinity_takes_a_limit_away() -> None:
    budget = Budget(Limits(bytes=math.inf, vertices=math.inf, expansion=math.inf))
    budget.read_file("a.bin", 1)
    budget.take(bytes=10**20, vertices=10**20)
    with pytest.raises(SceneError, match="limit is 2,147,483,648 pixels"):
        budget.take(pixels=10**20)


def test_compressed_meshes_count_as_what_they_decode_to_up_to_a_limit() -> None:
    budget = Budget(Limits(bytes=math.inf))
    budget.read_file("a.glb", 10**7)
    with pytest.raises(SceneError, match=r"files of 10000000 bytes may become 500 times that"):
        budget.take(bytes=10**10)
    for length, times in ((3 * 10**7, 1500), (10**9, 500 * MESH_COMPRESSION)):
        budget = Budget(Limits(bytes=math.inf))
        budget.read_file("a.glb", 10**7)
        budget.decompressed(length)
        budget.take(bytes=times * 10**7 - 10**7)
        with pytest.raises(SceneError, match=rf"files of 10000000 bytes may become {times} times that, or 1 GB"):
            budget.take(bytes=1)


def test_what_files_may_become_counts_each_file_once() -> None:
    budget = Budget(Limits(expansion=2))
    for _ in range(3):
        budget.read_file("a.bin", FREE_BYTES // 4)
    with pytest.raises(SceneError, match=r"would take .* 250000000 bytes may become 2 times that"):
        budget.take(bytes=FREE_BYTES // 2)


@pytest.mark.parametrize("value", [-1, math.nan, "many", None, True, False, 1j])
def test_limits_are_numbers(value: Any) -> None:
    with pytest.raises(SceneError, match=r"limits: vertices must be a number of at least 0, not"):
        Limits(vertices=value)
    with pytest.raises(SceneError, match=r"is not a pica.Limits"):
        Budget("none")  # type: ignore[arg-type]
