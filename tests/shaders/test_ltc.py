"""ltc.slang: light from whole shapes under a cosine, against closed forms and sums over many small pieces."""

import numpy as np
import pytest

SOURCE = """
import effects.lighting.ltc;

struct Quad : IOutline
{
    float3 center;
    float3 x;
    float3 y;
    uint cornerCount() { return 4; }
    float3 corner(uint i) { return center + (i == 0 || i == 3 ? x : -x) + (i < 2 ? y : -y); }
}
static const float3x3 upright = float3x3(1, 0, 0, 0, 1, 0, 0, 0, 1);

float2 ellipse(float3 center, float3 x, float3 y)
{
    let found = integrateEllipse(center, x, y, upright, float3(0, 0, 1));
    return float2(found.share, found.meanCosine);
}
float2 quad(float3 center, float3 x, float3 y)
{
    Quad outline = { center, x, y };
    let found = integratePolygon(outline, upright, float3(0, 0, 1));
    return float2(found.share, found.meanCosine);
}
float transformed(float3 center, float3 x, float3 y, float3 row0, float3 row1, float3 row2)
{
    Quad outline = { center, x, y };
    return integratePolygon(outline, float3x3(row0, row1, row2), float3(0, 0, 1)).share;
}
float3 restored(float3 row0, float3 row1, float3 row2, float3 v)
{
    let m = float3x3(row0, row1, row2);
    return fromCosine(m, normalize(mul(m, v)));
}
"""


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def rows(*vectors):
    return [np.float32([vector]) for vector in vectors]


def shapes(count=24):
    """Centres and half axes near and far, above, across and below the horizon."""
    random = np.random.default_rng(5)
    for _ in range(count):
        center = random.normal(size=3)
        x = random.normal(size=3) * random.choice([0.05, 0.4, 1.5])
        y = np.cross(x, random.normal(size=3))
        yield center, x, y * np.linalg.norm(x) / np.linalg.norm(y) * random.uniform(0.3, 1)


def summed(center, x, y, round_shape):
    """Irradiance over pi and mean cosine by 700 x 700 pieces."""
    u = (np.arange(700) + 0.5) / 350 - 1
    u, v = (grid.ravel() for grid in np.meshgrid(u, u))
    keep = u**2 + v**2 < 1 if round_shape else np.ones(len(u), bool)
    points = center + u[keep, None] * x + v[keep, None] * y
    square = (points**2).sum(1)
    area = np.cross(x, y) * 4 / len(u)
    cosine = np.maximum(points[:, 2] / np.sqrt(square), 0)
    angle = np.abs(points @ area) / square**1.5
    share = (angle * cosine).sum() / np.pi
    return share, (angle * cosine**2).sum() / np.pi / max(share, 1e-12)


@pytest.mark.parametrize("kind", ["quad", "ellipse"])
def test_shares_of_shapes_above_across_and_below_the_horizon(shader, kind):
    cut = 0
    for center, x, y in shapes():
        share, mean = summed(center, x, y, kind == "ellipse")
        got = getattr(shader, kind)(*rows(center, x, y), _result="numpy")[0]
        assert got[0] == pytest.approx(share, rel=0.015, abs=2e-5)
        reach = np.hypot(x[2], y[2]) if kind == "ellipse" else abs(x[2]) + abs(y[2])
        if share > 1e-4 and center[2] > reach:
            assert got[1] == pytest.approx(mean, abs=0.06)
        cut += share > 1e-3 and center[2] < reach
    assert cut >= 3


def test_a_rectangle_over_its_corner(shader):
    """Form factor of a parallel rectangle a x b over a point below its corner (Howell's catalogue, B-3)."""
    a, b = 1.0, 2.0
    factor = sum(p / np.hypot(1, p) * np.arctan(q / np.hypot(1, p)) for p, q in ((a, b), (b, a))) / (2 * np.pi)
    got = shader.quad(*rows((0.5, 1, 1), (0.5, 0, 0), (0, 1, 0)), _result="numpy")[0]
    assert got[0] == pytest.approx(factor, rel=1e-4)


@pytest.mark.parametrize("tangent", [1e-3, 0.1, 1.0, 20.0])
def test_a_disk_on_its_axis(shader, tangent):
    """Share and mean cosine of a circular cone: sin^2, and 2 (1 - cos^3) / (3 sin^2)."""
    got = shader.ellipse(*rows((0, 0, 1), (tangent, 0, 0), (0, tangent, 0)), _result="numpy")[0]
    sine, cosine = tangent / np.hypot(1, tangent), 1 / np.hypot(1, tangent)
    assert got[0] == pytest.approx(sine**2, rel=1e-4)
    assert got[1] == pytest.approx(2 * (1 - cosine**3) / (3 * sine**2), rel=1e-3)


def test_a_half_sphere_fills_what_lies_above_the_horizon(shader):
    """A wall up to the zenith, a quarter of all directions: half of the light, whatever the lobe's transformation."""
    wall = rows((1e-4, 0, 0), (0, 0, 10), (0, 10, 0))
    assert shader.quad(*wall, _result="numpy")[0, 0] == pytest.approx(0.5, abs=1e-3)
    stretched = rows((0.2, 0, 0), (0, 1, 0), (0, 0, 0.3))
    assert shader.transformed(*wall, *stretched, _result="numpy")[0] == pytest.approx(0.5, abs=1e-3)


def test_directions_return_from_the_cosine(shader):
    random = np.random.default_rng(2)
    matrix, direction = random.normal(size=(3, 3)), random.normal(size=3)
    matrix *= np.sign(np.linalg.det(matrix))
    got = shader.restored(*rows(*matrix, direction), _result="numpy")[0]
    np.testing.assert_allclose(got, direction / np.linalg.norm(direction), atol=1e-5)
