"""Meshes of the arrays that somebody has: what is missing is made, what does not fit is refused in one line."""

import tracemalloc

import numpy as np
import pytest

import pica
from pica.scene.building import Attributes, complete
from pica.scene.material import Material
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import sphere
from tests.building import bumps, lambert, uniform

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64) / 2
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def test_two_arrays_are_enough():
    (section,) = Mesh.from_arrays(CUBE, FACES, name="cube").sections
    np.testing.assert_allclose(section.normals, CUBE / np.linalg.norm(CUBE, axis=1, keepdims=True), atol=1e-6)
    assert not section.flat and not section.uv0.any() and not section.uv1.any() and (section.colors == 1).all()
    assert np.abs((section.tangents[:, :3] * section.normals).sum(1)).max() < 1e-6
    np.testing.assert_array_equal(section.indices, FACES)
    assert section.material.metallic == 0 and section.material.base_color == (1, 1, 1, 1)
    section.check()
    assert Mesh.from_arrays(CUBE, FACES).sections[0].material is not section.material


def test_smooth_normals_do_not_depend_on_how_faces_are_cut():
    """A corner of a cube has the same angle in each of its faces, be they one triangle there or two."""
    cut = np.where(np.arange(12)[:, None] < 2, [[0, 1, 2]] * 1 + [[1, 3, 2]] + [[0, 0, 0]] * 10, FACES)
    (section,) = Mesh.from_arrays(CUBE, cut).sections
    np.testing.assert_allclose(section.normals, CUBE / np.linalg.norm(CUBE, axis=1, keepdims=True), atol=1e-6)


def test_flat_normals_split_the_corners():
    colors = np.linspace(0, 1, 24).reshape(8, 3)
    (section,) = Mesh.from_arrays(CUBE, FACES, smooth=False, colors=colors).sections
    assert section.flat and len(section.positions) == 36
    assert set(np.abs(section.normals).max(1)) == {1.0}
    np.testing.assert_allclose(section.colors[:, :3], colors[FACES.ravel()], rtol=1e-6)
    assert (section.colors[:, 3] == 1).all()


def test_what_is_given_is_taken():
    ball = sphere(0.5, lambert())
    whole = Section.from_arrays(
        ball.positions, ball.indices, normals=3 * ball.normals, uv=ball.uv0, uv1=ball.uv1[:, ::-1],
        colors=ball.colors * 0.5, tangents=ball.tangents, material=ball.material,
    )  # fmt: skip
    assert whole.positions is ball.positions and whole.indices is ball.indices, "arrays that fit are not copied"
    for name in ("normals", "uv0", "tangents"):
        np.testing.assert_allclose(getattr(whole, name), getattr(ball, name), atol=1e-6)
    np.testing.assert_array_equal(whole.uv1, ball.uv1[:, ::-1])
    assert (whole.colors == 0.5).all() and whole.material is ball.material


def test_tangents_follow_a_normal_map():
    positions, indices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    uv = [[0, 0], [0, 1], [1, 1], [1, 0]]
    section = Section.from_arrays(positions, indices, uv=uv, material=Material(normal_texture=bumps()))
    np.testing.assert_allclose(section.tangents[:, :3], np.broadcast_to((0, 1, 0), (4, 3)), atol=1e-6)


