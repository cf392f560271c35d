"""Polygons of PLY files, as text and as numbers of either byte order, with properties on both sides of the list."""

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.limits import Budget, Limits
from pica.scene.loading import load
from pica.scene.mesh_files.ply import with_triangles

PLACES = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2), (3, 0), (3, 1)]
"""An L of six corners, and a square and a triangle beside it."""
L, SQUARE, TRIANGLE = (0, 1, 2, 3, 4, 5), (1, 6, 7, 2), (6, 7, 2)
KINDS = ["ascii", "binary_little_endian", "binary_big_endian"]


def ply(kind: str, faces: list[tuple[int, ...]], count: int | None = None) -> bytes:
    """A file whose faces have a red ahead of their corners and a green and a blue behind them."""
    header = [
        *("ply", f"format {kind} 1.0", "comment made here", f"element vertex {len(PLACES)}"),
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces) if count is None else count}",
        *(
            "property uchar red",
            "property list uchar int vertex_indices",
            "property uchar green",
            "property uchar blue",
        ),
    ]
    start = "\n".join([*header, "end_header", ""]).encode()
    if kind == "ascii":
        vertices = [f"{x} {y} 0" for x, y in PLACES]
        rows = [" ".join(map(str, [200, len(face), *face, 100, 50])) for face in faces]
        return start + "\n".join([*vertices, *rows, ""]).encode()
    order = "<" if kind == "binary_little_endian" else ">"
    body = b"".join(struct.pack(f"{order}3f", x, y, 0) for x, y in PLACES)
    rows = [struct.pack(f"{order}BB{len(face)}iBB", 200, len(face), *face, 100, 50) for face in faces]
    return start + body + b"".join(rows)


def areas(path: Path) -> NDArray[np.float32]:
    """Signed, of each triangle that a file shows."""
    with pytest.warns(UserWarning, match="no light"):
        scene = load(path)
    ((section,),) = [node.mesh.sections for node in scene.nodes() if node.mesh]
    a, b, c = (section.positions[section.indices[:, corner], :2] for corner in range(3))
    (across, along), (over, up) = (b - a).T, (c - a).T
    return (across * up - along * over) / 2


@pytest.mark.parametrize("kind", KINDS)
def test_polygons_of_any_form_are_shown(tmp_path, kind):
    path = tmp_path / "a.ply"
    path.write_bytes(ply(kind, [TRIANGLE, L, SQUARE]))
    found = areas(path)
    assert len(found) == 1 + 4 + 2
    assert (found > 0).all(), "a fan of the L would have triangles outside of it, the other way round"
    assert found.sum() == pytest.approx(0.5 + 3 + 1)


@pytest.mark.parametrize("kind", KINDS)
def test_each_triangle_has_its_polygons_properties(kind):
    made = with_triangles(ply(kind, [L, SQUARE]), Budget())
    assert b"element face 6\n" in made
    if kind == "ascii":
        rows = made.splitlines()[-6:]
        assert all(row.startswith(b"200 3 ") and row.endswith(b" 100 50") for row in rows)
    else:
        rows = [made[-16 * n :][:16] for n in range(1, 7)]
        assert all(row[:2] == b"\xc8\x03" and row[-2:] == b"\x64\x32" for row in rows)


@pytest.mark.parametrize("kind", KINDS)
def test_triangles_alone_stay_as_they_are(kind):
    content = ply(kind, [TRIANGLE, TRIANGLE])
    assert with_triangles(content, Budget()) is content


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "faces, count, fault",
    [
        ([(0, 1, 2, 9)], None, "a face names vertex 9, but there are 8"),
        ([SQUARE], 2, "ends early"),
        ([L], 900, "ends early"),
    ],
)
def test_files_that_lie_are_refused(kind, faces, count, fault):
    with pytest.raises(SceneError, match=fault):
        with_triangles(ply(kind, faces, count), Budget())


@pytest.mark.parametrize("kind", KINDS)
def test_what_triangles_take_is_counted(kind):
    """Each repeats the properties of its polygon."""
    with pytest.raises(SceneError, match="the limit is"):
        with_triangles(ply(kind, [L] * 50), Budget(Limits(bytes=1000)))


def textured(kind: str, faces: list[tuple[int, ...]], more: int = 0) -> bytes:
    """A file whose faces have texture coordinates, the places of their corners. `more`: numbers that belong to none."""
    header = [
        *("ply", f"format {kind} 1.0", f"element vertex {len(PLACES)}", *(f"property float {axis}" for axis in "xyz")),
        *(f"element face {len(faces)}", "property uchar red", "property list uchar int vertex_indices"),
        *("property list uchar float texcoord", "property uchar green"),
    ]
    start = "\n".join([*header, "end_header", ""]).encode()
    rows = [(face, [*(each for corner in face for each in PLACES[corner]), *([7] * more)]) for face in faces]
    if kind == "ascii":
        lines = [f"{x} {y} 0" for x, y in PLACES]
        lines += [" ".join(map(str, [200, len(face), *face, len(uv), *uv, 100])) for face, uv in rows]
        return start + "\n".join([*lines, ""]).encode()
    order = "<" if kind == "binary_little_endian" else ">"
    body = [struct.pack(f"{order}3f", x, y, 0) for x, y in PLACES]
    for face, uv in rows:
        body.append(struct.pack(f"{order}BB{len(face)}iB{len(uv)}fB", 200, len(face), *face, len(uv), *uv, 100))
    return start + b"".join(body)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("faces", [[SQUARE], [TRIANGLE, L, SQUARE]])
def test_texture_coordinates_of_corners_stay_with_them(tmp_path, kind, faces):
    path = tmp_path / "a.ply"
    path.write_bytes(textured(kind, faces))
    with pytest.warns(UserWarning, match="no light"):
        scene = load(path)
    ((section,),) = [node.mesh.sections for node in scene.nodes() if node.mesh]
    assert len(section.indices) == sum(len(face) - 2 for face in faces)
    expected = np.stack([section.positions[:, 0], 1 - section.positions[:, 1]], axis=1)
    np.testing.assert_allclose(section.uv0, expected, atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_lists_of_no_corners_are_left_to_others(kind):
    content = textured(kind, [L, SQUARE], more=1)
    assert with_triangles(content, Budget()) is content
    triangles = textured(kind, [TRIANGLE, TRIANGLE])
    assert with_triangles(triangles, Budget()) is triangles
