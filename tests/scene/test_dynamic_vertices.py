"""Vertices that the user sets: what is taken, and which normals and tangents follow."""

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.model import Node, Scene
from pica.scene.skin import deform
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import rotate
from tests.building import lambert, placed


@pytest.mark.parametrize("section", [plane(2, 1, lambert(), 5), sphere(1.0, lambert(), 16), box(1.0, lambert())])
def test_turned_vertices_have_turned_normals_and_tangents(section):
    node = placed(section)
    dynamic = pica.DynamicVertices(node)
    rotation = (rotate("y", 70) @ rotate("x", 100))[:3, :3]
    dynamic.set(section.positions @ rotation.T)
    positions, normals, tangents = deform(node.mesh.sections[0], node)
    np.testing.assert_allclose(positions, section.positions @ rotation.T, atol=1e-6)
    # A faceted sphere's own normals are its centre's; those that follow triangles are nearly so.
    np.testing.assert_allclose(normals, section.normals @ rotation.T, atol=0.12)
    assert np.median(np.sum(tangents[:, :3] * (section.tangents[:, :3] @ rotation.T), axis=1)) > 0.999
    np.testing.assert_allclose(np.sum(normals * tangents[:, :3], axis=1), 0, atol=1e-6)
    np.testing.assert_array_equal(tangents[:, 3], section.tangents[:, 3])


def test_normals_are_smooth_across_a_seam_and_sharp_at_an_edge():
    """A sphere's first and last column of vertices coincide; a box's edges keep the normals of their faces."""
    round_node = placed(sphere(1.0, lambert(), 12))
    section = round_node.mesh.sections[0]
    dynamic = pica.DynamicVertices(round_node)
    dynamic.set(section.positions * (1, 1.5, 0.7))
    normals = deform(round_node.mesh.sections[0], round_node)[1]
    places, group = np.unique(section.positions.round(4), axis=0, return_inverse=True)
    assert len(places) < len(section.positions)
    sums = np.zeros((len(places), 3))
    np.add.at(sums, group.reshape(-1), normals)
    counts = np.bincount(group.reshape(-1))
    np.testing.assert_allclose(np.linalg.norm(sums, axis=1), counts, rtol=1e-4)
    cube = placed(box(1.0, lambert()))
    faces = cube.mesh.sections[0].normals
    dynamic = pica.DynamicVertices(cube)
    dynamic.set(dynamic.positions * 2)
    np.testing.assert_allclose(deform(cube.mesh.sections[0], cube)[1], faces, atol=1e-6)


def test_sections_take_their_rows_and_samples_of_them_theirs():
    node = placed([plane(1, 1, lambert(), 2), plane(2, 2, lambert(), 3)])
    shared = node.mesh
    dynamic = pica.DynamicVertices(node)
    first, second = (len(section.positions) for section in shared.sections)
    places = np.random.default_rng(1).normal(size=(first + second, 3))
    dynamic.set(places)
    np.testing.assert_allclose(deform(node.mesh.sections[1], node)[0], places[first:], atol=1e-6)
    sample = node.mesh.sections[1].take(np.array([3, 0]), np.array([[0, 1, 1]], np.uint32))
    np.testing.assert_allclose(deform(sample, node)[0], places[[first + 3, first]], atol=1e-6)
    assert shared.sections[0].rows is None, "the mesh that others may show is as it was"


def test_the_array_is_copied():
    node = placed(plane(1, 1, lambert(), 2))
    dynamic = pica.DynamicVertices(node)
    places = dynamic.positions.copy()
    dynamic.set(places)
    places[:] = 7
    assert not (dynamic.positions == 7).any()


@pytest.mark.parametrize(
    ("positions", "normals", "words"),
    [
        (np.zeros((3, 3)), None, r"\(3, 3\).*give \(9, 3\)"),
        (np.zeros((9, 2)), None, r"\(9, 2\)"),
        ([[0, 0], [1]], None, "positions"),
        (np.full((9, 3), np.nan), None, "row 0 .*finite"),
        (np.full((9, 3), np.inf), None, "finite"),
        (np.ones((9, 3)), np.zeros((9, 3)), "length"),
        (np.ones((9, 3)), np.full((9, 3), np.nan), "normals.*finite"),
    ],
)
def test_what_does_not_fit_is_an_error_and_changes_nothing(positions, normals, words):
    node = placed(plane(1, 1, lambert(), 2), name="sail")
    dynamic = pica.DynamicVertices(node)
    changes = Scene()
    changes.add(node)
    heard = changes.subscribe()
    before, version = dynamic.positions, dynamic.version
    with pytest.raises(SceneError, match=words) as error:
        dynamic.set(positions, normals)
    assert "'sail'" in str(error.value) and "\n" not in str(error.value)
    assert dynamic.positions is before and dynamic.version == version and not heard.take().deformed


def test_nodes_that_cannot_have_them():
    with pytest.raises(SceneError, match="triangles"):
        pica.DynamicVertices(Node("empty"))
    node = placed(plane(1, 1, lambert(), 2))
    pica.DynamicVertices(node)
    with pytest.raises(SceneError, match="already"):
        pica.DynamicVertices(node)
