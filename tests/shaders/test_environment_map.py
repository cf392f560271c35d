"""environment.slang and gpu_scene/lights/environment_tables.py: looked up and sampled light from all around."""

import math

import numpy as np
import pytest
import slangpy as spy
from scipy.stats import qmc

from pica.gpu_scene.lights.environment_tables import build_tables
from tests.shaders.chi_squared import assert_fits

SOURCE = """
__exported import shaders.environment;
float3 radianceFrom(EnvironmentMap map, float3 direction) { return environmentRadiance(map, direction); }
float density(EnvironmentMap map, float3 direction) { return environmentPdf(map, direction); }
float4 sampled(EnvironmentMap map, float2 u)
{
    let s = sampleEnvironment(map, u);
    return float4(s.direction, s.pdf);
}
float3 sampledRadiance(EnvironmentMap map, float2 u) { return sampleEnvironment(map, u).radiance; }
"""
COUNT = 100_000


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


@pytest.fixture(scope="module")
def upload(device):
    def make(radiance, strength=1.0, rotation=0.0):
        height, width, _ = radiance.shape
        texture = device.create_texture(
            format=spy.Format.rgba32_float,
            width=width,
            height=height,
            usage=spy.TextureUsage.shader_resource,
            data=np.dstack([radiance, np.ones((height, width))]).astype(np.float32),
        )
        repeat, clamp = spy.TextureAddressingMode.wrap, spy.TextureAddressingMode.clamp_to_edge
        marginal, conditional = (
            device.create_buffer(data=table.ravel(), struct_size=4, usage=spy.BufferUsage.shader_resource)
            for table in build_tables(radiance)
        )
        return {
            "radiance": texture,
            "sampler": device.create_sampler(address_u=repeat, address_v=clamp),
            "marginal": marginal,
            "conditional": conditional,
            "size": spy.uint2(width, height),
            "strength": strength,
            "rotation": rotation,
        }

    return make


@pytest.fixture(scope="module")
def peaky():
    """(32, 64, 3) a dim sky with a few very bright texels, one at each pole, one over the seam, and a dark half."""
    radiance = np.random.default_rng(0).uniform(0.1, 0.3, (32, 64, 3)).astype(np.float32)
    radiance[10, 20] = 500
    radiance[0, 5] = 300
    radiance[31, 40] = 300
    radiance[15, 0] = 100
    radiance[20:28, 30:40] = 0
    return radiance


def direction_of(uv):
    azimuth, polar = (uv[:, 0] - 0.5) * 2 * np.pi, uv[:, 1] * np.pi
    return np.stack([np.sin(polar) * np.cos(azimuth), np.cos(polar), np.sin(polar) * np.sin(azimuth)], 1)


def uv_of(v):
    u = 0.5 + np.arctan2(v[:, 2], v[:, 0]) / (2 * np.pi)
    return np.stack([u % 1, np.arccos(v[:, 1].clip(-1, 1)) / np.pi], 1)


def sphere_measure(uv):
    return 2 * np.pi**2 * np.sin(np.pi * uv[:, 1])


@pytest.mark.parametrize("rotation", [0.0, 2.0])
def test_samples_fit_their_density(shader, upload, peaky, rotation):
    sky = upload(peaky, rotation=rotation)
    drawn = shader.sampled(sky, np.random.default_rng(1).random((COUNT, 2), np.float32), _result="numpy")
    v = drawn[:, :3].astype(np.float64)
    turn = np.array([rotation / (2 * np.pi), 0])

    def density(uv):
        v = direction_of(uv - turn).astype(np.float32)
        return shader.density(sky, v, _result="numpy") * sphere_measure(uv)

    # bins are quarters of texels in the map's own frame, so that no edge of the density lies within one
    assert_fits((uv_of(v) + turn) % 1, COUNT, density, tests=2, bins=(128, 64), order=4)
    np.testing.assert_allclose(np.linalg.norm(v, axis=1), 1, atol=1e-6)
    pdf = shader.density(sky, np.ascontiguousarray(drawn[:, :3]), _result="numpy")
    # a direction may round into the next texel, rarely
    assert (np.abs(pdf / drawn[:, 3] - 1) < 1e-3).mean() > 0.999


