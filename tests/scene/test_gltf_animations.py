"""Animations, skins and morph targets as files give them."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.gltf import read
from pica.scene.model import Node, Scene
from pica.scene.skin import deform
from tests.assets import ASSETS, needs_assets
from tests.scene.gltf_files import GltfFile

HALF = math.sqrt(0.5)
IDENTITY = np.eye(4)
MORPH_CUBE = ASSETS / "assimp_glTF2" / "glTF-Sample-Models" / "AnimatedMorphCube-glTF" / "AnimatedMorphCube.gltf"


def named(scene: Scene, name: str) -> Node:
    (node,) = (node for node in scene.nodes() if node.name == name)
    return node


def deforming(scene: Scene) -> Node:
    (node,) = (node for node in scene.nodes() if node.deforms)
    return node


def animated(
    path: str, values: Any, times: Any = (0, 1), interpolation: str | None = None, dtype: str = "f4",
    node: dict[str, Any] | None = None, **accessor: Any,
) -> GltfFile:  # fmt: skip
    """A file whose one node, a triangle with two morph targets, has one channel."""
    file = GltfFile()
    offsets = [{"POSITION": file.accessor([[0, 0, z]] * 3)} for z in (1, 10)]
    file.mesh(node=node, targets=offsets)
    sampler = {"input": file.accessor(times), "output": file.accessor(values, dtype, **accessor)}
    sampler |= {"interpolation": interpolation} if interpolation else {}
    channel = {"sampler": 0, "target": {"node": 0, "path": path}}
    file.add("animations", name="move", samplers=[sampler], channels=[channel])
    return file


def skinned(sets: list[tuple[Any, Any]], joint_type: str = "u1", weight_type: str = "f4", **skin: Any) -> GltfFile:
    """A file with a skinned triangle and two joints, the second one under the first and a metre along +X."""
    file = GltfFile()
    attributes = {}
    for number, (joints, weights) in enumerate(sets):
        attributes[f"JOINTS_{number}"] = file.accessor(joints, joint_type)
        attributes[f"WEIGHTS_{number}"] = file.accessor(weights, weight_type, normalized=weight_type != "f4")
    attributes["NORMAL"] = file.accessor([[0, 0, 1]] * 3)
    file.mesh(node={"skin": 0, "translation": [50, 0, 0]}, attributes=attributes)
    file.add("nodes", name="first", children=[2], translation=[0, 0, 3])
    file.add("nodes", name="second", translation=[1, 0, 0])
    file.add("skins", **({"joints": [1, 2]} | skin))
    return file


def columns(matrices: list[np.ndarray]) -> np.ndarray:
    """As MAT4 accessors hold them, four numbers a row."""
    return np.concatenate([matrix.T for matrix in matrices])


def test_each_path_moves_its_part_and_keeps_the_others(tmp_path: Path) -> None:
    rest = {"translation": [1, 2, 3], "scale": [2, 2, 2]}
    scene = read(animated("rotation", [[0, 0, 0, 1], [0, HALF, 0, HALF]], node=rest).write(tmp_path))
    (node,) = scene.nodes()
    assert [animation.name for animation in scene.animations] == ["move"]
    assert scene.animations[0].duration == 1
    scene.animate(1, "move")
    np.testing.assert_allclose(node.world @ (1, 0, 0, 1), (1, 2, 1, 1), atol=1e-6)
    scene = read(animated("translation", [[0, 0, 0], [4, 0, 0]], node=rest).write(tmp_path))
    scene.animate(0.25)
    np.testing.assert_allclose(next(scene.nodes()).world @ (1, 0, 0, 1), (3, 0, 0, 1))
    scene = read(animated("scale", [[1, 1, 1], [5, 1, 1]], node=rest).write(tmp_path))
    scene.animate(0.5)
    np.testing.assert_allclose(next(scene.nodes()).world @ (1, 0, 0, 1), (4, 2, 3, 1))


def test_step_and_cubic_spline_are_read(tmp_path: Path) -> None:
    scene = read(animated("translation", [[0, 0, 0], [4, 0, 0]], interpolation="STEP").write(tmp_path))
    scene.animate(0.9)
    assert next(scene.nodes()).world[0, 3] == 0
    keys = [[9, 0, 0], [0, 0, 0], [8, 0, 0], [0, 0, 0], [4, 0, 0], [9, 0, 0]]  # in, value, out, at each of two
    scene = read(animated("translation", keys, times=(0, 2), interpolation="CUBICSPLINE").write(tmp_path))
    scene.animate(1)
    assert next(scene.nodes()).world[0, 3] == pytest.approx(4 / 2 + 2 * 8 / 8)


def test_normalized_integers_are_rotations_and_weights(tmp_path: Path) -> None:
    scene = read(animated("rotation", [[0, 0, 0, 127], [0, 127, 0, 0]], dtype="i1", normalized=True).write(tmp_path))
    scene.animate(0.5)
    np.testing.assert_allclose(next(scene.nodes()).pose.rotation, (0, HALF, 0, HALF), atol=1e-7)
    scene = read(animated("weights", [0, 0, 255, 51], dtype="u1", normalized=True).write(tmp_path))
    scene.animate(1)
    np.testing.assert_allclose(next(scene.nodes()).weights, (1, 0.2))


def test_weights_of_each_key_lie_together(tmp_path: Path) -> None:
    scene = read(animated("weights", [0, 1, 1, 3]).write(tmp_path))
    node = next(scene.nodes())
    scene.animate(0.5)
    np.testing.assert_allclose(node.weights, (0.5, 2))
    np.testing.assert_allclose(deform(node.mesh.sections[0], node)[0][0], (0, 0, 20.5))
    tangents_first = [7, 7, 0, 0, 8, 0, 0, 0, 2, 4, 7, 7]  # both targets' incoming tangents, values, outgoing ones
    scene = read(animated("weights", tangents_first, interpolation="CUBICSPLINE").write(tmp_path))
    scene.animate(0.5)
    np.testing.assert_allclose(next(scene.nodes()).weights, (2 / 2 + 8 / 8, 4 / 2))


def test_default_weights_come_from_the_node_else_the_mesh(tmp_path: Path) -> None:
    file = animated("weights", [0, 0, 1, 1])
    file.json["meshes"][0]["weights"] = [0.25, 0]
    file.add("nodes", mesh=0, weights=[0, 0.5])
    first, second = read(file.write(tmp_path)).nodes()
    np.testing.assert_array_equal(first.weights, (0.25, 0))
    np.testing.assert_array_equal(second.weights, (0, 0.5))
    assert first.mesh is second.mesh
    del file.json["meshes"][0]["weights"]
    np.testing.assert_array_equal(next(read(file.write(tmp_path)).nodes()).weights, (0, 0))


def test_unknown_targets_are_left_out_with_one_warning(tmp_path: Path) -> None:
    file = animated("translation", [[0, 0, 0], [1, 0, 0]])
    channels = file.json["animations"][0]["channels"]
    channels += [{"sampler": 0, "target": {"node": 0, "path": "pointer"}}, {"sampler": 0, "target": {"path": "scale"}}]
    with pytest.warns(UserWarning, match="translation, rotation, scale or weights, which is left out") as caught:
        scene = read(file.write(tmp_path))
    assert len(caught) == 1 and len(scene.animations[0].channels) == 1


def test_animations_of_nodes_outside_the_scene_are_left_out(tmp_path: Path) -> None:
    file = animated("translation", [[0, 0, 0], [1, 0, 0]])
    file.json |= {"scenes": [{"nodes": [file.mesh()]}], "scene": 0}
    assert read(file.write(tmp_path)).animations[0].channels == ()


def broken(**changes: Any) -> GltfFile:
    """A file whose channel moves a node, with changes to its sampler and to the channel."""
    file = animated("translation", [[0, 0, 0], [1, 0, 0]])
    animation = file.json["animations"][0]
    for key, value in changes.items():
        part = animation["samplers"][0] if key in ("input", "output", "interpolation") else animation["channels"][0]
        part[key] = value
    return file


@pytest.mark.parametrize(
    ("file", "fault"),
    [
        (broken(sampler=3), r"animations\[0\].channels\[0\].sampler: 3 is out of range"),
        (broken(target=None), r"channels\[0\].target: is missing"),
        (broken(target={"node": 9, "path": "scale"}), r"channels\[0\].target.node: 9 is out of range"),
        (broken(target={"node": 0, "path": "rotation"}), "output: must be VEC4, not VEC3"),
        (broken(interpolation="LOOP"), r"samplers\[0\].interpolation: 'LOOP' is not one of"),
        (broken(input=99), r"input: 99 is out of range"),
        (broken(interpolation="CUBICSPLINE"), "output: 2 elements do not fit 2 keys of translation"),
        (animated("scale", [[1, 1, 1]] * 2, times=(1, 0)), "input: times must ascend from 0"),
        (animated("scale", [[1, 1, 1]] * 2, times=(-1, 0)), "input: times must ascend from 0"),
        (animated("scale", [[1, 1, math.nan]] * 2), "not finite"),
        (animated("rotation", [[0, 0, 0, 1], [0, 0, 0, 0]]), "output: a quaternion of zeros is no rotation"),
        (animated("weights", [0, 1, 2]), "output: 3 elements do not fit 2 keys of weights"),
        (animated("scale", [[1, 1, 1]] * 2, node={"matrix": [1, 0, 0, 0] * 4}), "must be 0, 0, 0, 1"),
        (
            animated("scale", [[1, 1, 1]] * 2, node={"matrix": IDENTITY.reshape(-1).tolist()}),
            r"channels\[0\].target.node: nodes\[0\] has a matrix, which cannot be animated",
        ),
        (animated("scale", [[1, 1, 1]] * 2, node={"weights": [1]}), r"nodes\[0\].weights: \[1\] is not a list of 2"),
    ],
)
def test_faults_of_animations_are_named(file: GltfFile, fault: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}") as caught:
        read(file.write(tmp_path))
    assert "\n" not in str(caught.value)


def test_weights_of_a_mesh_without_targets_are_refused(tmp_path: Path) -> None:
    file = animated("weights", [0, 0, 1, 1])
    file.json["animations"][0]["channels"][0]["target"]["node"] = file.mesh(node={"name": "plain"})
    with pytest.raises(SceneError, match="weights of node 'plain', which has no morph targets"):
        read(file.write(tmp_path))


def test_skins_of_several_sets_with_weights_made_whole(tmp_path: Path) -> None:
    # Weights 0.2 of 0.4 make a half; the second set's column without weight is dropped, as are the first set's.
    sets = [
        ([[0, 0, 0, 9], [1, 0, 0, 0], [0, 0, 0, 0]], [[0.2, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]]),
        ([[0, 1, 0, 0], [0] * 4, [0] * 4], [[0, 0.2, 0, 0], [0] * 4, [0] * 4]),
    ]
    binds = np.stack([np.eye(4)] * 2)
    binds[0, 2, 3], binds[1, :3, 3] = -3, (-1, 0, -3)
    file = skinned(sets)
    file.json["skins"][0]["inverseBindMatrices"] = file.accessor(columns([*binds]), count=2, type="MAT4")
    scene = read(file.write(tmp_path))
    node = deforming(scene)
    section = node.mesh.sections[0]
    np.testing.assert_array_equal(section.joints, [[0, 1], [1, 0], [0, 0]])
    np.testing.assert_allclose(section.weights, [[0.5, 0.5], [1, 0], [1, 0]])
    assert section.joints.dtype == np.uint16 and section.weights.dtype == np.float32
    assert node.skin.root is named(scene, "first")
    rest = deform(section, node)[0] + (0, 0, 3)
    np.testing.assert_allclose(rest, section.positions, atol=1e-6)  # the bind pose, wherever the node itself is
    named(scene, "second").transform = np.diag([2.0, 1, 1, 1])  # scaled about the origin instead of at x = 1
    moved = deform(section, node)[0] + (0, 0, 3)
    np.testing.assert_allclose(moved, [[-1, 0, 0], [0, 0, 0], [0, 1, 0]], atol=1e-6)


@pytest.mark.parametrize(("joint_type", "weight_type"), [("u1", "u1"), ("u2", "u2"), ("u2", "f4")])
def test_joints_and_weights_of_every_type(joint_type: str, weight_type: str, tmp_path: Path) -> None:
    whole = 1 if weight_type == "f4" else np.iinfo(weight_type).max
    file = skinned([([[1, 0, 0, 0]] * 3, [[whole, 0, 0, 0]] * 3)], joint_type, weight_type)
    node = deforming(read(file.write(tmp_path)))
    np.testing.assert_array_equal(node.mesh.sections[0].weights, [[1]] * 3)
    # without inverse bind matrices the mesh is given in the joints' own spaces
    np.testing.assert_allclose(deform(node.mesh.sections[0], node)[0], [[1, 0, 0], [2, 0, 0], [1, 1, 0]])


def test_joints_follow_vertices_through_splitting_and_sorting_out(tmp_path: Path) -> None:
    file = GltfFile()
    positions = file.accessor([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    attributes = {
        "JOINTS_0": file.accessor([[7, 0, 0, 0]] + [[i, 0, 0, 0] for i in range(4)], "u1"),
        "WEIGHTS_0": file.accessor([[1, 0, 0, 0]] * 5),
    }
    targets = [{"POSITION": file.accessor([[i, 0, 0] for i in range(5)])}]
    file.mesh(positions, indices=file.accessor([1, 2, 3, 1, 4, 2], "u1"), attributes=attributes, targets=targets)
    (node,) = read(file.write(tmp_path)).nodes()
    section = node.mesh.sections[0]
    assert section.flat
    np.testing.assert_array_equal(section.joints[section.indices][..., 0], [[0, 1, 2], [0, 3, 1]])
    np.testing.assert_array_equal(section.morph_positions[0][section.indices][..., 0], [[1, 2, 3], [1, 4, 2]])


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"joints": []}, r"skins\[0\].joints: is empty"),
        ({"joints": [1, 9]}, r"skins\[0\].joints\[1\]: 9 is out of range"),
        ({"joints": [1]}, r"nodes\[0\].skin: its mesh follows joint 1 of 1"),
        ({"inverseBindMatrices": 0}, "inverseBindMatrices: must be MAT4"),
    ],
)
def test_faults_of_skins_are_named(change: dict[str, Any], fault: str, tmp_path: Path) -> None:
    file = skinned([([[1, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3)], **change)
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


def test_faults_of_joints_and_weights_are_named(tmp_path: Path) -> None:
    file = skinned([([[1, 0, 0, 0]] * 3, [[1, -1, 0, 0]] * 3)])
    with pytest.raises(SceneError, match="WEIGHTS_0: a weight is negative"):
        read(file.write(tmp_path))
    file = skinned([([[1, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3)], joint_type="f4")
    with pytest.raises(SceneError, match="JOINTS_0: joints must be unsigned integers"):
        read(file.write(tmp_path))
    file = skinned([([[1, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3)])
    del file.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]
    with pytest.raises(SceneError, match="lacks WEIGHTS_0, which goes with JOINTS_0"):
        read(file.write(tmp_path))
    file = skinned([([[1, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3)])
    file.json |= {"scenes": [{"nodes": [0]}], "scene": 0}
    with pytest.raises(SceneError, match=r"skins\[0\].joints\[0\]: nodes\[1\] is not in the scene"):
        read(file.write(tmp_path))
    file = skinned([([[1, 0, 0, 0]] * 3, [[1, 0, 0, 0]] * 3)])
    name = file.accessor(columns([IDENTITY]), count=1, type="MAT4")
    file.json["skins"][0]["inverseBindMatrices"] = name
    with pytest.raises(SceneError, match="1 matrices for 2 joints"):
        read(file.write(tmp_path))


def test_a_skin_without_joints_on_the_mesh_is_left_out_with_a_warning(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"nodes\[0\]: its skin is left out"):
        scene = read(skinned([]).write(tmp_path))
    assert not any(node.deforms for node in scene.nodes())
    assert scene.bounds()[1][0] == 51


def test_faults_of_morph_targets_are_named(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(targets=[{"POSITION": file.accessor([[0, 0, 0]] * 2)}])
    with pytest.raises(SceneError, match=r"primitives\[0\].targets\[0\].POSITION: 2 elements for 3 positions"):
        read(file.write(tmp_path))
    file = GltfFile()
    file.mesh(targets=[{}])
    file.json["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}})
    with pytest.raises(SceneError, match=r"meshes\[0\].primitives: differ in their number of morph targets \(0 to 1\)"):
        read(file.write(tmp_path))


def test_morph_targets_of_colours_are_left_out_with_a_warning(tmp_path: Path) -> None:
    file = GltfFile()
    offsets = file.accessor([[1, 0, 0]] * 3)
    base = {"NORMAL": file.accessor([[0, 0, 1]] * 3), "COLOR_0": file.accessor([[1, 1, 1]] * 3)}
    file.mesh(attributes=base, targets=[{"NORMAL": offsets, "COLOR_0": offsets}, {"TANGENT": offsets}])
    with pytest.warns(UserWarning, match="morph targets change positions, normals and tangents") as caught:
        section = next(read(file.write(tmp_path)).nodes()).mesh.sections[0]
    assert len(caught) == 1
    np.testing.assert_array_equal(section.morph_positions, np.zeros((2, 3, 3)))
    np.testing.assert_array_equal(section.morph_normals[:, :, 0], [[1] * 3, [0] * 3])
    assert section.morph_tangents is None  # the base has none


@needs_assets
def test_simple_skin_bends_as_worked_out() -> None:
    scene = read(ASSETS / "SimpleSkin" / "SimpleSkin.gltf")
    node = deforming(scene)
    section = node.mesh.sections[0]
    scene.animate(1)  # the second joint, at (0, 1, 0), is turned by 90 degrees about +Z
    x, y = section.positions[:, 0] - 0.5, section.positions[:, 1]  # both inverse bind matrices move by (-0.5, -1)
    share = y / 2  # how far a vertex follows the second joint
    expected = np.stack([(1 - share) * x - share * (y - 1), (1 - share) * y + share * (1 + x), 0 * x], axis=1)
    placed = deform(section, node)[0] + node.instance_transforms()[0, :3, 3]
    np.testing.assert_allclose(placed, expected, atol=1e-3)  # the file rounds its quaternions to 0.707
    np.testing.assert_allclose(np.stack(scene.bounds()), [expected.min(0), expected.max(0)], atol=1e-3)


@needs_assets
def test_fox_runs_with_its_skin() -> None:
    scene = read(ASSETS / "Fox" / "Fox.glb")
    assert [animation.name for animation in scene.animations] == ["Survey", "Walk", "Run"]
    node = deforming(scene)
    section = node.mesh.sections[0]
    changes = scene.subscribe()
    scene.animate(0.4, "Run")
    assert changes.take().deformed == [node]
    positions, normals, tangents = deform(section, node)
    place = node.instance_transforms()[0]
    matrices = [j.world @ b for j, b in zip(node.skin.joints, node.skin.inverse_bind, strict=True)]
    for vertex in range(0, len(positions), 97):  # glTF 2.0, 3.7.3.3, one vertex at a time in world space
        blend = sum(w * matrices[j] for j, w in zip(section.joints[vertex], section.weights[vertex], strict=True))
        np.testing.assert_allclose(
            (place @ (*positions[vertex], 1))[:3], (blend @ (*section.positions[vertex], 1))[:3], atol=1e-4
        )
    assert np.isfinite(tangents).all()
    corners = positions[section.indices]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.einsum("ti,ti->t", faces, normals[section.indices[:, 0]])
    np.testing.assert_allclose(along, np.linalg.norm(faces, axis=1), rtol=1e-4)
    placed = positions @ place[:3, :3].T + place[:3, 3]
    np.testing.assert_allclose(np.stack(scene.bounds()), [placed.min(0), placed.max(0)])


@needs_assets
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_quantized_fox_equals_the_plain_one() -> None:
    plain, quantized = (read(ASSETS / name) for name in ("Fox/Fox.glb", "Derived_compressed/Fox_quantized.glb"))
    for scene in (plain, quantized):
        scene.animate(0.3, "Walk")
    np.testing.assert_allclose(np.stack(plain.bounds()), quantized.bounds(), atol=0.02)  # of 160 units


@needs_assets
def test_box_animated_moves_up_while_it_turns() -> None:
    scene = read(ASSETS / "BoxAnimated" / "BoxAnimated.gltf")
    box = next(node for node in scene.nodes() if node.mesh is not None and node.mesh.name == "inner_box")
    scene.animate(0.625)  # half the way up by t = 1.25, not turning yet
    np.testing.assert_allclose(box.world[:3, 3], (0, 1.26, 0), atol=1e-6)
    np.testing.assert_allclose(box.world[:3, :3], np.eye(3), atol=1e-6)
    scene.animate(1.875)  # up, and through half of the half turn about X from t = 1.25 to 2.5
    np.testing.assert_allclose(box.world[:3, 3], (0, 2.52, 0), atol=1e-6)
    np.testing.assert_allclose(np.abs(box.world[:3, 1]), (0, 0, 1), atol=1e-6)
    scene.animate(99)
    np.testing.assert_allclose(box.world[:3, 3], 0, atol=1e-6)


@needs_assets
def test_sparse_morph_stress_test_equals_the_dense_one() -> None:
    dense = read(ASSETS / "playcanvas" / "morph-stress-test" / "morph-stress-test.glb")
    sparse = read(ASSETS / "Derived_compressed" / "MorphStressTest_sparse.glb")
    assert [a.name for a in dense.animations] == ["Individuals", "TheWave", "Pulse"]
    first, second = deforming(dense), deforming(sparse)
    for weights in ([0] * 8, [1] * 8, [0, 1, 0, 0, 0.5, 0, 0, 0.25]):
        first.weights = second.weights = weights
        for one, other in zip(first.mesh.sections, second.mesh.sections, strict=True):
            shape, same_shape = deform(one, first), deform(other, second)
            np.testing.assert_allclose(shape[0], same_shape[0], atol=1e-6)
            np.testing.assert_allclose(shape[1], same_shape[1], atol=0.02)  # the sparse file's normals are in bytes
    first.weights = [1] * 8
    assert dense.bounds()[1][1] == pytest.approx(1.5)  # every key lifts its bar by a metre


@needs_assets
def test_morph_stress_test_plays_its_keys_one_by_one() -> None:
    scene = read(ASSETS / "playcanvas" / "morph-stress-test" / "morph-stress-test.glb")
    node = deforming(scene)
    highest = []
    for time in np.linspace(0, scene.animations[0].duration, 100):
        scene.animate(time, "Individuals")
        highest.append(int(np.argmax(node.weights)) if node.weights.max() > 0.9 else -1)
    assert list(dict.fromkeys(key for key in highest if key >= 0)) == list(range(8))


@needs_assets
def test_animated_morph_cube_mixes_its_two_targets() -> None:
    scene = read(MORPH_CUBE)
    node = deforming(scene)
    section = node.mesh.sections[0]
    times, weights = scene.animations[0].channels[0].times, scene.animations[0].channels[0].values
    scene.animate((times[60] + times[61]) / 2)
    mean = (weights[60] + weights[61]) / 2
    assert mean.min() > 0.1
    np.testing.assert_allclose(node.weights, mean)
    expected = section.positions + mean[0] * section.morph_positions[0] + mean[1] * section.morph_positions[1]
    positions, normals, tangents = deform(section, node)
    np.testing.assert_allclose(positions, expected, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    np.testing.assert_allclose((normals * tangents[:, :3]).sum(1), 0, atol=1e-9)


@needs_assets
def test_every_animated_asset_plays() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scenes = [read(ASSETS / "Fox" / "Fox.glb"), read(MORPH_CUBE), read(ASSETS / "BoxAnimated" / "BoxAnimated.gltf")]
    for scene in scenes:
        changes = scene.subscribe()
        for animation in range(len(scene.animations)):
            for time in np.linspace(-1, scene.animations[animation].duration + 1, 7):
                scene.animate(time, animation)
                low, high = scene.bounds()
                assert np.isfinite([low, high]).all() and (low < high).all()
        assert changes.take().any()
