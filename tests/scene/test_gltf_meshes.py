import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.gltf import read
from pica.scene.gltf.meshes import triangulate
from pica.scene.gltf.points_and_lines import LINE_WIDTH, POINT_WIDTH
from pica.scene.limits import Budget, Limits
from pica.scene.model import Scene, Section
from tests.scene.gltf_files import TRIANGLE, GltfFile

PIXEL = (
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGP4z8DwHwAFAAH/iZk9HQAAAABJRU5E"
    "rkJggg=="
)
SQUARE = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]


def only_section(scene: Scene) -> Section:
    (section,) = (section for node in scene.nodes() if node.mesh for section in node.mesh.sections)
    return section


def face_directions(section: Section) -> np.ndarray:
    corners = section.positions[section.indices]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def test_a_bare_triangle_gets_every_attribute(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh()
    section = only_section(read(file.write(tmp_path)))
    np.testing.assert_array_equal(section.positions, TRIANGLE)
    np.testing.assert_array_equal(section.normals, [[0, 0, 1]] * 3)
    np.testing.assert_array_equal(section.colors, np.ones((3, 4)))
    assert section.uv0.shape == section.uv1.shape == (3, 2)
    np.testing.assert_allclose(np.linalg.norm(section.tangents[:, :3], axis=1), 1, atol=1e-6)
    np.testing.assert_allclose((section.tangents[:, :3] * section.normals).sum(1), 0, atol=1e-6)
    assert section.material.name == "default" and section.material.base_color == (1, 1, 1, 1)
    arrays = (section.positions, section.normals, section.tangents, section.uv0, section.uv1, section.colors)
    assert all(array.dtype == np.float32 for array in arrays)
    assert section.indices.dtype == np.uint32


def test_strips_and_fans_keep_their_winding() -> None:
    order = np.arange(5, dtype=np.uint32)
    np.testing.assert_array_equal(triangulate(order, 5), [[0, 1, 2], [1, 3, 2], [2, 3, 4]])
    np.testing.assert_array_equal(triangulate(order, 6), [[1, 2, 0], [2, 3, 0], [3, 4, 0]])
    np.testing.assert_array_equal(triangulate(order, 4), [[0, 1, 2]])
    for mode in (4, 5, 6):
        assert triangulate(order[:1], mode).shape == (0, 3)


def test_a_strip_faces_one_way(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(file.accessor(SQUARE), mode=5)
    np.testing.assert_array_equal(face_directions(only_section(read(file.write(tmp_path))))[:, 2] > 0, [True, True])


def test_triangles_that_repeat_a_vertex_are_dropped() -> None:
    assert len(triangulate(np.array([0, 1, 1, 2, 2, 2, 0, 1, 2], np.uint32), 4)) == 1


LINES = [[0, 1], [1, 2], [2, 3], [3, 0]]


@pytest.mark.parametrize(
    ("mode", "lines"), [(0, [[0, 0], [1, 1], [2, 2], [3, 3]]), (1, [LINES[0], LINES[2]]), (2, LINES), (3, LINES[:3])]
)
@pytest.mark.parametrize("indexed", [False, True])
def test_points_and_lines_are_thin_solids(mode: int, lines: list[list[int]], indexed: bool, tmp_path: Path) -> None:
    file, order = GltfFile(), [3, 1, 0, 2] if indexed else [0, 1, 2, 3]
    positions = np.array([[0, 0, 0], [30, 0, 0], [30, 40, 0], [0, 0, 7.0]])
    colors = np.eye(4)[:, :3] / 2
    indices = {"indices": file.accessor(order, "u1")} if indexed else {}
    file.mesh(file.accessor(positions), attributes={"COLOR_0": file.accessor(colors)}, mode=mode, **indices)
    section = only_section(read(file.write(tmp_path)))
    sides, solids = (4, 4) if mode == 0 else (6, 6), len(lines)
    assert section.indices.shape == (sides[1] * solids, 3) and len(section.positions) == sides[0] * solids
    width = np.linalg.norm([30, 40, 7]) * (POINT_WIDTH if mode == 0 else LINE_WIDTH)
    for solid, line in zip(section.indices.reshape(solids, -1), np.array(order)[lines], strict=True):
        inside = positions[line].mean(axis=0)
        start, end = positions[line]
        for vertex in np.unique(solid):
            at = int(
                np.linalg.norm(section.positions[vertex] - end) < np.linalg.norm(section.positions[vertex] - start)
            )
            away = section.positions[vertex] - positions[line[at]]
            assert np.linalg.norm(away) == pytest.approx(width / 2, rel=1e-3)
            assert away @ (end - start) == pytest.approx(0, abs=1e-3)
            np.testing.assert_allclose(section.normals[vertex], away / (width / 2), atol=1e-3)
            np.testing.assert_array_equal(section.colors[vertex, :3], colors[line[at]])
        corners = section.positions[solid.reshape(-1, 3)]
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert ((corners.mean(axis=1) - inside) * outward).sum(axis=1).min() > 0


def test_points_without_normals_are_unlit(tmp_path: Path) -> None:
    file = GltfFile()
    pbr = {"baseColorFactor": [0.1, 0.2, 0.3, 1]}
    material = file.add("materials", name="dots", pbrMetallicRoughness=pbr, emissiveFactor=[1, 1, 1])
    file.mesh(mode=0, material=material)
    file.mesh(mode=0, material=material, attributes={"NORMAL": file.accessor([[0, 0, 1]] * 3)})
    first, second = (node.mesh.sections[0] for node in read(file.write(tmp_path)).nodes() if node.mesh)
    assert first.material.unlit and first.material.base_color == (0.1, 0.2, 0.3, 1) and not any(first.material.emission)
    assert not second.material.unlit
    np.testing.assert_array_equal(second.normals, [[0, 0, 1]] * 12)


def test_lines_without_a_length_and_single_points(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(file.accessor([[1, 1, 1], [1, 1, 1]]), mode=1)
    file.mesh(file.accessor([[1, 1, 1]]), mode=0)
    file.mesh(file.accessor([[1, 1, 1]]), mode=3)
    scene = read(file.write(tmp_path))
    assert scene.triangle_count() == 4
    assert only_section(scene).positions.max() == pytest.approx(1, abs=1e-2)


def test_many_points_are_smaller(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(file.accessor(np.linspace((0, 0, 0), (1, 0, 0), 40_000)), mode=0)
    section = only_section(read(file.write(tmp_path)))
    assert np.abs(section.positions[:, 1]).max() == pytest.approx(1 / 200 / 2 / np.sqrt(3), rel=1e-3)


def test_points_are_counted_before_they_are_made(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(file.accessor(np.zeros((1000, 3))), mode=0)
    with pytest.raises(SceneError, match=r"primitives\[0\]: would take 6,000 vertices"):
        read(file.write(tmp_path), Budget(Limits(vertices=5000)))


def test_flat_normals_split_shared_vertices(tmp_path: Path) -> None:
    file = GltfFile()
    positions = file.accessor([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    colors = file.accessor([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    indices = file.accessor([0, 1, 2, 0, 3, 1], "u1")
    tangents = file.accessor([[1, 0, 0, 1]] * 4)
    file.mesh(positions, indices=indices, attributes={"COLOR_0": colors, "TANGENT": tangents})
    section = only_section(read(file.write(tmp_path)))
    assert len(section.positions) == 6
    np.testing.assert_array_equal(section.normals[section.indices], [[[0, 0, 1]] * 3, [[0, 1, 0]] * 3])
    np.testing.assert_array_equal(section.colors[section.indices][1, 1], [1, 1, 1, 1])
    np.testing.assert_allclose((section.tangents[:, :3] * section.normals).sum(1), 0, atol=1e-6)


def test_vertices_that_no_triangle_uses_are_left_out(tmp_path: Path) -> None:
    file = GltfFile()
    positions = file.accessor([[9, 9, 9], [0, 0, 0], [1, 0, 0], [9, 9, 9], [0, 1, 0]])
    normals = file.accessor([[0, 0, 2]] * 5)
    file.mesh(positions, indices=file.accessor([1, 2, 4], "u2"), attributes={"NORMAL": normals})
    section = only_section(read(file.write(tmp_path)))
    np.testing.assert_array_equal(section.positions[section.indices[0]], TRIANGLE)
    np.testing.assert_array_equal(section.normals, [[0, 0, 1]] * 3)  # and made unit length


def test_a_normal_of_zero_becomes_that_of_its_triangle(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(attributes={"NORMAL": file.accessor([[0, 0, 0], [1, 0, 0], [1, 0, 0]])})
    np.testing.assert_array_equal(only_section(read(file.write(tmp_path))).normals[0], [0, 0, 1])


def test_vertex_colors_of_three_and_four_components(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(attributes={"COLOR_0": file.accessor([[255, 0, 51]] * 3, "u1", normalized=True)})
    file.mesh(attributes={"COLOR_0": file.accessor([[0.1, 0.2, 0.3, 0.4]] * 3)})
    three, four = (node.mesh.sections[0] for node in read(file.write(tmp_path)).nodes() if node.mesh)
    np.testing.assert_allclose(three.colors, [[1, 0, 0.2, 1]] * 3, atol=1e-6)
    np.testing.assert_allclose(four.colors, [[0.1, 0.2, 0.3, 0.4]] * 3, atol=1e-6)


def test_quantized_mesh(tmp_path: Path) -> None:
    file = GltfFile()
    file.json |= {"extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]}
    attributes = {
        "NORMAL": file.accessor([[0, 0, 127]] * 3, "i1", normalized=True),
        "TEXCOORD_0": file.accessor([[0, 0], [65535, 0], [0, 65535]], "u2", normalized=True),
        "TEXCOORD_1": file.accessor([[0, 0], [3, 0], [0, 3]], "u1"),
    }
    positions = file.accessor([[0, 0, 0], [100, 0, 0], [0, 100, 0]], "i2")
    file.mesh(positions, node={"scale": [0.01, 0.01, 0.01]}, attributes=attributes)
    scene = read(file.write(tmp_path))
    section = only_section(scene)
    np.testing.assert_array_equal(section.uv0, [[0, 0], [1, 0], [0, 1]])
    np.testing.assert_array_equal(section.uv1, [[0, 0], [3, 0], [0, 3]])
    np.testing.assert_array_equal(section.normals, [[0, 0, 1]] * 3)
    np.testing.assert_allclose(scene.bounds()[1], [1, 1, 0])


def test_one_mesh_on_two_nodes_is_made_once(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh()
    file.add("nodes", mesh=0, translation=[5, 0, 0])
    first, second = read(file.write(tmp_path)).nodes()
    assert first.mesh is second.mesh


@pytest.mark.parametrize(
    ("primitive", "fault"),
    [
        ({"indices": 7}, r"meshes\[0\].primitives\[0\].indices: 7 is out of range"),
        ({"material": 3}, r"meshes\[0\].primitives\[0\].material: 3 is out of range"),
        ({"mode": 9}, "mode: 9 is not a whole number from 0 to 6"),
        ({"attributes": {"NORMAL": 99}}, "attributes.NORMAL: 99 is out of range"),
    ],
)
def test_faults_are_named(primitive: dict[str, object], fault: str, tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(**primitive)
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


def test_indices_past_the_vertices_are_refused(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(file.accessor(TRIANGLE), indices=file.accessor([0, 1, 3], "u1"))
    with pytest.raises(SceneError, match=r"primitives\[0\].indices: names vertex 3 of 3 \(accessors\[1\]\)"):
        read(file.write(tmp_path))


def test_attributes_of_different_length_are_refused(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(attributes={"NORMAL": file.accessor([[0, 0, 1]] * 2)})
    with pytest.raises(SceneError, match="NORMAL: 2 elements for 3 positions"):
        read(file.write(tmp_path))


@pytest.mark.filterwarnings("ignore::UserWarning", "error::RuntimeWarning")
@pytest.mark.parametrize("extreme", [3.4e38, -3.4e38, 1e-45, 1e20, 0.0])
def test_the_largest_and_smallest_numbers_give_finite_meshes(extreme: float, tmp_path: Path) -> None:
    values = np.array([[0, 1, 2], [3, 4, 0], [1, 1, 5]], "f4")
    made = 0
    for changed in ("POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "COLOR_0", "WEIGHTS_0", "MORPH", "transform", None):
        file = GltfFile()

        def numbers(name: str, width: int, file: GltfFile = file, changed: str | None = changed) -> int:
            array = np.resize(values, (3, width))
            array[0] = extreme if name == changed else array[0]
            return file.accessor(array)

        attributes = {"NORMAL": 3, "TANGENT": 4, "TEXCOORD_0": 2, "COLOR_0": 4, "WEIGHTS_0": 4}
        if changed == "TEXCOORD_0" or changed == "transform":
            del attributes["TANGENT"]  # so that it is generated
        file.add("images", uri=PIXEL)
        transform = {"scale": [extreme or 1, 1], "rotation": extreme} if changed == "transform" else {}
        texture = {"index": file.add("textures", source=0), "extensions": {"KHR_texture_transform": transform}}
        file.mesh(
            numbers("POSITION", 3),
            attributes={name: numbers(name, width) for name, width in attributes.items()}
            | {"JOINTS_0": file.accessor([[0] * 4] * 3, "u1")},
            material=file.add("materials", normalTexture=texture),
            targets=[{"POSITION": numbers("MORPH", 3)}],
        )
        try:
            section = only_section(read(file.write(tmp_path)))
        except SceneError as error:
            assert re.search(r"primitives\[0\]|extensions.KHR_texture_transform", str(error))
            continue
        made += 1
        for name in ("positions", "normals", "tangents", "uv0", "colors", "weights", "morph_positions"):
            assert np.isfinite(getattr(section, name)).all(), (changed, name)
    assert made >= 7


@pytest.mark.parametrize("layer", ["base", "coat"])
def test_tangents_follow_the_coordinates_of_a_normal_map(tmp_path: Path, layer: str) -> None:
    file = GltfFile()
    file.add("images", uri=PIXEL)
    texture = {"index": file.add("textures", source=0)}
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatNormalTexture": texture}}
    values: dict[str, Any] = {"normalTexture": texture} if layer == "base" else {"extensions": coat}
    uvs = file.accessor([[0, 0], [0, 1], [1, 0]])  # u grows along the triangle's second edge
    normals = file.accessor([[0, 0, 1]] * 3)
    file.mesh(attributes={"TEXCOORD_0": uvs, "NORMAL": normals}, material=file.add("materials", **values))
    section = only_section(read(file.write(tmp_path)))
    edge = section.positions[2] - section.positions[0]
    along = edge / np.linalg.norm(edge)
    np.testing.assert_allclose(section.tangents[:, :3], np.tile(along, (3, 1)), atol=1e-6)
