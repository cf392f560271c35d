"""Who is below whom, and in which scene: one place for each node."""

import copy
import pickle
from itertools import pairwise

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import SphereLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move


def chain(length: int) -> list[Node]:
    nodes = [Node(f"node {i}") for i in range(length)]
    for above, below in pairwise(nodes):
        above.add(below)
    return nodes


@pytest.mark.parametrize("above", [0, 1, 4])
def test_no_node_is_below_itself(above):
    nodes = chain(5)
    with pytest.raises(SceneError, match=rf"^node 'node 4': add: node 'node {above}'"):
        nodes[4].add(nodes[above])
    assert nodes[4].children == () and nodes[0].parent is None
    assert [node.name for node in nodes[0].walk()] == [node.name for node in nodes]


def test_no_node_is_its_own_child_when_it_has_none():
    node = Node("alone")
    with pytest.raises(SceneError, match=r"node 'alone': add: node 'alone' is this node, or above it"):
        node.add(node)
    assert list(node.walk()) == [node]


def test_no_node_has_two_parents():
    first, second, child = Node("first"), Node("second"), Node("child")
    first.add(child)
    for above in (first, second):
        with pytest.raises(SceneError, match=r"add: node 'child' is below node 'first' already; a node has one parent"):
            above.add(child)
    with pytest.raises(SceneError, match=r"^scene 'a': add: node 'child' is below node 'first'"):
        Scene("a").add(child)
    assert child.parent is first and first.children == (child,) and second.children == ()


def test_no_node_is_in_two_scenes_or_twice_in_one():
    first, second, node = Scene("first"), Scene("second"), Node("node")
    child = node.add(Node("child"))
    first.add(node)
    changes = first.subscribe()
    for scene in (first, second):
        with pytest.raises(SceneError, match=r"add: node 'node' is in a scene already; remove it there first"):
            scene.add(node)
    with pytest.raises(SceneError, match=r"node 'other': add: node 'node' is in a scene already"):
        second.add(Node("other")).add(node)
    with pytest.raises(SceneError, match=r"node 'child': add: node 'node'"):
        child.add(node)
    assert first.roots == (node,) and [root.name for root in second.roots] == ["other"] and not changes.take().any()
    first.remove(node)
    assert second.add(node) is node and node in second and child in second and node not in first
    with pytest.raises(SceneError, match=r"remove: node 'node' is not in the scene"):
        first.remove(node)
    second.remove(node)
    assert not list(first.nodes()) and [each.name for each in second.nodes()] == ["other"]


def test_a_scene_that_nobody_has_any_more_keeps_nothing():
    node = Node("node")
    Scene("dropped").add(node)
    scene = Scene("kept")
    scene.add(node)
    scene.remove(node)


def test_a_node_that_was_taken_out_stands_where_its_own_matrix_says():
    scene = Scene()
    parent, child = scene.add(Node("parent")), Node("child")
    parent.transform = move(x=5)
    parent.add(child)
    assert child.world[0, 3] == 5
    scene.remove(child)
    assert child.world[0, 3] == 0
    scene.add(child)
    assert child.world[0, 3] == 0


def test_deep_trees_are_built_from_either_end():
    nodes = chain(20_000)
    assert sum(1 for _ in nodes[0].walk()) == 20_000
    assert Scene().add(nodes[0]) is nodes[0]
    assert nodes[-1].world.tolist() == np.eye(4).tolist()


@pytest.mark.parametrize("stranger", [None, "node", 3, Scene(), Mesh()])
def test_only_nodes_are_added_and_removed(stranger):
    for add in (Node("above").add, Scene("scene").add, Scene("scene").remove):
        with pytest.raises(SceneError, match=r"(above|scene|remove).* is not a Node"):
            add(stranger)


def test_children_and_parents_are_set_by_add_alone():
    for name in ("children", "parent"):
        with pytest.raises(SceneError, match=f"no field '{name}'"):
            Node(**{name: None})


