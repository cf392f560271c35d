"""Meshes bent along a spline, in NumPy."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from pica.errors import SceneError
from pica.scene.model import Mesh
from pica.scene.spline import Spline, bend
from pica.scenes.basic_meshes import box, cylinder, pipe
from pica.scenes.placing import at, rotate
from tests.building import lambert

POINTS = np.array([(-2, 0.3, 0), (-1, 0.5, 1), (0, 0.3, -1), (1, 1, 0), (2, 0.3, 0.5)], float)


def test_the_curve_is_the_cubic_b_spline_through_its_ends():
    spline = Spline(POINTS)
    padded = np.concatenate([2 * POINTS[:1] - POINTS[1:2], POINTS, 2 * POINTS[-1:] - POINTS[-2:-1]])
    expected = BSpline(np.arange(-3, len(padded) + 1), padded, 3)
    parameters = np.linspace(0, 4, 23)
    at_them = spline.frame(parameters)
    np.testing.assert_allclose(at_them["center"], expected(parameters), atol=1e-12)
    np.testing.assert_allclose(at_them["d_center"], expected(parameters, 1), atol=1e-12)
    np.testing.assert_allclose(at_them["center"][[0, -1]], POINTS[[0, -1]], atol=1e-12)


def test_frames_are_square_and_change_as_they_say():
    spline = Spline(POINTS, rolls=[0, 0.5, -0.3, 1, 0], scales=[1, 2, 1, 0.5, 1])
    t, step = np.linspace(0.1, 3.87, 31), 1e-6
    here, before, after = (spline.frame(t + d) for d in (0, -step, step))
    forward = here["d_center"] / np.linalg.norm(here["d_center"], axis=1, keepdims=True)
    axes = np.stack([here["side"], here["up"], forward], 1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.tile(np.eye(3), (31, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-12)
    for name in ("center", "side", "up", "scale"):
        np.testing.assert_allclose(here["d_" + name], (after[name] - before[name]) / (2 * step), atol=1e-7)


def test_a_straight_spline_leaves_a_mesh_as_it_is():
    section = box((0.3, 0.2, 4), lambert())
    node = bend(Mesh([section]), Spline([(0, 0, -2), (0, 0, 0), (0, 0, 2)]))
    positions, normals, tangents = node.deformer.deform(node.mesh.sections[0])
    np.testing.assert_allclose(positions, section.positions, atol=1e-6)
    np.testing.assert_allclose(normals, section.normals, atol=1e-6)
    np.testing.assert_allclose(tangents, section.tangents, atol=1e-6)


def test_a_mesh_stretches_evenly_and_repeats_end_to_end():
    uneven = [(0, 0, 0), (0, 0, 0.5), (0, 0, 1), (0, 0, 5), (0, 0, 9)]
    node = bend(Mesh([at(cylinder(0.1, 1.0, lambert()), rotate("x", 90))]), Spline(uneven), copies=9)
    positions, _, _ = node.deformer.deform(node.mesh.sections[0])
    ends = np.unique(np.round(positions[:, 2], 3))
    np.testing.assert_allclose(ends, np.arange(10), atol=2e-3)


def test_normals_are_those_of_the_bent_surface():
    """Against the normals of a finely divided tube's own triangles."""
    spline = Spline(POINTS, rolls=[0, 0.5, -0.3, 1, 0], scales=[1, 1.4, 1, 0.5, 1])
    rings = [pipe([(0, 0, z) for z in np.linspace(0, 4, 400)], 0.3, lambert(), 96)]
    node = bend(Mesh(rings), spline)
    (section,) = node.mesh.sections
    positions, normals, tangents = node.deformer.deform(section)
    corners = positions[section.indices]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1, keepdims=True)
    side = np.abs(section.normals[section.indices].mean(1)[:, 2]) < 0.5
    cosine = np.sum(across / area * normals[section.indices].mean(1), axis=1)[side]
    assert np.percentile(cosine, 1) > 0.999
    np.testing.assert_allclose(np.sum(normals * tangents[:, :3], axis=1), 0, atol=1e-9)


def test_a_vertical_loop_never_turns_over():
    angle = np.linspace(0, 2 * np.pi, 13)
    points = np.stack([0.2 * angle, 1 - np.cos(angle), np.sin(angle)], -1)
    ups = Spline(points).frame(np.linspace(0, 12, 200))["up"]
    assert (np.sum(ups[1:] * ups[:-1], axis=1) > 0.98).all()


@pytest.mark.parametrize(
    "make",
    [
        lambda: Spline([(0, 0, 0)]),
        lambda: Spline([(0, 0), (1, 1)]),
        lambda: Spline(POINTS, rolls=[0, 1]),
        lambda: Spline(POINTS).set(POINTS[:3]),
        lambda: Spline(POINTS * np.nan),
        lambda: bend(Mesh([box(1, lambert())]), Spline(POINTS), copies=0),
    ],
)
def test_bad_splines_are_refused(make):
    with pytest.raises(SceneError, match=r"spline|bend"):
        make()
