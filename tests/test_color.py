import numpy as np
import pytest

from pica.color import luminance, srgb_decode, srgb_encode


def test_srgb_against_values_of_the_standard():
    linear = np.array([-1.0, 0.0, 0.0031308, 0.214041, 0.5, 1.0, 7.0])
    assert np.allclose(srgb_encode(linear), [0, 0, 0.04045, 0.5, 0.735357, 1, 1], atol=2e-6)


def test_luminance_of_white_is_one():
    assert np.allclose(luminance(np.ones((2, 2, 3))), 1)
    assert np.allclose(luminance(np.eye(3)), [0.2126, 0.7152, 0.0722])


def test_decoding_undoes_encoding():
    values = np.linspace(0, 1, 1001, dtype=np.float32)
    assert srgb_decode(srgb_encode(values)) == pytest.approx(values, abs=1e-6)
