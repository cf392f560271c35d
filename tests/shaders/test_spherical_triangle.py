"""spherical_triangle.slang: solid angles against closed forms, and directions that are uniform over them."""

import numpy as np
import pytest

from tests.shaders.test_sampling import COUNT

SOURCE = """
import shaders.spherical_triangle;

float solidAngle(float3 a, float3 b, float3 c) { return SphericalTriangle.create(a, b, c).solidAngle; }
float3 direction(float3 a, float3 b, float3 c, float2 u) { return SphericalTriangle.create(a, b, c).sample(u); }
float longest(float3 edge1, float3 edge2) { return TriangleCorner(0, edge1, edge2).longestEdge(); }
"""
OCTANT = np.eye(3, dtype=np.float32)
SLIVER = np.float32([(0.2, 0.9, 0.1), (-3.0, 0.2, 0.4), (0.1, -0.8, 0.3)])
"""Nearly half of all directions."""
SMALL = np.float32([(0.0, 0.0, 1.0), (0.06, 0.0, 1.0), (0.0, 0.06, 1.1)])


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def test_solid_angles(shader):
    assert shader.solidAngle(*OCTANT * 3) == pytest.approx(np.pi / 2, rel=1e-5)
    assert shader.solidAngle(*OCTANT[::-1]) == pytest.approx(np.pi / 2, rel=1e-5), "the order of corners is free"
    flat = np.float32([(1, 0, 0), (-0.5, 0.9, 0), (-0.5, -0.9, 0)])
    assert shader.solidAngle(*flat + np.float32((0, 0, 1e-4))) == pytest.approx(2 * np.pi, rel=1e-3)
    # A long strip seen from a millimetre before its plane, where rounding counts for much.
    strip = np.float64([(-5.0, 0.001, 0.001), (6.0, 0.001, 0.001), (6.0, 0.021, 0.001)])
    p, q, r = strip / np.linalg.norm(strip, axis=1, keepdims=True)
    exact = 2 * np.arctan2(abs(p @ np.cross(q, r)), 1 + p @ q + q @ r + r @ p)
    assert shader.solidAngle(*strip.astype(np.float32)) == pytest.approx(exact, rel=0.03)
    assert shader.solidAngle(*SMALL) == pytest.approx(0.06 * 0.06 / 2 / 1.03**3, rel=0.01)


@pytest.mark.parametrize("corners", [OCTANT, SLIVER, SMALL], ids=["octant", "sliver", "small"])
def test_directions_are_uniform_over_the_triangle(shader, corners):
    """A part of the triangle gets its share of the solid angle, whichever edge it is at."""
    u = np.random.default_rng(3).random((COUNT, 2), np.float32)
    found = shader.direction(*(np.broadcast_to(corner, (COUNT, 3)).copy() for corner in corners), u, _result="numpy")
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-5)
    weights = np.linalg.solve(corners.T.astype(np.float64), found.T.astype(np.float64)).T
    assert weights.min() > -1e-4 * weights.max(), "outside of the triangle"
    whole = shader.solidAngle(*corners)
    for first in range(3):
        a, b, c = np.roll(corners, first, 0)
        w = np.roll(weights, first, 1)
        # Nearer to b than where the arc from a to the middle of b and c is: b's weight is larger than c's.
        share = shader.solidAngle(a, b, (b + c) / 2) / whole
        assert (w[:, 1] > w[:, 2]).mean() == pytest.approx(share, abs=4 * np.sqrt(0.25 / COUNT))


def test_longest_edge(shader):
    x, y = np.float32((3, 0, 0)), np.float32((0, 4, 0))
    assert shader.longest(x, y) == pytest.approx(5)
    assert shader.longest(x, x / 2) == pytest.approx(3)
    assert shader.longest(x / 2, x) == pytest.approx(3)
