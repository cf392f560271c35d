import warnings

import numpy as np
import pytest

from pica.scene.building import texture_coordinates
from pica.scene.gltf import read
from pica.scene.normals import face_normals, perpendicular
from pica.scene.tangents import generate_tangents
from tests.assets import ASSETS, needs_assets

FLAT = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
UP = np.array([[0, 0, 1]] * 4, np.float32)
SQUARE = np.array([[0, 1, 2], [2, 1, 3]], np.uint32)

# Tangents of `mirrored_patch` from the reference code, mikktspace.c, w negated as glTF's v runs down:
# one row a triangle, x y z w of its three corners.
REFERENCE = [
    [-0.8836, 0.0705, -0.4628, -1, -1.0, 0.0, 0.0, -1, -0.8977, 0.1375, 0.4185, -1],
    [1.0, 0.0, 0.0, 1, 0.8802, -0.0222, -0.4741, 1, 0.9963, 0.0148, -0.085, 1],
    [-0.8979, 0.1329, -0.4198, -1, -0.8977, 0.1375, 0.4185, -1, -0.9416, 0.009, 0.3365, -1],
    [0.8955, -0.0323, -0.444, 1, 0.9963, 0.0148, -0.085, 1, 0.8713, -0.155, 0.4656, 1],
    [-0.8836, 0.0705, -0.4628, -1, -0.8977, 0.1375, 0.4185, -1, -0.8979, 0.1329, -0.4198, -1],
    [1.0, 0.0, 0.0, 1, 0.9963, 0.0148, -0.085, 1, 0.8955, -0.0323, -0.444, 1],
    [-0.8979, 0.1329, -0.4198, -1, -0.9416, 0.009, 0.3365, -1, -0.9597, -0.0256, 0.2798, -1],
    [0.8955, -0.0323, -0.444, 1, 0.8713, -0.155, 0.4656, 1, 0.9423, -0.0936, -0.3215, 1],
]

Mesh = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def mirrored_patch() -> Mesh:
    """Eight triangles on a wavy surface, u mirrored at x = 0: positions, normals, texture coordinates, indices."""
    x, y = np.meshgrid([-1.0, 0.0, 1.0], [0.0, 1.0, 2.5])
    positions = np.stack([x, y, 0.3 * np.cos(2 * x + y)], -1).reshape(-1, 3).astype(np.float32)
    slope = -0.3 * np.sin(2 * x + y)
    normals = np.stack([-2 * slope, -slope, np.ones_like(x)], -1).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uvs = np.stack([np.abs(x) + 0.1 * y, 1 - 0.4 * y], -1).reshape(-1, 2).astype(np.float32)
    corner = np.array([[0], [1], [3], [4]])
    triangles = np.concatenate([np.add(corner, (0, 1, 4)), np.add(corner, (0, 4, 3))]).astype(np.uint32)
    return positions, normals.astype(np.float32), uvs, triangles


def test_agrees_with_the_reference_code() -> None:
    tangents, _, triangles = generate_tangents(*mirrored_patch())
    np.testing.assert_allclose(tangents[triangles].reshape(-1, 12), REFERENCE, atol=2e-4)


def test_only_vertices_on_the_seam_are_split() -> None:
    positions, _, _, old = mirrored_patch()
    tangents, source, triangles = generate_tangents(*mirrored_patch())
    np.testing.assert_array_equal(source[triangles], old)
    counts = np.bincount(source)
    np.testing.assert_array_equal(counts == 2, positions[:, 0] == 0)
    assert set(tangents[:, 3]) == {1.0, -1.0}


