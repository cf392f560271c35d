"""Curves and points of OpenUSD, as tubes and spheres."""

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Sdf, Usd, UsdGeom, Vt

import pica
from pica.errors import SceneError
from tests.scene.test_usd import load, node
from tests.scene.usd_files import saved, stage

S_CURVE = [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0), (1, -1, 0), (2, -1, 0), (2, 0, 0)]
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (2, 1, 0), (2, 1, 1)]
OCTAGON = [(math.cos(turn), math.sin(turn), 0) for turn in np.arange(8) * math.pi / 4]


def curves(
    made: Usd.Stage, points: list, basis: str, wrap: str = "nonperiodic", widths: tuple = (0.2,), of: str = "constant"
) -> UsdGeom.BasisCurves:
    """One curve."""
    curve = UsdGeom.BasisCurves.Define(made, "/World/curve")
    curve.CreatePointsAttr(points)
    curve.CreateCurveVertexCountsAttr([len(points)])
    curve.CreateTypeAttr("linear" if basis == "linear" else "cubic")
    curve.CreateBasisAttr("bezier" if basis == "linear" else basis)
    curve.CreateWrapAttr(wrap)
    if widths:
        curve.CreateWidthsAttr(list(widths))
        curve.SetWidthsInterpolation(of)
    return curve


def section(made: Usd.Stage, name: str = "curve") -> pica.scene.mesh.Section:
    (found,) = node(load(saved(made)), name).mesh.sections
    return found


def check_faces_outwards(part: pica.scene.mesh.Section) -> None:
    corners = part.positions[part.indices]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", faces, part.normals[part.indices].sum(axis=1)) > 0).all()


def distances_to(samples: np.ndarray, points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - samples, axis=2).min(axis=1)


