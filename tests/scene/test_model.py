"""Nodes, scenes and cameras."""

import math

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.camera import Camera
from pica.scene.light import PointLight, SphereLight
from pica.scene.material import Material
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box
from pica.scenes.placing import mesh, move, rotate, stretch


def cube(name="cube", **parts):
    return Node(name, mesh=mesh(name, [box(1, Material())]), **parts)


def test_world_is_parent_times_local_and_follows_moves():
    parent, child = Node("parent"), Node("child")
    parent.add(child)
    child.transform = move(x=1)
    parent.transform = rotate("y", 90)
    np.testing.assert_allclose(child.world[:3, 3], (0, 0, -1), atol=1e-12)
    parent.transform = move(y=2)
    np.testing.assert_allclose(child.world[:3, 3], (1, 2, 0), atol=1e-12)


def test_a_moved_subtree_is_reported_once_and_then_forgotten():
    scene = Scene()
    parent = scene.add(Node("parent"))
    child, other = parent.add(Node("child")), scene.add(Node("other"))
    changes = scene.subscribe()
    parent.transform = move(x=1)
    parent.transform = move(x=2)
    assert [node.name for node in changes.take().moved] == ["parent", "child"]
    assert not changes.take().any()
    other.transform = move(x=1)
    child.transform = move(x=1)
    assert {node.name for node in changes.take().moved} == {"other", "child"}


def test_nodes_added_later_report_too_and_subscribers_do_not_share():
    scene = Scene()
    root = scene.add(Node("root"))
    first, second = scene.subscribe(), scene.subscribe()
    late = root.add(Node("late"))
    late.transform = move(x=1)
    assert [node.name for node in first.take().moved] == ["late"]
    assert [node.name for node in second.take().moved] == ["late"]


def test_what_comes_and_goes_is_reported_with_all_below_it():
    scene = Scene()
    root = scene.add(Node("root"))
    changes = scene.subscribe()
    branch = root.add(Node("branch"))
    leaf = branch.add(Node("leaf"))
    assert changes.take().added == [branch, leaf]
    leaf.transform = move(x=1)
    scene.remove(branch)
    taken = changes.take()
    assert taken.removed == [branch, leaf] and taken.moved == [] and root.children == ()
    root.add(branch)
    scene.remove(branch)
    assert not changes.take().any()
    scene.add(branch)
    scene.remove(branch)
    scene.add(branch)
    taken = changes.take()
    assert taken.added == [branch, leaf] and taken.removed == []
    with pytest.raises(SceneError, match="stranger"):
        scene.remove(Node("stranger"))


def test_a_transform_is_a_copy_of_what_was_assigned():
    node, matrix = Node(), np.eye(4)
    node.transform = matrix
    matrix[0, 3] = 5
    assert node.world[0, 3] == 0


def test_nodes_come_parents_first():
    scene = Scene()
    a = scene.add(Node("a"))
    b = a.add(Node("b"))
    b.add(Node("c"))
    a.add(Node("d"))
    scene.add(Node("e"))
    assert [node.name for node in scene.nodes()] == ["a", "b", "c", "d", "e"]


def test_bounds_take_in_copies_and_rotation():
    scene = Scene()
    node = scene.add(cube())
    node.transform = rotate("y", 45) @ stretch(2, 1, 1)
    low, high = scene.bounds()
    # Half the width of a 2 x 1 rectangle turned by 45 degrees: (1 + 0.5) / sqrt 2.
    np.testing.assert_allclose(high, (1.5 / math.sqrt(2), 0.5, 1.5 / math.sqrt(2)), rtol=1e-6)
    np.testing.assert_allclose(low, -high, rtol=1e-6)
    node.transform = np.eye(4)
    node.instances = np.stack([move(x=-3), move(x=4)])
    low, high = scene.bounds()
    np.testing.assert_allclose((low[0], high[0]), (-3.5, 4.5))


def test_bounds_ignore_vertices_that_no_triangle_uses():
    scene = Scene()
    node = scene.add(cube())
    section = node.mesh.sections[0]
    moved = section.positions.copy()
    moved[section.indices[:2].ravel()] += 100  # move one face away, then drop its triangles
    section.positions = moved
    section.indices = section.indices[2:]
    assert scene.bounds()[1].max() < 1


