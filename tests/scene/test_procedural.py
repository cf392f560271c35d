"""Scenes made in code and the shapes that they are made of."""

import math

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.light import DirectionalLight, PointLight, RectangleLight, SpotLight
from pica.scene.material import Material
from pica.scene.procedural import primitives as shapes
from pica.scene.procedural.placing import at, copied, mesh, move, place, stretch, turn
from pica.scene.procedural.sky import Window, gradient_sky

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
    "stretched, turned torus": at(shapes.torus(1, 0.3, CLAY, segments=96), turn("x", 30), stretch(1, 2, 1.5)),
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
    ellipsoid = at(shapes.sphere(1, CLAY), turn("z", 30), stretch(1, 3, 0.5))
    local = ellipsoid.positions @ turn("z", 30)[:3, :3]
    gradient = (local / np.array((1, 9, 0.25))) @ turn("z", 30)[:3, :3].T
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


def test_windows_shine_where_they_are():
    window = Window(azimuth=90, elevation=30, width=40, height=30, radiance=(9.0, 8.0, 7.0))
    sky = gradient_sky((1, 1, 1), (1, 1, 1), (1, 1, 1), [window], height=90).radiance
    row, column = np.unravel_index(sky[..., 0].argmax(), sky.shape[:2])
    # Environment: u = 0.5 + azimuth / 360, v = 0.5 - elevation / 180.
    assert abs(column / 180 - 0.75) < 0.06 and abs(row / 90 - (0.5 - 30 / 180)) < 0.06
    np.testing.assert_allclose(sky[row, column], (9, 8, 7), rtol=1e-3)


def test_cornell_is_a_closed_matt_room_with_a_lamp():
    scene = pica.scenes.cornell()
    sections = [section for node in scene.nodes() if node.mesh for section in node.mesh.sections]
    assert all(section.material.specular == 0 and section.material.metallic == 0 for section in sections)
    lamps = [section for section in sections if any(section.material.emission)]
    assert len(lamps) == 1 and len(lamps[0].indices) == 2
    assert len(scene.cameras()) == 1
    lamp = next(node for node in scene.nodes() if node.name == "lamp")
    np.testing.assert_allclose(lamp.world[:3, :3] @ (0, 1, 0), (0, -1, 0), atol=1e-12)  # shines down


def test_sphere_grid_covers_roughness_and_metalness():
    scene = pica.scenes.sphere_grid(columns=4, rows=2)
    balls = [node for node in scene.nodes() if node.name.startswith("sphere ") and node.mesh]
    found = {(n.mesh.sections[0].material.roughness, n.mesh.sections[0].material.metallic) for n in balls}
    assert len(balls) == len(found) == 8
    low, high = np.min(list(found), axis=0), np.max(list(found), axis=0)
    np.testing.assert_allclose([low, high], [(0.05, 0), (1, 1)])
    assert scene.environment is not None


@pytest.fixture(scope="module")
def world():
    return pica.scenes.machine_world(seed=1)


def test_machine_world_is_rich_enough_and_not_too_heavy(world):
    assert 30_000 <= world.triangle_count() <= 150_000
    nodes = list(world.nodes())
    kinds = {type(node.light) for node in nodes if node.light}
    assert {DirectionalLight, RectangleLight, PointLight, SpotLight} <= kinds
    meshes = [node.mesh for node in nodes if node.mesh]
    assert len({id(made) for made in meshes}) < 0.6 * len(meshes)
    assert all(node.name for node in nodes)
    materials = [section.material for made in meshes for section in made.sections]
    assert any(any(material.emission) for material in materials)
    assert any(material.metallic == 1 for material in materials)


def test_machine_world_has_parts_that_can_move_about_their_pivots(world):
    for name in ("ram", "belt", "left wheel", "head", "ball", "front left leg", "valve wheel"):
        assert any(node.name == name for node in world.nodes()), name
    for node in world.nodes():
        if node.name in ("left wheel", "ball"):
            low, high = node.mesh.sections[0].positions.min(0), node.mesh.sections[0].positions.max(0)
            np.testing.assert_allclose(low[1:], -high[1:], atol=0.02)  # round about its own X axis


def test_machine_world_depends_on_the_seed_only():
    def places(seed):
        return np.array([node.world for node in pica.scenes.machine_world(seed).nodes()])

    assert np.array_equal(places(3), places(3))
    assert places(3).shape != places(4).shape or not np.array_equal(places(3), places(4))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_in_machine_world_intersects(seed):
    (root,) = pica.scenes.machine_world(seed).roots
    things = [child for child in root.children if any(node.mesh for node in child.walk())]
    triangles = [world_triangles(thing) for thing in things]
    boxes = [(part.min((0, 1)), part.max((0, 1))) for part in triangles]
    for i, first in enumerate(triangles):
        for j, second in enumerate(triangles[:i]):
            low, high = np.maximum(boxes[i][0], boxes[j][0]), np.minimum(boxes[i][1], boxes[j][1])
            if (low < high).all():
                a, b = near(first, low, high), near(second, low, high)
                assert not cuts(a, b) and not cuts(b, a), (things[i].name, things[j].name)


def world_triangles(root):
    parts = [
        corners(section) @ node.world[:3, :3].T + node.world[:3, 3]
        for node in root.walk()
        if node.mesh
        for section in node.mesh.sections
    ]
    return np.concatenate(parts)


def near(triangles, low, high):
    """Those that reach into a box."""
    return triangles[((triangles.max(1) >= low) & (triangles.min(1) <= high)).all(1)]


def cuts(edges_of, triangles):
    """Whether an edge of the first passes through one of the others (Möller and Trumbore 1997)."""
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    for corner in range(3):
        start, end = edges_of[:, corner], edges_of[:, (corner + 1) % 3]
        for chunk in np.array_split(np.arange(len(start)), max(1, len(start) * len(a) // 2_000_000)):
            along = (end - start)[chunk, None]
            p = np.cross(along, v)
            determinant = np.einsum("etk,tk->et", p, u)
            with np.errstate(divide="ignore", invalid="ignore"):
                offset = start[chunk, None] - a
                x = np.einsum("etk,etk->et", offset, p) / determinant
                q = np.cross(offset, u)
                y = np.einsum("etk,etk->et", q, along + np.zeros_like(q)) / determinant
                t = np.einsum("etk,tk->et", q, v) / determinant
                if ((x > 0) & (y > 0) & (x + y < 1) & (t > 0) & (t < 1)).any():
                    return True
    return False


def test_a_full_slab_is_an_error_of_one_line():
    with pytest.raises(SceneError, match="no room on the slab for another robot"):
        pica.scenes.machine_world(robots=200)