def test_unit_length_and_at_right_angles_to_the_normal() -> None:
    random = np.random.default_rng(0)
    normals = random.normal(size=(300, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    triangles = random.permutation(300).reshape(-1, 3).astype(np.uint32)
    positions = random.normal(size=(300, 3)).astype(np.float32)
    tangents, source, _ = generate_tangents(positions, normals, random.random((300, 2), np.float32), triangles)
    np.testing.assert_allclose(np.linalg.norm(tangents[:, :3], axis=1), 1, atol=1e-5)
    np.testing.assert_allclose((tangents[:, :3] * normals[source]).sum(1), 0, atol=1e-5)


def test_tangent_follows_u_and_bitangent_runs_against_v() -> None:
    for turn in np.linspace(0, 6, 7):
        along_u, along_v = np.array([np.cos(turn), np.sin(turn)]), np.array([np.sin(turn), -np.cos(turn)])
        uvs = np.stack([FLAT[:, :2] @ along_u, FLAT[:, :2] @ along_v], axis=1).astype(np.float32)
        tangents, _, _ = generate_tangents(FLAT, UP, uvs, SQUARE)
        np.testing.assert_allclose(tangents[:, :2], [along_u] * 4, atol=1e-6)
        bitangents = np.cross(UP, tangents[:, :3]) * tangents[:, 3:]
        np.testing.assert_allclose(bitangents[:, :2], [-along_v] * 4, atol=1e-6)


def test_mirrored_texture_turns_the_sign() -> None:
    upright = np.array([[0, 1], [1, 1], [0, 0], [1, 0]], np.float32)
    assert (generate_tangents(FLAT, UP, upright, SQUARE)[0] == [1, 0, 0, 1]).all()
    assert (generate_tangents(FLAT, UP, upright * [-1, 1], SQUARE)[0] == [-1, 0, 0, -1]).all()


def test_triangles_count_by_their_angle() -> None:
    # around vertex 0: one triangle of a quarter turn with u along +x, and two of an eighth with u along +y
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 1, 0], [-1, 0, 0]], np.float32)
    normals = np.array([[0, 0, 1]] * 5, np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]], np.uint32)
    corners = triangles.reshape(-1)
    x, y = positions[corners, :2].T
    first = np.arange(9) < 3
    uvs = np.stack([np.where(first, x, y), np.where(first, -y, x)], axis=1)
    split = np.arange(9, dtype=np.uint32).reshape(3, 3)
    tangents, _, new = generate_tangents(positions[corners], normals[corners], uvs, split)
    np.testing.assert_allclose(tangents[new[:, 0], :3], [[np.sqrt(0.5), np.sqrt(0.5), 0]] * 3, atol=1e-6)


def test_vertices_that_agree_are_welded_first() -> None:
    positions, normals, uvs, triangles = mirrored_patch()
    corners = triangles.reshape(-1)
    apart = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
    tangents, _, new = generate_tangents(positions[corners], normals[corners], uvs[corners], apart)
    np.testing.assert_allclose(tangents[new].reshape(-1, 12), REFERENCE, atol=2e-4)


def test_without_texture_space_any_tangent_will_do() -> None:
    tangents, _, _ = generate_tangents(FLAT, UP, np.zeros((4, 2), np.float32), SQUARE)
    np.testing.assert_allclose(np.linalg.norm(tangents[:, :3], axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(tangents[:, 2], 0, atol=1e-6)


def test_a_triangle_without_texture_space_takes_its_neighbours_tangent() -> None:
    uvs = np.array([[0, 1], [1, 1], [0, 0], [1, 1]], np.float32)  # the second triangle has no area
    for mirror in (1, -1):
        tangents, source, _ = generate_tangents(FLAT, UP, uvs * np.float32([mirror, 1]), SQUARE)
        np.testing.assert_array_equal(tangents[source != 3], [[mirror, 0, 0, mirror]] * 3)


@pytest.mark.parametrize("mesh", range(6))
@needs_assets
def test_agrees_with_the_tangents_that_flight_helmet_ships(mesh: int) -> None:
    # another tool made them, so single vertices differ where the mesh has seams and slivers
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        nodes = list(read(ASSETS / "FlightHelmet" / "FlightHelmet.gltf").nodes())
    section = [node.mesh for node in nodes if node.mesh][mesh].sections[0]
    texture = section.material.normal_texture
    assert texture is not None
    uvs = texture_coordinates(
        {"POSITION": section.positions, "TEXCOORD_0": section.uv0}, texture.uv_set, texture.transform
    )
    tangents, source, _ = generate_tangents(section.positions, section.normals, uvs, section.indices)
    shipped = section.tangents[source]
    angles = np.degrees(np.arccos(np.clip((tangents[:, :3] * shipped[:, :3]).sum(1), -1, 1)))
    assert np.median(angles) < 1.5
    assert (angles < 10).mean() > 0.93
    assert (tangents[:, 3] == shipped[:, 3]).mean() > 0.999


def test_perpendicular_and_face_normals() -> None:
    normals = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0.6, 0, -0.8]], np.float32)
    across = perpendicular(normals)
    np.testing.assert_allclose((across * normals).sum(1), 0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1), 1, atol=1e-6)
    np.testing.assert_array_equal(face_normals(FLAT, SQUARE), [[0, 0, 1]] * 2)
    np.testing.assert_array_equal(face_normals(FLAT, np.array([[1, 1, 2]])), [[0, 0, 1]])