def test_an_empty_scene_has_a_unit_box_and_a_camera():
    low, high = Scene().bounds()
    np.testing.assert_allclose((low, high), ((-0.5,) * 3, (0.5,) * 3))
    assert Scene().default_camera(1.5).vertical_fov > 0


def test_triangles_are_counted_over_all_copies():
    scene = Scene()
    scene.add(cube())
    scene.add(cube(instances=np.stack([np.eye(4)] * 3)))
    assert scene.triangle_count() == 4 * 12


def test_cameras_take_their_nodes_place_without_its_scale():
    scene = Scene()
    parent = scene.add(Node("parent"))
    parent.transform = move(1, 2, 3) @ rotate("y", 90) @ stretch(2, 2, 2)
    parent.add(Node("camera", camera=Camera(np.eye(4), name="eye")))
    (camera,) = scene.cameras()
    np.testing.assert_allclose(camera.transform, move(1, 2, 3) @ rotate("y", 90), atol=1e-12)
    assert scene.default_camera(1.0).name == "eye"


def test_look_at_sees_the_target_upright():
    camera = Camera.look_at((1, 2, 3), (4, 0, -2), vertical_fov=math.radians(50))
    toward = np.array((3, -2, -5)) / np.linalg.norm((3, -2, -5))
    np.testing.assert_allclose(-camera.transform[:3, 2], toward, atol=1e-12)
    assert camera.transform[1, 0] == pytest.approx(0) and camera.transform[1, 1] > 0
    assert np.linalg.det(camera.transform[:3, :3]) == pytest.approx(1)
    assert camera.vertical_fov == pytest.approx(math.radians(50))


@pytest.mark.parametrize("target", [(0, 5, 0), (0, -5, 0)])
def test_look_at_works_straight_up_and_down(target):
    camera = Camera.look_at((0, 0, 0), target)
    np.testing.assert_allclose(camera.transform[:3, :3] @ camera.transform[:3, :3].T, np.eye(3), atol=1e-12)


def test_look_at_refuses_what_shows_nothing():
    with pytest.raises(SceneError, match="same point"):
        Camera.look_at((1, 1, 1), (1, 1, 1))
    for fov in (0, math.pi, 45, -1):
        with pytest.raises(SceneError, match=r"vertical_fov: .* radians"):
            Camera.look_at((0, 0, 0), (1, 1, 1), vertical_fov=fov)


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_framing_shows_the_whole_box(aspect):
    low, high = np.array((-1.0, 0.0, -3.0)), np.array((2.0, 1.0, 0.5))
    camera = Camera.framing(low, high, aspect=aspect)
    corners = np.array([[x, y, z] for x in (-1, 2) for y in (0, 1) for z in (-3, 0.5)])
    seen = (corners - camera.transform[:3, 3]) @ camera.transform[:3, :3]
    assert (seen[:, 2] < -camera.near).all()
    reach = math.tan(camera.vertical_fov / 2)
    assert (np.abs(seen[:, 1]) <= -seen[:, 2] * reach).all()
    assert (np.abs(seen[:, 0]) <= -seen[:, 2] * reach * aspect).all()


def test_what_is_set_on_a_node_is_told_once() -> None:
    scene = Scene()
    node, other = scene.add(Node("node", light=PointLight())), scene.add(Node("other", visible_to_camera=False))
    changes = scene.subscribe()
    assert not changes.take().any(), "what a constructor sets is no change"
    node.visible_to_camera = False
    node.lighting_channels = {1, 2}
    node.light = SphereLight(lighting_channels=(3,))
    other.casts_shadows = False
    taken = changes.take()
    assert taken.altered == [node, other] and taken.any() and not taken.moved
    assert node.lighting_channels == frozenset({1, 2}) and node.light.lighting_channels == frozenset({3})
    assert (other.visible_to_camera, other.visible_to_reflections) == (False, True)
    node.light = None
    scene.remove(node)
    assert changes.take().altered == []
    node.casts_shadows = False
    assert not changes.take().any(), "it is in no scene any more"


@pytest.mark.parametrize("wrong", [{6}, [-1], 3, None, ["0"], [0.5]])
def test_channels_that_there_are_not_are_an_error_of_one_line(wrong: object) -> None:
    with pytest.raises(SceneError, match=r"^lighting channels .* 0 to 5$"):
        Node().lighting_channels = wrong
    with pytest.raises(SceneError, match=r"^lighting channels .* 0 to 5$"):
        PointLight(lighting_channels=wrong)
