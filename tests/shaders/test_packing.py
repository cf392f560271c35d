"""packing.slang: what goes in comes out."""

import numpy as np

SOURCE = """
import shaders.packing;
uint pack(float3 n) { return packNormal(n); }
float3 unpack(uint bits) { return unpackNormal(bits); }
uint packHalves(float2 v) { return packHalf2(v); }
float2 unpackHalves(uint bits) { return unpackHalf2(bits); }
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


def test_halves_survive(load):
    v = np.float32([[0.5, -1.25], [65504, 7e-5], [0, -0.0], [0.1, 1000.5]])
    shader = load(SOURCE)
    bits = shader.packHalves(v, _result="numpy")
    np.testing.assert_array_equal(bits, v.astype(np.float16).view(np.uint32)[:, 0])
    np.testing.assert_array_equal(shader.unpackHalves(bits, _result="numpy"), v.astype(np.float16).astype(np.float32))