@pytest.mark.parametrize(
    ("points", "basis", "wrap", "passes"),
    [
        (CORNERS, "linear", "nonperiodic", CORNERS),
        (S_CURVE, "bezier", "nonperiodic", [(0, 0, 0), (0.5, 0.75, 0), (1, 0, 0), (1.5, -0.75, 0), (2, 0, 0)]),
        (CORNERS, "catmullRom", "nonperiodic", CORNERS[1:4]),
        (CORNERS, "catmullRom", "pinned", CORNERS),
        (CORNERS, "bspline", "pinned", [CORNERS[0], CORNERS[4], (1 - 1 / 6, 1 / 6, 0)]),
        (OCTAGON, "bspline", "periodic", [((4 + math.sqrt(2)) / 6, 0, 0), (0, (4 + math.sqrt(2)) / 6, 0)]),
    ],
)
def test_curves_pass_their_points(points: list, basis: str, wrap: str, passes: list, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    curves(made, points, basis, wrap)
    part = section(made)
    check_faces_outwards(part)
    # The ring of a sample that lies on the curve is 0.1 away from it, all round.
    for place in np.asarray(passes, float):
        near = part.positions[np.abs(np.linalg.norm(part.positions - place, axis=1) - 0.1) < 1e-4]
        assert len(near) >= 8
        np.testing.assert_allclose(near.mean(axis=0), place, atol=0.02)
    closed = wrap == "periodic"
    assert (
        len(part.indices) - (0 if closed else 2 * 6)
    ) % 16 == 0  # a ring of quads a sample, and two caps of 8 corners


def test_widths_and_colors_are_along_the_curve(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    curve = curves(made, S_CURVE, "bezier", widths=(0.1, 0.2, 0.4), of="varying")
    colors = UsdGeom.PrimvarsAPI(curve).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "varying")
    colors.Set([(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    part = section(made)
    for x, radius, color in zip((0, 1, 2), (0.05, 0.1, 0.2), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), strict=True):
        ring = np.abs(np.linalg.norm(part.positions - (x, 0, 0), axis=1) - radius) < 1e-4
        assert ring.sum() >= 8
        np.testing.assert_allclose(part.colors[ring][:, :3], np.tile(color, (ring.sum(), 1)), atol=1e-3)


def test_vertex_widths_have_the_weights_of_points(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    curves(made, CORNERS, "bspline", widths=(0, 0.6, 0, 0, 0), of="vertex")
    part = section(made)
    ring = distances_to(np.array([[1 - 1 / 6, 1 / 6, 0]]), part.positions)
    assert np.isclose(ring.min(), 0.6 * 4 / 6 / 2, atol=1e-4)


def test_many_curves_have_less_detail_and_a_color_each(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    count = 50_000
    rng = np.random.default_rng(0)
    roots = rng.uniform(-1, 1, (count, 1, 3)) + np.arange(4)[:, None] * [0.0, 0.1, 0.0]
    curve = curves(made, [], "bspline", "pinned", (0.01,))
    curve.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(roots.reshape(-1, 3).astype(np.float32)))
    curve.GetCurveVertexCountsAttr().Set([4] * count)
    colors = UsdGeom.PrimvarsAPI(curve).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "uniform")
    colors.Set(Vt.Vec3fArray.FromNumpy(rng.uniform(0, 1, (count, 3)).astype(np.float32)))
    part = section(made)
    assert len(part.indices) == count * (3 * 2 * 3 * 2 + 2)
    own = part.colors[part.indices]
    assert (own == own[:, :1]).all()


def test_without_widths_curves_and_points_are_as_wide_as_lines_of_gltf(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    curves(made, [(0, 0, 0), (4, 0, 0)], "linear", widths=())
    assert np.isclose(np.ptp(section(made).positions[:, 1]), 4 / 400, rtol=0.1)


def test_points_are_spheres_of_their_widths_and_colors(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    points = UsdGeom.Points.Define(made, "/World/points")
    points.CreatePointsAttr([(0, 0, 0), (5, 0, 0)])
    points.CreateWidthsAttr([1.0, 2.0])
    colors = UsdGeom.PrimvarsAPI(points).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "vertex")
    colors.Set([(1, 0, 0), (0, 0, 1)])
    part = section(made, "points")
    check_faces_outwards(part)
    is_first = part.positions[:, 0] < 2
    np.testing.assert_allclose(np.linalg.norm(part.positions[is_first], axis=1), 0.5, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(part.positions[~is_first] - (5, 0, 0), axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(part.colors[~is_first][:, :3], np.tile((0, 0, 1), ((~is_first).sum(), 1)))
    assert len(part.indices) == 2 * 128


@pytest.mark.parametrize(
    ("counts", "widths", "fault"),
    [
        ([5], [1.0], "curveVertexCounts: ask for 5 points, and there are 4"),
        ([-4, 8], [1.0], "curveVertexCounts: ask for 4 points"),
        ([4], [1.0, 2.0], "widths: 2 indices of 2 values do not fit 4 elements"),
    ],
)
def test_counts_that_do_not_fit_are_one_error(counts: list, widths: list, fault: str, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    curve = curves(made, [(0, 0, 0)] * 4, "bspline", widths=tuple(widths), of="vertex")
    curve.GetCurveVertexCountsAttr().Set(counts)
    with pytest.raises(SceneError, match=fault):
        load(saved(made))


def test_curves_and_points_are_counted_before_they_are_made(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    curves(made, S_CURVE, "bezier")
    path = saved(made)
    with pytest.raises(SceneError, match=r"World/curve: would take 152 vertices"):
        load(path, limits=pica.Limits(vertices=100))


@pytest.mark.parametrize("points", [[(0, 0, 0)] * 4, [(0, 0, 0), (0, 0, 0), (0, 1, 0), (0, 0, 0)]])
def test_curves_without_length_and_those_that_turn_back(points: list, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    curves(made, points, "linear")
    part = section(made)
    assert np.isfinite(part.positions).all() and np.abs(np.linalg.norm(part.normals, axis=1) - 1).max() < 1e-5


def test_tubes_do_not_twist_and_loops_close(tmp_path: Path) -> None:
    """Along a screw through all directions, ring vertices stay where the curve's bending takes them."""
    turns = np.linspace(0, 6 * math.pi, 200)
    made = stage(tmp_path / "a.usda")
    screw = np.stack([np.cos(turns), np.sin(turns), 0.3 * np.sin(3 * turns)], axis=1)
    curves(made, [tuple(place) for place in screw.tolist()], "linear", widths=(0.1,))
    part = section(made)
    sides = np.linalg.norm(np.diff(part.positions[part.indices], axis=1), axis=2).min(axis=1)
    assert sides.max() < 0.04  # a side of the octagon has 0.038; a twist makes both sides of a triangle longer
    closed = stage(tmp_path / "b.usda")
    loop = [(math.cos(turn), math.sin(turn), 0.4 * math.sin(2 * turn)) for turn in np.arange(12) * math.pi / 6]
    curves(closed, loop, "bspline", "periodic")
    part = section(closed)
    rounded = np.round(part.positions, 5)
    distinct, row = np.unique(rounded, axis=0, return_inverse=True)
    triangles = row.reshape(-1)[part.indices]
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all() and len(distinct) == 12 * 8 * 8
