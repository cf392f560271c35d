"""Textures of arrays: which channels and numbers there may be, and what becomes of them."""

import numpy as np
import pytest

import pica
from pica.scene.material import Image, Sampler, Texture, Wrap


def test_channels():
    grey = np.arange(6, dtype=np.uint8).reshape(2, 3)
    for array, expected in (
        (grey, [5, 5, 5, 255]),
        (grey[..., None], [5, 5, 5, 255]),
        (np.stack([grey, grey + 9], -1), [5, 5, 5, 14]),
        (np.stack([grey, grey + 1, grey + 2], -1), [5, 6, 7, 255]),
        (np.stack([grey, grey + 1, grey + 2, grey + 3], -1), [5, 6, 7, 8]),
    ):
        image = Image.from_array(array, encoding="srgb")
        assert image.pixels.shape == (2, 3, 4) and image.pixels.dtype == np.uint8
        np.testing.assert_array_equal(image.pixels[1, 2], expected)


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", ">f4"])
def test_floats_are_rounded_as_they_are(dtype):
    image = Image.from_array(np.linspace(0, 1, 511).reshape(1, -1).astype(dtype), encoding="linear")
    np.testing.assert_allclose(image.pixels[0, :, 0], np.arange(511) / 2, atol=0.7)
    assert image.pixels[0, 0, 0] == 0 and image.pixels[0, -1, 0] == 255


def test_textures_have_what_is_said():
    sampler = Sampler(Wrap.CLAMP_TO_EDGE, linear=False)
    texture = Texture.from_array([[0.0, 1.0]], encoding="linear", sampler=sampler, name="step")
    assert (texture.image.name, texture.image.encoding, texture.sampler) == ("step", "linear", sampler)
    assert Texture.from_array([[0.5]], encoding="srgb").sampler == Sampler()
    source = np.zeros((2, 2, 4), np.uint8)
    assert Image.from_array(source, encoding="srgb").pixels is not source, "a copy"
    assert Image(source).encoding is None


@pytest.mark.parametrize(
    ("array", "encoding", "fault"),
    [
        (np.ones(3), "srgb", "array: has the shape (3,), not (height, width) or (height, width, 1 to 4)"),
        (np.ones((2, 2, 5)), "srgb", "array: has the shape (2, 2, 5), not (height, width) or (height, width, 1 to 4)"),
        (np.ones((0, 2)), "srgb", "array: 2x0 texels; width and height must be 1 to 16384"),
        (np.ones((2, 2), int), "srgb", "array: an array of int64 is not an array of uint8, or of floats from 0 to 1"),
        (np.ones((2, 2), bool), "srgb", "array: an array of bool is not an array of uint8, or of floats from 0 to 1"),
        ("picture.png", "srgb", "array: 'picture.png' is not an array of uint8, or of floats from 0 to 1"),
        ([[0.5], [-0.25]], "linear", "array: row 1 is not from 0 to 1 (-0.25)"),
        ([[200.0]], "srgb", "array: row 0 is not from 0 to 1 (200); numbers up to 255 must be uint8"),
        ([[np.nan]], "srgb", "array: row 0 is not finite (nan)"),
        ([[0.5]], "sRGB", "encoding: 'sRGB' is not one of srgb, linear"),
        ([[0.5]], None, "encoding: None is not one of srgb, linear"),
        ([[0.5], [0.5, 1]], "srgb", "array: is not an array of uint8, or of floats from 0 to 1 ("),
    ],
)
def test_faults_in_words(array, encoding, fault):
    for kind in (Image, Texture):
        with pytest.raises(pica.SceneError) as caught:
            kind.from_array(array, encoding=encoding)
        assert str(caught.value).startswith(f"image: {fault}")
