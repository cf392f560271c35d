"""packing.slang: what goes in comes out."""

import numpy as np

SOURCE = """
import shaders.packing;
uint pack(float3 n) { return packNormal(n); }
float3 unpack(uint bits) { return unpackNormal(bits); }
uint packCoarse(float3 n) { return packDirection(n) | 0xc0000000; }
float3 unpackCoarse(uint bits) { return unpackDirection(bits); }
uint packHalves(float2 v) { return packHalf2(v); }
float2 unpackHalves(uint bits) { return unpackHalf2(bits); }
float4 through16(float4 v) { return unpackFloat16x4(packFloat16x4(v)); }
float3 through21(float3 v) { return unpackFloat21x3(packFloat21x3(v)); }
"""


def test_normals_survive(load):
    shader = load(SOURCE)
    v = np.random.default_rng(0).normal(size=(100_000, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3), [[1, 1, 0], [-1, 0, 1], [0, -1, -1], [1e-4, 0, -1]]])
    normals = np.concatenate([v, axes])
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    back = shader.unpack(shader.pack(normals, _result="numpy"), _result="numpy")
    np.testing.assert_allclose(np.linalg.norm(back, axis=1), 1, atol=1e-6)
    assert np.linalg.norm(back - normals, axis=1).max() < 7e-5
    np.testing.assert_allclose(back[-10:-4], normals[-10:-4], atol=1e-7)
    coarse = shader.unpackCoarse(shader.packCoarse(normals, _result="numpy"), _result="numpy")
    assert np.linalg.norm(coarse - normals, axis=1).max() < 1.7e-3
    assert np.abs(np.linalg.norm(coarse, axis=1) - 1).max() < 1.7e-3


def test_halves_survive(load):
    v = np.float32([[0.5, -1.25], [65504, 7e-5], [0, -0.0], [0.1, 1000.5]])
    shader = load(SOURCE)
    bits = shader.packHalves(v, _result="numpy")
    np.testing.assert_array_equal(bits, v.astype(np.float16).view(np.uint32)[:, 0])
    np.testing.assert_array_equal(shader.unpackHalves(bits, _result="numpy"), v.astype(np.float16).astype(np.float32))


def test_three_wide_floats_survive(load):
    """Emission in nits: each channel keeps its own relative error, beside others that are a million times as great."""
    shader = load(SOURCE)
    v = (10 ** np.random.default_rng(0).uniform(-6, 9, (100_000, 3))).astype(np.float32)
    back = shader.through21(v, _result="numpy")
    assert (np.abs(back - v) / v).max() <= 2.0**-16
    ends = np.float32([[0, 0, 0], [1, 2, 4], [5e11, 3e-8, 0], [1e30, 1e-30, 1]])
    back = shader.through21(ends, _result="numpy")
    np.testing.assert_array_equal(back[:2], ends[:2])
    np.testing.assert_allclose(back[2], ends[2], rtol=2.0**-15)
    assert back[3, 0] > 5e11 and back[3, 1] == 0


def test_four_wide_floats_survive(load):
    shader = load(SOURCE)
    v = (10 ** np.random.default_rng(0).uniform(-6, 9, (100_000, 4))).astype(np.float32)
    back = shader.through16(v, _result="numpy")
    assert (np.abs(back - v) / v).max() <= 2.0**-11 + 2.0**-16
    ends = np.float32([[0, 0, 0, 0], [1, 2, 4, 8], [1e30, 1e-30, 1, 0]])
    back = shader.through16(ends, _result="numpy")
    np.testing.assert_array_equal(back[:2], ends[:2])
    assert back[2, 0] > 5e11 and back[2, 1] == 0
