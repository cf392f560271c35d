"""Sampling of channels, what animating reports, skins and morph targets, against values worked out by hand."""

import math
from itertools import pairwise
from time import process_time

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.animation import Animation, Channel, Pose, together
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene, Section
from pica.scene.skin import Skin, deform
from pica.scenes.placing import move, rotate, stretch

HALF = math.sqrt(0.5)
ABOUT_Y_90 = (0.0, HALF, 0.0, HALF)


def posed(name: str = "node", **parts: object) -> Node:
    node = Node(name, pose=Pose(), **parts)
    node.transform = node.pose.matrix()
    return node


def at(time: float, path: str, times: list[float], values: list, interpolation: str = "LINEAR") -> np.ndarray:
    """What a channel makes of its node's pose."""
    node = posed()
    channel = Channel(node, path, np.array(times, float), np.array(values, float), interpolation)
    Animation([channel]).apply(time)
    np.testing.assert_allclose(node.transform, node.pose.matrix())
    return getattr(node.pose, path)


def triangle(**parts: object) -> Section:
    """Corners at the origin, +X and +Y; faces +Z."""
    arrays = {
        "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        "normals": [[0, 0, 1]] * 3,
        "tangents": [[1, 0, 0, -1]] * 3,
        "uv0": np.zeros((3, 2)),
        "uv1": np.zeros((3, 2)),
        "colors": np.ones((3, 4)),
    }
    arrays = {name: np.array(values, np.float32) for name, values in arrays.items()}
    return Section(**arrays, indices=np.array([[0, 1, 2]], np.uint32), material=Material(), **parts)


def floats(values: object) -> np.ndarray:
    return np.array(values, np.float32)


@pytest.mark.parametrize(("time", "x"), [(-1, 2), (0, 2), (1, 2), (2, 4), (2.5, 5), (3, 6), (9, 6)])
def test_linear_goes_straight_and_holds_its_ends(time: float, x: float) -> None:
    value = at(time, "translation", [1, 2, 3], [[2, 0, 1], [4, 0, 1], [6, 0, 1]])
    np.testing.assert_allclose(value, (x, 0, 1))


@pytest.mark.parametrize(("time", "x"), [(0, 2), (1, 2), (1.99, 2), (2, 4), (2.99, 4), (3, 6), (9, 6)])
def test_step_jumps_at_each_key(time: float, x: float) -> None:
    value = at(time, "scale", [1, 2, 3], [[2, 1, 1], [4, 1, 1], [6, 1, 1]], "STEP")
    np.testing.assert_array_equal(value, (x, 1, 1))


def test_keys_at_the_same_time_are_a_jump() -> None:
    keys = [0, 1, 1], [[0, 0, 0], [1, 0, 0], [5, 0, 0]]
    assert at(0.5, "translation", *keys)[0] == 0.5
    assert at(1, "translation", *keys)[0] == 5
    assert at(2, "translation", *keys)[0] == 5


def test_one_key_holds_for_ever() -> None:
    for kind, values in (
        ("LINEAR", [[1, 2, 3]]),
        ("STEP", [[1, 2, 3]]),
        ("CUBICSPLINE", [[[9] * 3, [1, 2, 3], [9] * 3]]),
    ):
        for time in (0, 1, 7):
            np.testing.assert_array_equal(at(time, "translation", [1], values, kind), (1, 2, 3))


