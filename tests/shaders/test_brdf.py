"""brdf.slang: reciprocity, energy, and sampling that fits its density."""

import itertools

import numpy as np
import pytest
from scipy.stats import qmc

from tests.shaders.chi_squared import assert_fits, integrate

SOURCE = """
import shaders.brdf;
import shaders.ggx_energy;

BrdfParameters surface(float3 base, float metallic, float roughness, float f0, float f90)
{
    BrdfParameters p;
    p.baseColor = base;
    p.metallic = metallic;
    p.roughness = roughness;
    p.dielectricF0 = f0 * float3(1, 0.8, 1);
    p.dielectricF90 = f90;
    return p;
}

float3 diffuse(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 light)
{
    return BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).evaluate(light).diffuse;
}
float3 specular(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 light)
{
    return BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).evaluate(light).specular;
}
float density(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 light)
{
    return BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).pdf(light);
}
float4 direction(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 u)
{
    let s = BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).sample(u);
    return float4(s.direction, s.pdf);
}
float3 weight(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 u)
{
    return BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).sample(u).weight;
}
float specularDensity(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 light)
{
    return BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).pdfSpecular(light);
}
float4 specularDirection(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 u)
{
    let s = BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).sampleSpecular(u);
    return float4(s.direction, s.pdf);
}
float3 specularWeight(float3 base, float metallic, float roughness, float f0, float f90, float3 view, float3 u)
{
    return BrdfTowards.create(surface(base, metallic, roughness, f0, f90), view).sampleSpecular(u).weight;
}
float3 specularAlbedo(float3 base, float metallic, float roughness, float f0, float f90, float viewCosine)
{
    return environmentBrdf(surface(base, metallic, roughness, f0, f90), viewCosine).specular;
}
float3 albedo(float3 base, float metallic, float roughness, float f0, float f90, float viewCosine)
{
    let a = environmentBrdf(surface(base, metallic, roughness, f0, f90), viewCosine);
    return a.diffuse + a.specular;
}
float4 energy(float mu, float alpha)
{
    let e = GgxEnergy.create(alpha);
    return float4(e.at(mu).a, e.at(mu).b, e.at(mu).total, e.average().total);
}
float3 reflectance(float ior, float specular, float3 color) { return dielectricReflectance(ior, specular, color); }
"""
WHITE = np.float32([1, 1, 1])
ORANGE = np.float32([0.9, 0.5, 0.1])
BLACK = np.float32([0, 0, 0])
COSINES = [0.05, 0.3, 0.7, 0.999]
ROUGHNESSES = [0.0, 0.15, 0.3, 0.5, 0.75, 1.0]


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def view_at(cosine):
    return np.float32([np.sqrt(1 - cosine**2) * 0.8, np.sqrt(1 - cosine**2) * -0.6, cosine])


def hemisphere(count, seed=0):
    v = np.random.default_rng(seed).normal(size=(count, 3))
    v[:, 2] = np.abs(v[:, 2]) + 1e-3
    return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("metallic", [0.0, 0.4, 1.0])
def test_reciprocal(shader, metallic):
    view, light = hemisphere(5000, 1), hemisphere(5000, 2)
    for roughness, part in itertools.product(ROUGHNESSES, (shader.diffuse, shader.specular)):
        there = part(ORANGE, metallic, roughness, 0.04, 1.0, view, light, _result="numpy") / light[:, 2:]
        back = part(ORANGE, metallic, roughness, 0.04, 1.0, light, view, _result="numpy") / view[:, 2:]
        np.testing.assert_allclose(there, back, rtol=2e-3, atol=1e-6)


def furnace(shader, surface, cosine):
    """(3,) share of even light from everywhere that is reflected."""
    u = qmc.Sobol(3, seed=1).random(2**13).astype(np.float32)
    return shader.weight(*surface, view_at(cosine), u, _result="numpy").astype(np.float64).mean(0)


@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_white_furnace(shader, roughness):
    for cosine, metallic, f0 in itertools.product(COSINES, (0.0, 0.5, 1.0), (0.04, 0.5)):
        reflected = furnace(shader, (WHITE, metallic, roughness, f0, 1.0), cosine)
        np.testing.assert_allclose(reflected, 1, atol=0.01, err_msg=f"cosine {cosine} metallic {metallic} f0 {f0}")


@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_no_energy_is_gained_and_the_closed_form_fits(shader, roughness):
    dark_metal = (ORANGE, 1.0, roughness, 0.04, 1.0)
    for cosine in COSINES:
        for surface in (dark_metal, (ORANGE, 0.3, roughness, 0.08, 1.0), (ORANGE, 0.0, roughness, 0.02, 0.5)):
            reflected = furnace(shader, surface, cosine)
            assert reflected.max() < 1.005
            closed = shader.albedo(*surface, np.float32([cosine]), _result="numpy")[0]
            np.testing.assert_allclose(closed, reflected, atol=0.01)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6, 1.0])
