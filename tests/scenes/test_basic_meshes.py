"""The shapes that scenes made in code are made of: closed, with normals and tangents that fit."""

import math

import numpy as np
import pytest

import pica
from pica.scene.material import Material
from pica.scenes import basic_meshes as shapes
from pica.scenes.placing import at, copied, mesh, move, place, rotate, stretch

CLAY = Material("clay")

# Closed shapes with their exact volume in cubic metres; None where rounding makes it awkward.
CLOSED = {
    "box": (shapes.box((1, 2, 3), CLAY), 6.0),
    "bevelled box": (shapes.box((1, 2, 3), CLAY, bevel=0.1, segments=12), None),
    "cylinder": (shapes.cylinder(1, 2, CLAY, segments=256), 2 * math.pi),
    "rounded cylinder": (shapes.cylinder(1, 2, CLAY, fillet=0.1), None),
    "capsule": (shapes.cylinder(0.5, 2, CLAY, fillet=0.5, segments=256), math.pi * (0.25 + 4 / 3 * 0.125)),
    "sphere": (shapes.sphere(1, CLAY, segments=256), 4 / 3 * math.pi),
    "cone": (shapes.frustum(1, 0, 1, CLAY, segments=256), math.pi / 3),
    "frustum": (shapes.frustum(1, 0.5, 1, CLAY, segments=256), math.pi / 3 * 1.75),
    "torus": (shapes.torus(1, 0.25, CLAY, segments=256), 2 * math.pi**2 * 0.0625),
    "ring": (shapes.ring(0.5, 1, 1, CLAY, segments=256), math.pi * 0.75),
    "plate": (shapes.plate((4, 0.2, 3), 0.5, CLAY, segments=256), 0.2 * (12 - (4 - math.pi) * 0.25)),
    "pipe": (shapes.pipe([(0, 0, 0), (0, 2, 0)], 0.1, CLAY, segments=256), 0.02 * math.pi),
    "bent pipe": (shapes.pipe(shapes.filleted([(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 1, 1)], 0.3)[0], 0.1, CLAY), None),
}
ALL = {name: section for name, (section, _) in CLOSED.items()} | {
    "plane": shapes.plane(1, 2, CLAY, cells=3),
    "mirrored box": at(shapes.box(1, CLAY, bevel=0.2), stretch(-1, 1, 1)),
    "stretched, turned torus": at(shapes.torus(1, 0.3, CLAY, segments=96), rotate("x", 30), stretch(1, 2, 1.5)),
}


def corners(section):
    """(triangles, 3, 3) positions."""
    return section.positions[section.indices].astype(np.float64)


def face_normals(section):
    a, b, c = corners(section).transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def volume(section):
    """Signed: positive when the faces look outwards (divergence theorem)."""
    a, b, c = corners(section).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6


@pytest.mark.parametrize("name", CLOSED)
def test_closed_shapes_enclose_their_volume(name):
    section, expected = CLOSED[name]
    if expected is None:
        assert volume(section) > 0
    else:
        assert volume(section) == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("name", CLOSED)
def test_closed_shapes_have_no_holes(name):
    section, _ = CLOSED[name]
    _, points = np.unique(np.round(section.positions, 5), axis=0, return_inverse=True)
    faces = points.ravel()[section.indices]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = {(int(a), int(b)) for a, b in edges}
    assert len(there) == len(edges)
    assert {(b, a) for a, b in there} == there


@pytest.mark.parametrize("name", ALL)
def test_normals_and_tangents_fit_the_faces(name):
    section = ALL[name]
    normals, tangents = section.normals, section.tangents[:, :3]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1, atol=1e-5)
    faces = face_normals(section)  # a corner rounded in one step is 45 degrees off
    assert (np.einsum("tvi,ti->tv", normals[section.indices], faces) > 0.65).all()


@pytest.mark.parametrize("name", ALL)
def test_tangents_follow_the_texture_coordinates(name):
    """The tangent leads to growing u; the bitangent, cross(normal, tangent) * w, up the picture, to falling v."""
    section = ALL[name]
    positions, uv = corners(section), section.uv0[section.indices].astype(np.float64)
    edges, steps = positions[:, 1:] - positions[:, :1], uv[:, 1:] - uv[:, :1]
    gradient = np.linalg.inv(steps) @ edges  # rows: d position / du, d position / dv
    gradient /= np.linalg.norm(gradient, axis=2, keepdims=True)
    tangents, normals = section.tangents[section.indices].mean(1), section.normals[section.indices].mean(1)
    bitangents = np.cross(normals, tangents[:, :3]) * tangents[:, 3:]
    assert (np.einsum("ij,ij->i", gradient[:, 0], tangents[:, :3]) > 0.4).all()
    assert (np.einsum("ij,ij->i", -gradient[:, 1], bitangents) > 0.4).all()


def test_stretched_shapes_keep_normals_at_right_angles():
    ellipsoid = at(shapes.sphere(1, CLAY), rotate("z", 30), stretch(1, 3, 0.5))
    local = ellipsoid.positions @ rotate("z", 30)[:3, :3]
    gradient = (local / np.array((1, 9, 0.25))) @ rotate("z", 30)[:3, :3].T
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(ellipsoid.normals, gradient, atol=1e-4)


def test_flat_boxes_have_flat_normals_and_bevelled_ones_keep_their_size():
    flat, round_box = shapes.box((1, 2, 3), CLAY), shapes.box((1, 2, 3), CLAY, bevel=0.2)
    assert len(flat.indices) == 12
    assert set(np.abs(flat.normals).sum(1)) == {1.0}
    np.testing.assert_allclose(np.ptp(round_box.positions, axis=0), (1, 2, 3), atol=1e-6)


def test_fillets_are_arcs_that_touch_both_edges():
    points, directions = shapes.filleted([(0, 0), (2, 0), (2, 2)], 0.5, segments=8)
    arc = points[1:-1]
    np.testing.assert_allclose(np.linalg.norm(arc - (1.5, 0.5), axis=1), 0.5)
    np.testing.assert_allclose(directions[[0, -1]], [(1, 0), (0, 1)], atol=1e-12)


def test_a_mesh_has_one_section_a_material():
    other = Material("other")
    made = mesh("three", [shapes.box(1, CLAY), shapes.box(1, other), shapes.sphere(1, CLAY)])
    assert [section.material for section in made.sections] == [CLAY, other]
    assert volume(made.sections[0]) > volume(made.sections[1])


def test_copies_share_meshes():
    original = pica.Scene().add(place_pair())
    copy = copied(original, "copy")
    assert copy.children[0].mesh is original.children[0].mesh
    copy.children[0].transform = move(1, 2, 3)
    assert np.array_equal(original.children[0].transform, np.eye(4))


def place_pair():
    from pica.scene.model import Node

    node = Node("pair")
    place(node, "part", mesh("part", [shapes.box(1, CLAY)]), np.eye(4))
    return node
