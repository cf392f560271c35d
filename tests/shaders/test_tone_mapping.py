"""color.slang: the sRGB curve and the tone mapper."""

import numpy as np
import pytest

SOURCE = """
import shaders.color;
float brightness(float3 c) { return luminance(c); }
float3 encode(float3 c) { return encodeSrgb(c); }
float3 decode(float3 c) { return decodeSrgb(c); }
float3 neutral(float3 c) { return toneMapNeutral(c); }
"""


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def test_srgb(shader):
    grey = np.repeat(np.linspace(0, 1, 256, dtype=np.float32)[:, None], 3, 1)
    linear = np.where(grey <= 0.04045, grey / 12.92, ((grey + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(shader.decode(grey, _result="numpy"), linear, atol=1e-6)
    np.testing.assert_allclose(shader.encode(linear.astype(np.float32), _result="numpy"), grey, atol=1e-5)
    np.testing.assert_allclose(shader.encode(np.float32([[-1, 0, 7]]), _result="numpy"), [[0, 0, 1]], atol=1e-6)


def test_luminance_of_white_is_one(shader):
    assert shader.brightness(np.float32([[1, 1, 1]]), _result="numpy")[0] == pytest.approx(1)


def test_neutral_keeps_base_colors_and_compresses_highlights(shader):
    # Khronos PBR Neutral: a base colour lit to itself plus 4 % reflection comes out as the base colour ...
    base = np.random.default_rng(0).uniform(0.04, 0.7, (100, 3)).astype(np.float32)
    np.testing.assert_allclose(shader.neutral(base + 0.04, _result="numpy"), base, atol=1e-6)
    # ... brighter ones stay below 1, in order, and fade to white.
    ramp = np.float32([1, 0.5, 0.2]) * np.logspace(0, 5, 50, dtype=np.float32)[:, None]
    mapped = shader.neutral(ramp, _result="numpy")
    assert (np.diff(mapped, axis=0) > 0).all() or (np.diff(mapped.max(1)) >= 0).all()
    assert mapped.max() <= 1 and mapped[-1].min() > 0.99
    # Value by hand: peak 1.96 after the offset, 1 - 0.24^2 / (1.96 + 0.24 - 0.76) = 0.96
    np.testing.assert_allclose(shader.neutral(np.float32([2, 2, 2]), _result="numpy"), 0.96, atol=1e-6)


def test_neutral_is_continuous_where_the_toe_ends(shader):
    around = shader.neutral(np.float32([[0.0799, 0.2, 0.3], [0.0801, 0.2, 0.3]]), _result="numpy")
    np.testing.assert_allclose(around[0], around[1], atol=3e-4)
    assert (shader.neutral(np.float32([[0, 0, 0]]), _result="numpy") == 0).all()