def test_samples_of_the_specular_part_weigh_its_albedo(shader, roughness):
    """None fails, and none is lost below the horizon."""
    u = qmc.Sobol(3, seed=1).random(2**13).astype(np.float32)
    for cosine, metallic in itertools.product(COSINES, (0.0, 0.5, 1.0)):
        surface = (ORANGE, metallic, roughness, 0.04, 1.0)
        weights = shader.specularWeight(*surface, view_at(cosine), u, _result="numpy")
        assert (weights > 0).all()
        expected = shader.specularAlbedo(*surface, np.float32([cosine]), _result="numpy")[0]
        np.testing.assert_allclose(weights.astype(np.float64).mean(0), expected, atol=0.006, rtol=0.03)


@pytest.mark.parametrize("part", ["whole", "specular"])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.12, 0.4, 0.8, 1.0])
def test_samples_fit_their_density(shader, metallic, roughness, part):
    count = 60_000
    draw, pdf = {
        "whole": (shader.direction, shader.density),
        "specular": (shader.specularDirection, shader.specularDensity),
    }[part]
    u = np.random.default_rng(3).random((count, 3), np.float32)
    for cosine in (0.1, 0.6, 1.0):
        view = view_at(cosine)
        surface = (ORANGE, metallic, roughness, 0.2, 1.0)
        drawn = draw(*surface, view, u, _result="numpy")
        drawn = drawn[drawn[:, 3] > 0, :3].astype(np.float64)
        square = Around(view * np.float32([-1, -1, 1]), power=4 if roughness < 0.3 else 2)

        def density(points, square=square, view=view, surface=surface):
            light, measure = square.direction(points)
            return pdf(*surface, view, light, _result="numpy") * measure

        assert_fits(square.position(drawn), count, density, tests=48, bins=(20, 24), order=12)


class Around:
    """The sphere as a unit square whose first side starts at `axis`, finer there: 1 - cos = 2 t**power."""

    def __init__(self, axis, power):
        self.axis, self.power = axis.astype(np.float64), power
        self.x = np.cross(self.axis, [0, 0.8, 0.6] if abs(axis[0]) > 0.5 else [1, 0, 0])
        self.x /= np.linalg.norm(self.x)
        self.y = np.cross(self.axis, self.x)

    def direction(self, points):
        t, phi = points[:, 0], 2 * np.pi * points[:, 1]
        drop, slope = 2 * t**self.power, 2 * self.power * t ** (self.power - 1)
        sine = np.sqrt(np.maximum(drop * (2 - drop), 0))[:, None]
        v = self.axis * (1 - drop)[:, None] + sine * (self.x * np.cos(phi)[:, None] + self.y * np.sin(phi)[:, None])
        return v.astype(np.float32), slope * 2 * np.pi

    def position(self, v):
        drop = ((v - self.axis) ** 2).sum(1) / 2
        t = (drop / 2) ** (1 / self.power)
        return np.stack([t.clip(0, 1), np.arctan2(v @ self.y, v @ self.x) / (2 * np.pi) % 1], 1)


@pytest.mark.parametrize("roughness", [0.2, 0.6, 1.0])
def test_density_integrates_to_the_share_of_samples_that_succeed(shader, roughness):
    u = qmc.Sobol(3, seed=2).random(2**14).astype(np.float32)
    for cosine in (0.05, 0.4, 1.0):
        surface, view = (ORANGE, 1.0, roughness, 0.04, 1.0), view_at(cosine)
        square = Around(view * np.float32([-1, -1, 1]), power=4 if roughness < 0.3 else 2)

        def density(points, square=square, view=view, surface=surface):
            light, measure = square.direction(points)
            return shader.density(*surface, view, light, _result="numpy") * measure

        total = integrate(density, (48, 48), order=12).sum()
        succeeded = (shader.direction(*surface, view, u, _result="numpy")[:, 3] > 0).mean()
        assert total == pytest.approx(succeeded, abs=0.003) and total < 1.002


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_weight_is_value_over_density(shader, metallic):
    u = np.random.default_rng(4).random((4000, 3), np.float32)
    view = hemisphere(4000, 5)
    for roughness in ROUGHNESSES[1:]:
        surface = (ORANGE, metallic, roughness, 0.04, 1.0)
        light = shader.direction(*surface, view, u, _result="numpy")
        weight = shader.weight(*surface, view, u, _result="numpy")
        ok = light[:, 3] > 0
        directions = np.ascontiguousarray(light[:, :3])
        value = sum(f(*surface, view, directions, _result="numpy") for f in (shader.diffuse, shader.specular))
        pdf = shader.density(*surface, view, directions, _result="numpy")
        np.testing.assert_allclose(pdf[ok], light[ok, 3], rtol=0.02)
        np.testing.assert_allclose((weight * light[:, 3:])[ok], value[ok], rtol=0.02, atol=1e-6)
        assert (weight[~ok] == 0).all()


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_one_bounce_is_textbook_ggx(shader, metallic):
    # Walter et al. 2007, equations 20, 33, 34 with height-correlated masking, in double precision
    view, light = hemisphere(2000, 6).astype(np.float64), hemisphere(2000, 7).astype(np.float64)
    roughness, alpha = 0.4, 0.16
    h = view + light
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    tangent2 = 1 / h[:, 2] ** 2 - 1
    d = alpha**2 / (np.pi * h[:, 2] ** 4 * (alpha**2 + tangent2) ** 2)
    smith = [0.5 * (np.sqrt(1 + alpha**2 * (1 / v[:, 2] ** 2 - 1)) - 1) for v in (view, light)]
    f0 = ORANGE if metallic else 0.04 * np.array([1, 0.8, 1])
    fresnel = f0 + (1 - f0) * (1 - (view * h).sum(1)[:, None]) ** 5
    expected = fresnel * (d / (1 + smith[0] + smith[1]) / (4 * view[:, 2]))[:, None]
    views, lights = view.astype(np.float32), light.astype(np.float32)
    got = shader.specular(ORANGE, metallic, roughness, 0.04, 1.0, views, lights, _result="numpy")
    # what several bounces add is positive and small at this roughness
    assert (got - expected > -1e-5 * (1 + expected)).all() and (got - expected).max() < 0.06