def test_cubic_spline_scales_tangents_by_the_time_between_keys() -> None:
    # From 0 at t = 1, leaving at 3 a second, to 8 at t = 3, arriving at -1 a second. Half-way the Hermite weights
    # are 1/2, 1/8, 1/2 and -1/8, and tangents count twice as the keys lie 2 s apart: 4 + 2 * 3 / 8 + 2 * 1 / 8.
    zero = [0, 0, 0]
    keys = [[[77, 0, 0], zero, [3, 0, 0]], [[-1, 0, 0], [8, 0, 0], [55, 0, 0]]]
    assert at(2, "translation", [1, 3], keys, "CUBICSPLINE")[0] == pytest.approx(5)
    # A quarter of the way: 27/32, 9/64, 5/32, -3/64.
    quarter = 8 * 5 / 32 + 2 * 3 * 9 / 64 + 2 * 1 * 3 / 64
    assert at(1.5, "translation", [1, 3], keys, "CUBICSPLINE")[0] == pytest.approx(quarter)
    assert at(0, "translation", [1, 3], keys, "CUBICSPLINE")[0] == 0
    assert at(4, "translation", [1, 3], keys, "CUBICSPLINE")[0] == 8


def test_cubic_spline_rotations_are_made_unit() -> None:
    zero = [0.0] * 4
    keys = [[zero, [0, 0, 0, 1], zero], [zero, list(ABOUT_Y_90), zero]]
    value = at(0.5, "rotation", [0, 1], keys, "CUBICSPLINE")
    np.testing.assert_allclose(value, (0, math.sin(math.pi / 8), 0, math.cos(math.pi / 8)), atol=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_rotations_turn_evenly_on_the_shorter_way(sign: int) -> None:
    value = at(1 / 3, "rotation", [0, 1], [[0, 0, 0, 1], [sign * part for part in ABOUT_Y_90]])
    angle = math.radians(30) / 2
    np.testing.assert_allclose(value, (0, math.sin(angle), 0, math.cos(angle)), atol=1e-12)


def test_rotations_next_to_each_other_stay_finite() -> None:
    near = [0, 1e-9, 0, 1]
    np.testing.assert_allclose(at(0.5, "rotation", [0, 1], [[0, 0, 0, 1], near]), (0, 5e-10, 0, 1), atol=1e-15)


def test_keys_of_any_length_are_rotations() -> None:
    value = at(0.5, "rotation", [0, 1], [[0, 0, 0, 3], [0, 5, 0, 0]])
    np.testing.assert_allclose(value, ABOUT_Y_90, atol=1e-12)


def test_channels_of_different_lengths_are_sampled_together() -> None:
    nodes = [posed(str(i)) for i in range(40)]
    channels = [
        Channel(node, "translation", np.arange(keys, dtype=float), np.arange(3.0 * keys).reshape(keys, 3) * 2)
        for keys, node in enumerate(nodes, start=1)
    ]
    Animation(channels).apply(5.5)
    for keys, node in enumerate(nodes, start=1):
        assert node.world[0, 3] == 6 * min(5.5, keys - 1)


def test_a_channel_leaves_the_other_parts_alone() -> None:
    node = Node(pose=Pose(np.array([1.0, 2, 3]), np.array(ABOUT_Y_90), np.array([2.0, 2, 2])))
    Animation([Channel(node, "translation", np.array([0.0]), np.array([[5.0, 0, 0]]))]).apply(0)
    np.testing.assert_allclose(node.transform, move(x=5) @ rotate("y", 90) @ stretch(2, 2, 2), atol=1e-12)


def sliding(node: Node, distance: float, name: str = "") -> Animation:
    return Animation([Channel(node, "translation", np.array([0.0, 1]), np.array([[0, 0, 0], [distance, 0, 0]]))], name)


def test_only_nodes_whose_value_changed_are_reported() -> None:
    scene = Scene()
    mover, waiter = scene.add(posed("mover")), scene.add(posed("waiter"))
    scene.add(Node("still"))
    scene.animations = [together([sliding(mover, 1), sliding(waiter, 0)])]
    changes = scene.subscribe()
    scene.animate(0.5)
    assert changes.take().moved == [mover]
    scene.animate(0.5)
    assert not changes.take().any()
    scene.animate(2)
    scene.animate(3)
    taken = changes.take()
    assert taken.moved == [mover] and taken.deformed == []


def test_animations_are_chosen_by_number_name_or_all_together() -> None:
    scene = Scene()
    first, second = scene.add(posed("first")), scene.add(posed("second"))
    scene.animations = [sliding(first, 1, "near"), sliding(first, 2, "far"), sliding(second, 3, "other")]
    scene.animate(1, 0)
    assert first.world[0, 3] == 1 and second.world[0, 3] == 0
    scene.animate(1, "far")
    assert first.world[0, 3] == 2 and second.world[0, 3] == 0
    first.transform = np.eye(4)
    scene.animate(1)
    assert first.world[0, 3] == 2 and second.world[0, 3] == 3
    scene.animations.append(sliding(second, 4))
    scene.animate(1)
    assert second.world[0, 3] == 4
    assert scene.animations[0].duration == 1
    for wrong in (4, -1, "walk"):
        with pytest.raises(SceneError, match=rf"no animation {wrong!r}; the scene has 0 'near', 1 'far'"):
            scene.animate(0, wrong)
    with pytest.raises(SceneError, match="time nan is not a number of seconds"):
        scene.animate(math.nan)


def test_a_scene_without_animations_stands_still() -> None:
    scene = Scene()
    scene.animate(1)
    with pytest.raises(SceneError, match="no animation 0; the scene has none"):
        scene.animate(1, 0)


def test_a_pose_that_is_assigned_places_the_node() -> None:
    node = Node(pose=Pose((1, 2, 3), ABOUT_Y_90, (2, 2, 2)))
    child = node.add(Node())
    np.testing.assert_allclose(child.world, move(1, 2, 3) @ rotate("y", 90) @ stretch(2, 2, 2), atol=1e-12)
    scene = Scene()
    scene.add(node)
    changes = scene.subscribe()
    node.pose = Pose((4, 5, 6))
    np.testing.assert_array_equal(child.world, move(4, 5, 6))
    assert set(changes.take().moved) == {node, child}
    node.pose = None
    np.testing.assert_array_equal(node.transform, move(4, 5, 6))


def test_a_node_placed_by_a_matrix_cannot_be_animated() -> None:
    with pytest.raises(SceneError, match="node 'fixed' is placed by a matrix"):
        sliding(Node("fixed"), 1)


def test_weights_move_vertices_and_are_reported() -> None:
    scene = Scene()
    section = triangle(morph_positions=floats([[[0, 0, 1]] * 3, [[2, 0, 0], [0] * 3, [0] * 3]]))
    node = scene.add(Node("shape", mesh=Mesh([section])))
    scene.add(Node("still", mesh=Mesh([section])))
    changes = scene.subscribe()
    node.weights = (0, 0)  # it has a shape of its own from now on
    taken = changes.take()
    assert taken.removed == taken.added == [node] and not taken.deformed and not changes.take().any()
    node.weights = (0, 0)
    assert changes.take().deformed == [node] and not changes.take().any()
    times, values = np.array([0.0, 2]), np.array([[0.0, 0], [1, 3]])
    scene.animations = [Animation([Channel(node, "weights", times, values)])]
    scene.animate(1)
    np.testing.assert_allclose(deform(section, node)[0], [[3, 0, 0.5], [1, 0, 0.5], [0, 1, 0.5]])
    taken = changes.take()
    assert taken.deformed == [node] and taken.moved == []
    scene.animate(1)
    assert not changes.take().any()
    np.testing.assert_allclose(scene.bounds(), [[0, 0, 0], [3, 1, 0.5]])
    with pytest.raises(SceneError, match="node 'shape': 3 weights for a mesh with 2 morph targets"):
        node.weights = (1, 2, 3)


def test_morphed_normals_and_tangents_are_unit_and_at_right_angles() -> None:
    section = triangle(
        morph_positions=np.zeros((1, 3, 3), np.float32),
        morph_normals=floats([[[1, 0, -1]] * 3]),
        morph_tangents=floats([[[0, 0, -1]] * 3]),
    )
    node = Node(mesh=Mesh([section]))
    node.weights = [0.5]  # normal (0.5, 0, 0.5) and tangent (1, 0, -0.5), which is then turned by a few degrees
    _, normals, tangents = deform(section, node)
    np.testing.assert_allclose(normals, [[HALF, 0, HALF]] * 3, atol=1e-7)
    np.testing.assert_allclose(tangents, [[HALF, 0, -HALF, -1]] * 3, atol=1e-7)


def limb() -> tuple[Scene, Node, Node, Node]:
    """A triangle on a hinge: its corner at the origin follows the upper joint, the other two the lower one."""
    scene = Scene()
    upper = scene.add(Node("body")).add(Node("upper"))
    upper.transform = move(z=5)
    lower = upper.add(Node("between")).add(Node("lower"))
    section = triangle(joints=np.array([[0], [1], [1]], np.uint16), weights=np.ones((3, 1), np.float32))
    node = scene.add(Node("skinned", mesh=Mesh([section])))
    node.skin = Skin([upper, lower], np.stack([np.eye(4)] * 2))
    return scene, upper, lower, node


def test_skinned_vertices_follow_their_joints_and_not_their_node() -> None:
    scene, upper, lower, node = limb()
    node.transform = move(x=100)
    lower.transform = rotate("x", 90)  # +Y becomes +Z
    positions, normals, tangents = deform(node.mesh.sections[0], node)
    np.testing.assert_allclose(positions, [[0, 0, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(normals, [[0, 0, 1], [0, -1, 0], [0, -1, 0]], atol=1e-12)
    np.testing.assert_allclose(tangents, [[1, 0, 0, -1]] * 3, atol=1e-12)
    assert node.skin.root is upper
    np.testing.assert_allclose(node.instance_transforms(), [move(z=5)])
    np.testing.assert_allclose(scene.bounds(), [[0, 0, 5], [1, 0, 6]], atol=1e-12)


def test_the_root_of_a_skin_is_the_closest_node_above_all_joints() -> None:
    random = np.random.default_rng(4)
    for _ in range(200):
        nodes = [Node(str(number)) for number in range(12)]
        for number in range(int(random.integers(1, 3)), 12):
            nodes[int(random.integers(max(number - 4, 0), number))].add(nodes[number])
        joints = [nodes[i] for i in random.choice(12, int(random.integers(1, 6)), replace=False)]
        skin = Skin(joints, np.stack([np.eye(4)] * len(joints)))
        lines = [line_of(joint) for joint in joints]
        common = [node for node in lines[0] if all(node in line for line in lines)]
        assert skin.root is (common[-1] if common else None)
        assert set(skin.links) == {node for line in lines for node in line} - set(common)
        for node in skin.links:
            assert node.parent not in skin.links or skin.links.index(node.parent) < skin.links.index(node)


def line_of(node: Node) -> list[Node]:
    """A node's ancestors from the top, and the node."""
    return [*([] if node.parent is None else line_of(node.parent)), node]


def test_a_skin_of_many_joints_in_a_row_takes_no_time() -> None:
    joints = [Node() for _ in range(20_000)]
    for upper, lower in pairwise(joints):
        upper.add(lower)
    start = process_time()
    skin = Skin(joints, np.zeros((len(joints), 4, 4)))
    assert process_time() - start < 1
    assert skin.root is joints[0] and skin.links == tuple(joints[1:])


def test_a_figure_that_moves_as_a_whole_is_moved_but_not_deformed() -> None:
    scene, upper, lower, node = limb()
    changes = scene.subscribe()
    scene.roots[0].transform = move(y=3)
    upper.transform = move(z=6)
    taken = changes.take()
    assert node in taken.moved and taken.deformed == []
    np.testing.assert_allclose(node.instance_transforms()[0], move(y=3, z=6))
    lower.parent.transform = move(x=1)
    taken = changes.take()
    assert taken.deformed == [node] and node not in taken.moved
    lower.transform = move(x=1)
    assert changes.take().deformed == [node]


def test_joints_without_a_common_ancestor_place_vertices_in_the_world() -> None:
    scene = Scene()
    first, second = scene.add(Node("first")), scene.add(Node("second"))
    section = triangle(joints=np.array([[0], [1], [1]], np.uint16), weights=np.ones((3, 1), np.float32))
    node = scene.add(Node(mesh=Mesh([section])))
    node.skin = Skin([first, second], np.stack([np.eye(4)] * 2))
    changes = scene.subscribe()
    second.transform = move(x=7)
    np.testing.assert_allclose(deform(section, node)[0], [[0, 0, 0], [8, 0, 0], [7, 1, 0]])
    np.testing.assert_array_equal(node.instance_transforms(), [np.eye(4)])
    assert changes.take().deformed == [node]


def test_normals_stay_at_right_angles_to_stretched_surfaces() -> None:
    _, _, lower, node = limb()
    section = node.mesh.sections[0]
    section.positions = floats([[0, 0, 0], [1, 0, 1], [0, 1, 1]])
    section.normals = floats([[-1, -1, 1]] * 3) / np.float32(math.sqrt(3))
    section.joints = np.ones_like(section.joints)
    lower.transform = stretch(2, 1, 1)  # the slope along X is now half as steep
    positions, normals, _ = deform(section, node)
    np.testing.assert_allclose(normals, [np.array((-1, -2, 2)) / 3] * 3, atol=1e-7)
    np.testing.assert_allclose(np.cross(positions[1] - positions[0], positions[2] - positions[0]), (-1, -2, 2))


def test_flat_normals_follow_the_bent_face() -> None:
    _, _, lower, node = limb()
    section = node.mesh.sections[0]
    section.flat = True
    lower.transform = rotate("x", 90)
    normals = deform(section, node)[1]
    np.testing.assert_allclose(normals, [[0, -1, 0]] * 3, atol=1e-7)


def test_morphing_comes_before_skinning() -> None:
    _, _, lower, node = limb()
    node.mesh.sections[0].morph_positions = floats([[[0, 0, 0], [0, 0, 0], [0, 1, 0]]])
    node.weights = [1]
    lower.transform = rotate("x", 90)
    np.testing.assert_allclose(deform(node.mesh.sections[0], node)[0][2], (0, 0, 2), atol=1e-12)


def test_vertices_collapsed_to_a_point_keep_finite_frames() -> None:
    _, _, lower, node = limb()
    lower.transform = stretch(0, 0, 0)
    positions, normals, tangents = deform(node.mesh.sections[0], node)
    np.testing.assert_array_equal(positions, np.zeros((3, 3)))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    np.testing.assert_allclose(np.linalg.norm(tangents[:, :3], axis=1), 1)


def test_taking_vertices_takes_all_that_belongs_to_them() -> None:
    section = triangle(
        joints=np.array([[0, 1], [2, 3], [4, 5]], np.uint16),
        weights=floats([[1, 0], [0.5, 0.5], [0, 1]]),
        morph_positions=np.arange(18, dtype=np.float32).reshape(2, 3, 3),
    )
    taken = section.take(np.array([2, 0]), np.array([[0, 1, 0]], np.uint32))
    np.testing.assert_array_equal(taken.positions, [[0, 1, 0], [0, 0, 0]])
    np.testing.assert_array_equal(taken.joints, [[4, 5], [0, 1]])
    np.testing.assert_array_equal(taken.weights, [[0, 1], [1, 0]])
    np.testing.assert_array_equal(taken.morph_positions[:, :, 0], [[6, 0], [15, 9]])
    np.testing.assert_array_equal(taken.indices, [[0, 1, 0]])
    assert taken.morph_normals is None and taken.material is section.material
    assert all(len(getattr(taken, name)) == 2 for name in ("normals", "tangents", "uv0", "uv1", "colors"))