def test_files_and_arrays_are_completed_alike():
    given: Attributes = {"POSITION": CUBE.astype(np.float32)}
    file = complete(given, FACES.astype(np.uint32), lambert())
    own = Section.from_arrays(CUBE, FACES, smooth=False)
    for name in ("positions", "normals", "tangents", "uv0", "colors", "indices"):
        np.testing.assert_array_equal(getattr(file, name), getattr(own, name))


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({"positions": CUBE[:, :2]}, "positions: has the shape (8, 2), not (vertices, 3)"),
        ({"positions": np.where(np.arange(8)[:, None] == 3, np.nan, CUBE)}, "positions: row 3 is not finite (nan)"),
        ({"indices": FACES.ravel()}, "indices: has the shape (36,), not (triangles, 3)"),
        ({"indices": FACES + 0.5}, "indices: an array of float64 is not an array of integers"),
        ({"indices": FACES - 1}, "indices: row 0 is not from 0 to 4294967295 (-1)"),
        ({"indices": FACES + 1}, "indices: row 2 names vertex 8 of 8"),
        ({"normals": CUBE[:5]}, "normals: for 5 vertices, but there are 8 positions"),
        ({"uv": CUBE}, "uv: has the shape (8, 3), not (vertices, 2)"),
        ({"uv1": CUBE[:2, :2]}, "uv1: for 2 vertices, but there are 8 positions"),
        ({"colors": np.ones((8, 2))}, "colors: has the shape (8, 2), not (vertices, 3) or (vertices, 4)"),
        ({"colors": CUBE}, "colors: row 0 is not from 0 to 1 (-0.5)"),
        (
            {"colors": np.full((8, 3), 180)},
            "colors: row 0 is not from 0 to 1 (180); numbers up to 255 must be uint8",
        ),
        ({"colors": np.full((8, 3), 2.0)}, "colors: row 0 is not from 0 to 1 (2); numbers up to 255 must be uint8"),
        ({"tangents": np.ones((8, 4))}, "tangents: they stand on normals, so give both"),
        ({"material": "red"}, "material: 'red' is not a Material"),
        ({"smooth": 1}, "smooth: 1 is not True or False"),
    ],
)
def test_faults_in_words(given, fault):
    for kind in (Mesh, Section):
        with pytest.raises(pica.SceneError) as caught:
            kind.from_arrays(**{"positions": CUBE, "indices": FACES, **given})
        assert str(caught.value) == f"section: {fault}"


def test_nothing_is_a_mesh_too():
    (section,) = Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int)).sections
    section.check()


@pytest.mark.device
def test_it_can_be_shown(device):
    scene = Scene("cube", uniform(1, 1, 1))
    scene.add(Node("cube", mesh=Mesh.from_arrays(CUBE, FACES)))
    frame = pica.Renderer(scene, size=(32, 32), device=device).render(1)
    assert frame.color[16, 16].min() > 0.2


def test_colours_of_eight_bits_count_255ths():
    colors = np.array([0, 51, 255] * 8, np.uint8).reshape(8, 3)
    section = Section.from_arrays(CUBE, FACES, colors=colors)
    assert section.colors[0] == pytest.approx([0, 0.2, 1, 1])
    section.colors = np.full((8, 4), 102, np.uint8)
    assert section.colors[0] == pytest.approx([0.4] * 4)
    with pytest.raises(pica.SceneError, match=r"^section: colors: row 0 is not from 0 to 1 \(2\)"):
        section.colors = np.full((8, 4), 2.0)


def test_pixels_are_no_radiance():
    with pytest.raises(pica.SceneError) as caught:
        pica.Environment(np.full((2, 4, 3), 200, np.uint8))
    hint = "give floats in nits; of a picture, pica.color.srgb_decode(picture / 255)"
    assert str(caught.value) == f"environment: radiance: an array of uint8 is not radiance; {hint}"
    assert pica.Environment(pica.color.srgb_decode(np.full((2, 4, 3), 255, np.uint8) / 255)).radiance.max() == 1


@pytest.mark.parametrize(("smooth", "times"), [(False, 1.2), (True, 2.5)])
def test_large_meshes_take_little_more_memory_while_they_are_made(smooth: bool, times: float) -> None:
    """In 64 bits and all at once, normals and tangents would take 1.5 and 15 times what stays."""
    side = 300
    rows = np.arange(side * side).reshape(side, side)
    triangles = np.stack([rows[:-1, :-1], rows[:-1, 1:], rows[1:, 1:]], axis=-1).reshape(-1, 3)
    positions = np.random.default_rng(0).random((side * side, 3), np.float32)
    tracemalloc.start()
    try:
        section = Section.from_arrays(positions, triangles.astype(np.uint32), smooth=smooth)
        stays, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(section.indices) == len(triangles) and peak < times * stays