def test_places_that_nobody_has_set_and_copies_are_read_only_too():
    scene = Scene("original")
    scene.environment = Environment(np.ones((2, 4, 3)))
    ball = scene.add(Node("ball", camera=Camera(np.eye(4)), mesh=Mesh([box(1, Material())]), instances=np.eye(4)[None]))
    ball.add(Node("below"))
    for twin in (scene, copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        for node in twin.nodes():
            section = twin.roots[0].mesh.sections[0]
            for array in (
                node.transform, node.world, twin.roots[0].instances, twin.roots[0].camera.transform,
                section.positions, section.indices, twin.environment.radiance,
            ):  # fmt: skip
                with pytest.raises(ValueError, match="read-only"):
                    array[...] = 0


def test_copies_of_scenes_are_scenes_of_their_own():
    scene = Scene("original")
    node = scene.add(Node("node", mesh=Mesh([box(1, Material())])))
    scene.subscribe()
    for twin in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        (other,) = twin.roots
        changes, heard = scene.subscribe(), twin.subscribe()
        other.transform = move(x=1)
        assert heard.take().moved == [other] and not changes.take().any() and node.world[0, 3] == 0
        with pytest.raises(SceneError, match=r"in a scene already"):
            Scene().add(other)
        twin.remove(other)


def test_places_too_far_for_the_device_name_their_node():
    top = Node("top")
    top.transform = np.diag([1e30, 1e30, 1e30, 1])
    middle = top.add(Node("middle"))
    middle.transform = top.transform
    low = middle.add(Node("low", mesh=Mesh([box(3, Material())])))
    scene = Scene()
    scene.add(top)
    for check in (low.check, scene.bounds):
        with pytest.raises(SceneError, match=r"^node 'low': its place in the world is too large for 32-bit floats"):
            check()
    middle.transform = np.eye(4)
    assert scene.bounds()[1][0] == pytest.approx(1.5e30)
    top.transform = np.diag([3e38, 1, 1, 1])
    with pytest.raises(SceneError, match=r"^node 'low': its mesh is too large in the world"):
        scene.default_camera(1)


def test_what_was_written_into_arrays_since_is_found():
    scene = Scene()
    node = scene.add(Node("node", mesh=Mesh([box(1, Material())], "cube")))
    section = node.mesh.sections[0]
    positions, indices = section.positions.copy(), section.indices.copy()
    section.positions, section.indices = positions, indices
    positions[3, 1] = np.nan
    with pytest.raises(SceneError, match=r"^mesh 'cube': part 0: section: positions: row 3 is not finite"):
        scene.bounds()
    positions[3, 1] = 0
    indices[2, 0] = 99
    with pytest.raises(SceneError, match=r"^mesh 'cube': part 0: section: indices: row 2 names vertex 99 of 24"):
        scene.default_camera(1)
    indices[2, 0] = 0
    node.instances = instances = np.tile(np.eye(4), (2, 1, 1))
    instances[1, 0, 3] = np.inf
    with pytest.raises(SceneError, match=r"^node 'node': instances: in the world: row 1 is not finite"):
        scene.check()
    node.place_instances(np.eye(4)[None])
    scene.check()


def test_lights_that_their_nodes_make_too_large_name_the_node():
    scene = Scene()
    node = scene.add(Node("lamp", light=SphereLight(radius=1e15)))
    scene.check()
    node.transform = np.diag([1e6, 1, 1, 1])
    with pytest.raises(SceneError, match=r"^node 'lamp': light: with the node's scale it is too large"):
        scene.check()


def test_a_camera_of_a_flat_node_still_looks_somewhere():
    scene = Scene()
    node = scene.add(Node("eye", camera=Camera(np.eye(4))))
    node.transform = np.diag([0.0, 0, 0, 1])
    axes = scene.cameras()[0].transform[:3, :3]
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)


def test_identities_weights_and_joints_go_with_what_they_are_of():
    node = Node("node", mesh=Mesh([box(1, Material())]))
    with pytest.raises(SceneError, match=r"node 'node': identities: 3 for 2 instances"):
        node.place_instances(np.tile(np.eye(4), (2, 1, 1)), np.arange(3))
    assert node.instances is None
    with pytest.raises(SceneError, match=r"node 'node': 1 weights for a mesh with 0 morph targets"):
        node.weights = [0.5]
    with pytest.raises(SceneError, match=r"node 'node': weights: has the shape"):
        node.weights = [[0.5]]