def test_estimate_is_the_maps_integral(shader, upload, peaky):
    sky = upload(peaky, strength=2.0)
    grid = (np.arange(2048)[None, :] + 0.5) / 2048, (np.arange(1024)[:, None] + 0.5) / 1024
    uv = np.stack(np.broadcast_arrays(*grid), -1).reshape(-1, 2)
    everywhere = shader.radianceFrom(sky, direction_of(uv).astype(np.float32), _result="numpy")
    integral = (everywhere * sphere_measure(uv)[:, None]).mean(0, dtype=np.float64)
    u = qmc.Sobol(2, seed=0).random(2**16).astype(np.float32)
    radiance = shader.sampledRadiance(sky, u, _result="numpy")
    pdf = shader.sampled(sky, u, _result="numpy")[:, 3:]
    np.testing.assert_allclose((radiance / pdf).mean(0, dtype=np.float64), integral, rtol=5e-3)


def test_sampled_radiance_is_that_of_the_direction(shader, upload, peaky):
    sky, u = upload(peaky, 3.0, 1.0), np.random.default_rng(2).random((4000, 2), np.float32)
    v = np.ascontiguousarray(shader.sampled(sky, u, _result="numpy")[:, :3])
    v, radiance = v[np.abs(v[:, 1]) < 0.99], shader.sampledRadiance(sky, u, _result="numpy")[np.abs(v[:, 1]) < 0.99]
    np.testing.assert_allclose(shader.radianceFrom(sky, v, _result="numpy"), radiance, rtol=0.01, atol=0.2)


def test_nothing_lit_is_left_out(shader, upload, peaky):
    sky = upload(peaky)
    v = np.random.default_rng(3).normal(size=(200_000, 3)).astype(np.float32)
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    lit = shader.radianceFrom(sky, v, _result="numpy").max(1) > 0
    assert not lit.all() and (shader.density(sky, v, _result="numpy")[lit] > 0).all()


@pytest.mark.parametrize(
    ("direction", "column", "row"),
    [((1, 0, 0), 32, 16), ((0, 0, 1), 48, 16), ((-1, 0, 0), 0, 16), ((0, 0, -1), 16, 16), ((0.1, 1, 0.1), 40, 1)],
)
def test_orientation(shader, upload, direction, column, row):
    radiance = np.zeros((32, 64, 3), np.float32)
    radiance[max(row - 1, 0) : row + 1, [column - 1, column]] = 1  # the texels round the direction's point
    v = np.float32([direction]) / np.float32(np.linalg.norm(direction))
    assert shader.radianceFrom(upload(radiance), v, _result="numpy")[0, 0] == pytest.approx(1, abs=0.02)
    assert shader.radianceFrom(upload(radiance), -v, _result="numpy")[0, 0] == 0


def test_rotation_turns_from_z_towards_x(shader, upload):
    radiance = np.zeros((32, 64, 3), np.float32)
    radiance[15:17, 47:49] = 1  # at +Z
    turned = upload(radiance, rotation=math.pi / 2)
    seen = shader.radianceFrom(turned, np.float32([[1, 0, 0], [0, 0, 1]]), _result="numpy")[:, 0]
    np.testing.assert_allclose(seen, [1, 0], atol=1e-3)


def test_poles_and_black_maps_are_safe(shader, upload, peaky):
    poles = np.float32([[0, 1, 0], [0, -1, 0], [1e-30, 1, 0], [-1, 0, -1e-8], [-1, 0, 0]])
    for sky in (upload(peaky), upload(np.zeros_like(peaky)), upload(np.ones((1, 1, 3), np.float32))):
        u = np.float32([[0, 0], [0.999999, 0.999999], [0, 0.999999], [0.5, 0.5]])
        for values in (
            shader.radianceFrom(sky, poles, _result="numpy"),
            shader.density(sky, poles, _result="numpy"),
            shader.sampled(sky, u, _result="numpy"),
        ):
            assert np.isfinite(values).all()
        assert (shader.sampled(sky, u, _result="numpy")[:, 3] > 0).all()
    even = shader.sampled(upload(np.ones((1, 1, 3), np.float32)), u, _result="numpy")[:, 3]
    np.testing.assert_allclose(even, 1 / (4 * np.pi), rtol=1e-5)


def test_tables_are_cumulative_and_fine_enough():
    radiance = np.full((512, 1024, 3), 1e-3, np.float32)
    radiance[100, 100] = 1e6
    marginal, conditional = build_tables(radiance)
    assert marginal.shape == (512,) and conditional.shape == (512, 1024)
    assert marginal[-1] == 1 and (conditional[:, -1] == 1).all()
    assert (np.diff(marginal) > 0).all() and (np.diff(conditional, axis=1) > 0).all()
