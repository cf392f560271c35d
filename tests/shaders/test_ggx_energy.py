"""ggx_energy.slang: the fits against integration."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

SOURCE = """
import shaders.ggx_energy;
float2 albedo(float mu, float alpha) { let e = GgxEnergy.create(alpha).at(mu); return float2(e.a, e.b); }
float2 averaged(float alpha) { let e = GgxEnergy.create(alpha).average(); return float2(e.a, e.b); }
"""
TOOL = Path(__file__).parents[2] / "tools" / "fit_ggx_energy.py"


@pytest.fixture(scope="module")
def integrate():
    spec = importlib.util.spec_from_file_location("fit_ggx_energy", TOOL)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool.integrate


def test_albedo_fits_its_integral(load, integrate):
    # off the grid that was fitted
    mu, roughness = np.meshgrid([0.003, 0.03, 0.11, 0.27, 0.52, 0.77, 0.999], [0.04, 0.11, 0.23, 0.47, 0.71, 0.97])
    mu, alpha = mu.ravel().astype(np.float32), (roughness.ravel() ** 2).astype(np.float32)
    expected = np.array([integrate(float(m), float(a)) for m, a in zip(mu, alpha, strict=True)])
    got = load(SOURCE).albedo(mu, alpha, _result="numpy")
    assert np.abs(got.sum(1) - expected.sum(1)).max() < 0.005
    assert np.abs(got[:, 1] - expected[:, 1]).max() < 0.005


def test_integration_agrees_with_distribution_sampling(integrate):
    # A second way to the same number: normals drawn by D cos, Walter et al. 2007, equations 35 and 41.
    mu, alpha, count = 0.4, 0.5, 1_000_000
    u = np.random.default_rng(0).random((2, count))
    tangent = alpha * np.sqrt(u[0] / (1 - u[0]))
    z = 1 / np.sqrt(1 + tangent**2)
    x = np.sqrt(1 - z * z) * np.cos(2 * np.pi * u[1])
    cosine = np.sqrt(1 - mu * mu) * x + mu * z
    light_z = 2 * cosine * z - mu
    valid = (cosine > 0) & (light_z > 0)
    spread = [0.5 * (np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) - 1) for c in (mu, np.where(valid, light_z, 1))]
    weight = np.where(valid, cosine / (mu * z) / (1 + spread[0] + spread[1]), 0)
    assert sum(integrate(mu, alpha)) == pytest.approx(weight.mean(), abs=0.003)


def test_average_is_that_of_the_fit(load):
    shader = load(SOURCE)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    mu = ((nodes + 1) / 2) ** 2
    for roughness in (0.04, 0.1, 0.2, 0.4, 0.6, 0.8, 1):
        albedo = shader.albedo(mu.astype(np.float32), roughness**2, _result="numpy")
        average = (2 * mu * np.sqrt(mu) * weights) @ albedo  # dmu = sqrt(mu) dnode
        got = shader.averaged(np.float32([roughness**2]), _result="numpy")[0]
        np.testing.assert_allclose(got, average, atol=3e-4)
        assert 1 - got.sum() == pytest.approx(1 - average.sum(), rel=0.03, abs=2e-6)
