"""Properties of what is selected: nodes, lights, materials; the tree; what hides nodes."""

import numpy as np
import pytest

import pica
from pica.scene.animation import Pose
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from pica.viewer.edits import Edits
from pica.viewer.euler import euler_of, pose_of, quaternion_of
from pica.viewer.properties import property_groups
from pica.viewer.tree import tree_lines
from pica.viewer.visibility import Visibility
from tests.building import lambert, placed, scene_of


def properties(node, *materials, visibility=None):
    groups = property_groups(node, materials, visibility or Visibility())
    return {each.label: each for group in groups for each in group.properties}


def change(found, label, value):
    Edits().apply(found[label].changes(value))
    return found[label].read()


@pytest.mark.parametrize(
    "degrees", [(10, 20, 30), (-170, 45, 90), (0, 0, 0), (30, 90, 0), (30, -90, 0), (12, 89.99, 5)]
)
def test_angles_go_over_and_back(degrees):
    matrix = Pose(rotation=quaternion_of(degrees)).matrix()[:3, :3]
    np.testing.assert_allclose(euler_of(matrix), degrees, atol=1e-5)


def test_rotation_is_about_x_first():
    turned = Pose(rotation=quaternion_of((90, 0, 90))).matrix()
    np.testing.assert_allclose(turned[:3, :3] @ (0, 1, 0), (0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(turned[:3, :3] @ (1, 0, 0), (0, 1, 0), atol=1e-12)


def test_matrices_are_taken_apart_unless_sheared():
    pose = Pose(np.array([1.0, 2, 3]), quaternion_of((10, 20, 30)), np.array([-1.0, 2, 3]))
    np.testing.assert_allclose(pose_of(pose.matrix()).matrix(), pose.matrix(), atol=1e-12)
    sheared = np.eye(4)
    sheared[0, 1] = 0.1
    assert pose_of(sheared) is None and pose_of(np.diag([1.0, 0, 1, 1])) is None
    assert properties(_at(sheared)) == {}


def _at(matrix):
    node = pica.Node("n")
    node.transform = matrix
    return node


def test_a_node_is_placed_by_its_parts_with_and_without_a_pose():
    for node in (_at(move(1, 2, 3)), pica.Node("n", pose=Pose(np.array([1.0, 2, 3])))):
        found = properties(node)
        assert found["Translation"].read() == (1, 2, 3)
        assert change(found, "Translation", (4, 5, 6)) == (4, 5, 6)
        assert change(found, "Rotation", (0, 90, 0)) == (0, 90, 0)
        assert change(found, "Scale", (1, 2, 1)) == (1, 2, 1)
        np.testing.assert_allclose(node.world @ (1, 1, 0, 1), (4, 7, 5, 1), atol=1e-12)
        with pytest.raises(pica.SceneError):
            change(found, "Translation", (np.nan, 0, 0))


def test_a_pose_that_is_out_of_date_does_not_count():
    node = pica.Node("n", pose=Pose())
    node.transform = move(0, 1, 0)
    assert properties(node)["Translation"].read() == (0, 1, 0)


@pytest.mark.parametrize(
    ("light", "label", "field"),
    [
        (pica.DirectionalLight(illuminance=3.0), "Illuminance", "illuminance"),
        (pica.PointLight(intensity=3.0), "Intensity", "intensity"),
        (pica.DiskLight(radiance=3.0), "Radiance", "radiance"),
    ],
)
def test_lights_have_a_colour_and_a_strength(light, label, field):
    node = pica.Node("lamp", light=light)
    found = properties(node)
    assert found[label].read() == 3.0 and change(found, label, 5) == 5.0 and getattr(node.light, field) == 5.0
    assert found["Colour"].read() == (255, 255, 255)
    assert change(found, "Colour", (255, 128, 0)) == (255, 128, 0)
    np.testing.assert_allclose(node.light.color, (1, 0.21586, 0), atol=1e-4)


def test_materials_keep_their_alpha_and_the_radiance_they_emit():
    material = pica.Material(base_color=(1, 1, 1, 0.5), metallic=0.0)
    found = properties(pica.Node("n"), material)
    assert change(found, "Base colour", (0, 255, 128)) == (0, 255, 128)
    assert material.base_color[3] == 0.5 and material.base_color[1] == 1.0
    assert change(found, "Roughness", 0.25) == 0.25 == material.roughness
    assert change(found, "Metallic", 1) == 1.0
    assert found["Emitted radiance"].read() == 0 and found["Emission"].read() == (255, 255, 255)
    assert change(found, "Emitted radiance", 8.0) == 8.0
    assert material.emission == (8, 8, 8)
    assert change(found, "Emission", (128, 0, 0)) == (255, 0, 0)
    np.testing.assert_allclose(material.emission, (8, 0, 0))
    change(found, "Emission", (0, 0, 0))
    assert max(material.emission) == 0
    textured = pica.Material(base_color_texture=pica.Texture.from_array(np.ones((1, 1)), encoding="srgb"))
    assert "texture" in properties(pica.Node("n"), textured)["Base colour"].hint


@pytest.fixture
def group() -> pica.Node:
    """A node with a mesh that casts no shadow and a lamp below it."""
    above = pica.Node("above")
    above.add(placed(box(1, lambert()), name="box")).casts_shadows = False
    above.add(pica.Node("lamp", light=pica.PointLight()))
    return above


def test_hidden_nodes_come_back_as_they_were(group):
    visibility, edits = Visibility(), Edits()
    cube, lamp = group.children
    light = lamp.light
    edits.apply(visibility.changes(group, False))
    assert (cube.visible_to_camera, cube.visible_to_reflections, lamp.light) == (False, False, None)
    assert visibility.shows(group) is False and visibility.shows(lamp) is False
    edits.undo()
    assert visibility.shows(group) and lamp.light is light
    edits.redo()
    edits.apply(visibility.changes(lamp, True))
    assert lamp.light is light and not visibility.shows(cube) and visibility.shows(group)
    edits.apply(visibility.changes(group, True))
    assert cube.visible_to_camera and not cube.casts_shadows
    assert visibility.shows(pica.Node("empty")) is None


def test_what_a_file_has_hidden_can_be_shown():
    node = placed(box(1, lambert()))
    node.visible_to_camera = node.casts_shadows = False
    Edits().apply(Visibility().changes(node, True))
    assert node.visible_to_camera and node.casts_shadows


def test_the_tree_has_distinct_lines_each_below_its_parent(group):
    scene = scene_of(group, pica.Node("box"), pica.Node("box"), pica.Node())
    lines = tree_lines(scene)
    assert [line.replace("\u2003", ">") for line in lines] == [
        *("above", ">box", ">lamp", "box", "box (2)", "(no name)"),
    ]
    assert list(lines.values()) == list(scene.nodes())
    assert len(tree_lines(scene, most=3)) == 3
