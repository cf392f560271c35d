"""sampling.slang: every sampler against its density, and rays that leave their surface."""

import numpy as np
import pytest

from tests.shaders.chi_squared import assert_fits

SOURCE = """
import shaders.sampling;

float3x3 basis(float3 normal) { Basis b = Basis.create(normal); return float3x3(b.x, b.y, b.z); }
float3 roundTrip(float3 normal, float3 v) { Basis b = Basis.create(normal); return b.toWorld(b.toLocal(v)); }
float2 disk(float2 u) { return sampleDisk(u); }
float3 cosine(float2 u) { return sampleCosineHemisphere(u); }
float cosinePdf(float z) { return cosineHemispherePdf(z); }
float3 sphere(float2 u) { return sampleSphere(u); }
float3 cone(float width, float2 u) { return sampleCone(width, u); }
float coneDensity(float width) { return conePdf(width); }
float arc(float x) { return arcCosine(x); }
float narrow(float sine) { return oneMinusCosine(sine); }
float2 triangle(float2 u) { return sampleTriangle(u); }
float3 rectangle(float3 center, float3 x, float3 y, float2 u)
{
    return SphericalRectangle.create(center, x, y).sample(u);
}
float rectangleAngle(float3 center, float3 x, float3 y) { return SphericalRectangle.create(center, x, y).solidAngle; }
float balance(float a, float b) { return balanceHeuristic(a, b); }
float power(float a, float b) { return powerHeuristic(a, b); }
"""
COUNT = 100_000


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


@pytest.fixture(scope="module")
def u():
    return np.random.default_rng(1).random((COUNT, 2), np.float32)


def unit_vectors(count):
    v = np.random.default_rng(2).normal(size=(count, 3))
    return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)


def azimuth(v):
    return np.arctan2(v[:, 1], v[:, 0]) / (2 * np.pi) % 1


def test_basis_is_orthonormal_and_right_handed(shader):
    normals = np.concatenate([unit_vectors(1000), np.float32([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 1, -1e-7]])])
    axes = shader.basis(normals, _result="numpy")
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-6)
    np.testing.assert_array_equal(axes[:, 2], normals)
    v = unit_vectors(len(normals))[::-1].copy()
    np.testing.assert_allclose(shader.roundTrip(normals, v, _result="numpy"), v, atol=1e-6)


def test_disk_is_uniform(shader, u):
    p = shader.disk(u, _result="numpy")
    square = np.stack([(p**2).sum(1).clip(0, 1), azimuth(p)], 1)  # r^2 and the angle are uniform
    assert_fits(square, COUNT, lambda x: np.ones(len(x)), tests=7)


def test_cosine_hemisphere_fits_its_density(shader, u):
    v = shader.cosine(u, _result="numpy")
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), 1, atol=1e-5)
    assert_fits(np.stack([v[:, 2], azimuth(v)], 1), COUNT, lambda x: cosine_density(shader, x), tests=7)


def cosine_density(shader, x):
    return 2 * np.pi * shader.cosinePdf(x[:, 0].astype(np.float32), _result="numpy")


def test_sphere_is_uniform(shader, u):
    v = shader.sphere(u, _result="numpy")
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), 1, atol=1e-5)
    assert_fits(np.stack([(v[:, 2] + 1) / 2, azimuth(v)], 1), COUNT, lambda x: np.ones(len(x)), tests=7)


@pytest.mark.parametrize("sine", [0.00465, 0.5])
def test_cone_fits_its_density(shader, u, sine):
    width = shader.narrow(sine)
    assert width == pytest.approx(1 - np.sqrt(1 - np.float64(sine) ** 2), rel=1e-5)
    v = shader.cone(width, u, _result="numpy").astype(np.float64)
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), 1, atol=1e-6)
    drop = (v[:, :2] ** 2).sum(1) / (1 + v[:, 2])  # 1 - cosine
    area = 2 * np.pi * width
    inside = np.stack([np.minimum(drop / width, 1), azimuth(v)], 1)
    assert_fits(inside, COUNT, lambda x: np.full(len(x), shader.coneDensity(width) * area), tests=7)


def test_triangle_is_uniform(shader, u):
    b = shader.triangle(u, _result="numpy").astype(np.float64)
    assert (b >= 0).all() and (b.sum(1) <= 1).all()
    # Back to the unit square by the inverse of the square root map
    side = b.sum(1)
    assert_fits(np.stack([side**2, b[:, 1] / np.maximum(side, 1e-9)], 1), COUNT, lambda x: np.ones(len(x)), tests=7)


RECTANGLES = {
    "in front": ([0, 0, 2], [1, 0, 0], [0, 0.5, 0]),
    "aside, turned, behind": ([2, -1, -0.5], [0.6, 0.8, 0], [-1.6, 1.2, 0]),
    "near": ([0.3, 0.2, 0.05], [1, 0, 0], [0, 1, 0]),
}


@pytest.mark.parametrize("name", RECTANGLES)
def test_rectangle_is_uniform_in_solid_angle(shader, u, name):
    center, x, y = (np.float32(v) for v in RECTANGLES[name])
    solid_angle = float(shader.rectangleAngle(np.float32([center]), x, y, _result="numpy")[0])
    points = shader.rectangle(center, x, y, u, _result="numpy").astype(np.float64)
    on_plane = np.stack([(points - center) @ x / (x @ x), (points - center) @ y / (y @ y)], 1)
    np.testing.assert_allclose(
        points, center + on_plane[:, :1] * x + on_plane[:, 1:] * y, atol=1e-5 * np.abs(points).max()
    )
    normal = np.cross(x, y).astype(np.float64)

    def density(square):
        p = center + (2 * square[:, :1] - 1) * x + (2 * square[:, 1:] - 1) * y
        distance = np.linalg.norm(p, axis=1)
        return np.abs(p @ normal) * 4 / distance**3 / solid_angle  # normal has the length of a quarter of the area

    assert_fits((on_plane + 1) / 2, COUNT, density, tests=3, bins=(24, 24), order=8)


def test_rectangle_fills_its_share_of_a_cube(shader):
    center, x, y = np.float32([[0, 0, 1]]), np.float32([1, 0, 0]), np.float32([0, 1, 0])
    assert shader.rectangleAngle(center, x, y, _result="numpy")[0] == pytest.approx(4 * np.pi / 6, rel=1e-5)


def test_arc_cosine_is_precise(shader):
    x = np.linspace(-1, 1, 10_001, dtype=np.float32)
    np.testing.assert_allclose(shader.arc(x, _result="numpy"), np.arccos(x.astype(np.float64)), atol=1e-6)


def test_heuristics_add_up(shader):
    a, b = np.float32([1, 0.2, 1e-6, 5]), np.float32([1, 3, 10, 0])
    np.testing.assert_allclose(shader.balance(a, b, _result="numpy"), a / (a + b), rtol=1e-5)
    np.testing.assert_allclose(shader.power(a, b, _result="numpy"), a**2 / (a**2 + b**2), rtol=1e-5)
    assert shader.balance(0.0, 0.0) == 0 and shader.power(0.0, 1.0) == 0