def test_specular_zero_is_lambert(shader):
    view, light = hemisphere(1000, 8), hemisphere(1000, 9)
    for roughness in ROUGHNESSES:
        diffuse = shader.diffuse(ORANGE, 0.0, roughness, 0.0, 0.0, view, light, _result="numpy")
        np.testing.assert_allclose(diffuse, ORANGE * light[:, 2:] / np.pi, rtol=1e-5)
        assert (shader.specular(ORANGE, 0.0, roughness, 0.0, 0.0, view, light, _result="numpy") == 0).all()


def test_always_finite(shader):
    edge = np.float32([[0, 0, 1], [1, 0, 0], [1, 0, 1e-7], [-1, 0, 1e-4], [0, 0.6, -0.8], [0.6, 0, 0.8], [0, 0, -1]])
    view, light = (a.reshape(-1, 3).copy() for a in np.broadcast_arrays(edge[:, None], edge[None]))
    corners = [0.0, 1e-4, 0.5, 0.999999]
    u = np.float32(list(itertools.product(corners, corners, corners)))
    for base, metallic, roughness, (f0, f90) in itertools.product(
        (WHITE, BLACK), (0.0, 1.0), (0.0, 1.0), ((0.0, 0.0), (0.04, 1.0), (1.0, 1.0))
    ):
        surface = (base, metallic, roughness, f0, f90)
        for function in (shader.diffuse, shader.specular, shader.density):
            values = function(*surface, view, light, _result="numpy")
            assert np.isfinite(values).all() and (values >= 0).all()
            values = values.reshape(len(view), -1)
            assert (values[(view[:, 2] <= 0) | (light[:, 2] <= 0)] == 0).all()
        for v in edge:
            drawn, weight = (f(*surface, v, u, _result="numpy") for f in (shader.direction, shader.weight))
            assert np.isfinite(drawn).all() and np.isfinite(weight).all() and (weight >= 0).all()


@pytest.mark.parametrize("roughness", [0.5, 1.0])
def test_metals_keep_their_colour_over_several_bounces(shader, roughness):
    # Light that bounces between microfacets of reflectance f is a geometric series in f (1 - E): the sum of f E, then
    # f (1 - E) f E and so on; less the first, which is the single bounce (Kulla and Conty 2017, slide 16).
    mu = np.float32([0.1, 0.5, 0.9])
    a, b, total, average = shader.energy(mu, roughness**2, _result="numpy").astype(np.float64).T[:, :, None]
    f = (20 * ORANGE + 1) / 21
    series = sum(f * average * (f * (1 - average)) ** k for k in range(1, 60)) / (1 - average)
    expected = ORANGE * a + b + (1 - total) * series
    got = shader.albedo(ORANGE, 1.0, roughness, 0.04, 1.0, mu, _result="numpy")
    np.testing.assert_allclose(got, expected, atol=1e-4)


def test_weights_vary_little(shader):
    u = qmc.Sobol(3, seed=1).random(2**13).astype(np.float32)
    for roughness, metallic, cosine in itertools.product(ROUGHNESSES, (0.0, 1.0), (0.2, 0.9)):
        weight = shader.weight(WHITE, metallic, roughness, 0.04, 1.0, view_at(cosine), u, _result="numpy")
        assert weight.std() < 0.5


def test_dielectric_reflectance(shader):
    tinted, white = np.float32([[1, 0.5, 30]]), np.float32([WHITE])
    for ior, specular, color, expected in (
        (1.5, 1.0, tinted, [0.04, 0.02, 1]),
        (1.5, 0.5, tinted, [0.02, 0.01, 0.5]),
        (0.0, 1.0, white, 1),
        (1.0, 1.0, white, 0),
    ):
        got = shader.reflectance(ior, specular, color, _result="numpy")[0]
        np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-9)
