"""color.slang, tone_curves.slang: the sRGB curve and the tone maps."""

import numpy as np
import pytest

SOURCE = """
import shaders.color;
import effects.post.tone_curves;
float3 agx(float3 c) { return toneMap(c, 1); }
float3 aces(float3 c) { return toneMap(c, 2); }
float3 clipped(float3 c) { return toneMap(c, 3); }
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


COLORS = np.float32(np.random.default_rng(1).uniform(0, 1, (200, 3)) * np.logspace(-4, 4, 200)[:, None])


def test_agx_is_the_published_fit(shader):
    """Wrensch 2023, "Minimal AgX Implementation" (iolite-engine.com): agx, agxDefaultContrastApprox, agxEotf."""
    # The constructors of GLSL take columns.
    inset = np.array(
        [
            [0.842479062253094, 0.0423282422610123, 0.0423756549057051],
            [0.0784335999999992, 0.878468636469772, 0.0784336],
            [0.0792237451477643, 0.0791661274605434, 0.879142973793104],
        ]
    )
    outset = np.array(
        [
            [1.19687900512017, -0.0528968517574562, -0.0529716355144438],
            [-0.0980208811401368, 1.15190312990417, -0.0980434501171241],
            [-0.0990297440797205, -0.0989611768448433, 1.15107367264116],
        ]
    )
    x = np.clip(np.log2(np.maximum(COLORS.astype(np.float64) @ inset, 1e-10)), -12.47393, 4.026069)
    x = (x + 12.47393) / (4.026069 + 12.47393)
    encoded = np.polyval([15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232], x)
    expected = np.clip(np.maximum(encoded @ outset, 0) ** 2.2, 0, 1)
    assert expected.min() < 0.01 and expected.max() > 0.95
    np.testing.assert_allclose(shader.agx(COLORS, _result="numpy"), expected, atol=1e-3)


def test_aces_is_hill_s_fit(shader):
    """github.com/TheRealMJP/BakingLab, ACES.hlsl: ACESFitted."""
    first = np.array([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]])
    last = np.array([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]])
    v = COLORS.astype(np.float64) @ first.T
    v = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    np.testing.assert_allclose(shader.aces(COLORS, _result="numpy"), np.clip(v @ last.T, 0, 1), atol=1e-3)


@pytest.mark.parametrize("curve", ["agx", "aces", "clipped", "neutral"])
def test_no_light_is_too_bright_for_a_tone_map(shader, curve):
    brightest = getattr(shader, curve)(np.float32([[1e36, 1e30, 1e36], [0, 0, 0]]), _result="numpy")
    assert np.isfinite(brightest).all()
    assert brightest[0].max() == pytest.approx(1, abs=0.05) and brightest[1].max() < 1e-3
