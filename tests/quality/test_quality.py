import flip_evaluator
import numpy as np
import pytest

from pica import quality
from pica.color import luminance, srgb_encode
from pica.errors import PicaError
from pica.quality.sheet import magma


@pytest.fixture
def pair():
    random = np.random.default_rng(0)
    reference = random.random((48, 64, 3), np.float32)
    return reference, np.clip(reference + random.normal(0, 0.05, reference.shape), 0, 1).astype(np.float32)


def test_flip_is_zero_for_equal_and_one_for_black_against_white(pair):
    assert quality.flip(pair[0], pair[0])[0] == 0
    mean, error = quality.flip(np.zeros((32, 32, 3)), np.ones((32, 32, 3)))
    assert mean > 0.9 and error.shape == (32, 32)


def test_flip_takes_srgb_values(pair):
    linear, _, _ = flip_evaluator.evaluate(*pair, "LDR", inputsRGB=False, applyMagma=False)
    assert np.allclose(quality.flip(srgb_encode(pair[0]), srgb_encode(pair[1]))[1], linear[..., 0], atol=1e-3)


def test_psnr_of_a_known_error(pair):
    assert quality.psnr(np.zeros((4, 4, 3)), np.full((4, 4, 3), 0.1)) == pytest.approx(20)
    assert quality.psnr(pair[0], pair[0]) == 120


def test_relative_mse_of_a_known_error():
    reference, test = np.full((4, 4, 3), 2.0), np.full((4, 4, 3), 2.2)
    assert quality.relative_mse(reference, test) == pytest.approx(0.04 / 4.01)


def test_compare_joins_the_three(pair):
    reference, test = pair
    errors = quality.compare(reference, test, exposure=0.5)
    shown, seen = srgb_encode(reference * 0.5), srgb_encode(test * 0.5)
    expected = {
        "flip": quality.flip(shown, seen)[0],
        "psnr": quality.psnr(shown, seen),
        "relmse": quality.relative_mse(reference, test),
    }
    assert errors.numbers() == expected
    assert errors.flip_map.mean() == pytest.approx(errors.flip, rel=1e-4)


def test_scale_does_not_matter_to_what_is_seen(pair):
    reference, test = pair
    plain, scaled = quality.compare(reference, test), quality.compare(reference * 1000, test * 1000)
    assert scaled.flip == pytest.approx(plain.flip, rel=1e-3)
    assert scaled.psnr == pytest.approx(plain.psnr, rel=1e-4)


def test_exposure_is_deaf_to_fireflies_and_black(pair):
    reference = pair[0]
    exposure = quality.exposure_for(reference)
    assert np.percentile(luminance(reference) * exposure, 90) == pytest.approx(0.8)
    speckled = reference.copy()
    speckled[5, 5] = 1e6
    assert quality.exposure_for(speckled) == pytest.approx(exposure, rel=0.01)
    assert quality.exposure_for(np.concatenate([reference, np.zeros_like(reference)])) == pytest.approx(exposure)
    assert quality.exposure_for(np.zeros((2, 2, 3))) == 1


def test_what_cannot_be_compared():
    with pytest.raises(PicaError, match=r"shapes \(2, 2, 3\) and \(2, 3, 3\)"):
        quality.compare(np.ones((2, 2, 3)), np.ones((2, 3, 3)))
    broken = np.ones((2, 2, 3))
    broken[0, 0, 1] = np.nan
    with pytest.raises(PicaError, match="1 values of the test picture are not finite"):
        quality.compare(np.ones((2, 2, 3)), broken)


def test_magma_is_flip_s_own():
    left, right = np.zeros((16, 256, 3), np.float32), np.zeros((16, 256, 3), np.float32)
    right += np.linspace(0, 1, 256, dtype=np.float32)[None, :, None]
    values, _, _ = flip_evaluator.evaluate(left, right, "LDR", applyMagma=False)
    colored, _, _ = flip_evaluator.evaluate(left, right, "LDR", applyMagma=True)
    assert np.abs(magma(values[..., 0]) / 255.0 - colored).max() < 0.05


def test_captions_may_be_called_anything():
    assert quality.sheet({"sun\n\x1b\udcff" + "x" * 10_000: np.zeros((40, 60))}).shape[0] > 40


def test_sheet_shows_every_picture_below_its_caption():
    red, blue = np.zeros((40, 60, 3)), np.zeros((30, 50, 3))
    red[..., 0] = blue[..., 2] = 1
    page = quality.sheet({"red": red, "a caption that is much wider than its picture": blue, "map": np.zeros((40, 60))})
    assert page.dtype == np.uint8
    assert (page == (255, 0, 0)).all(-1).sum() == red.shape[0] * red.shape[1]
    assert (page == (0, 0, 255)).all(-1).sum() == blue.shape[0] * blue.shape[1]
    top = np.argwhere((page == (255, 0, 0)).all(-1))[:, 0].min()
    caption = page[:top, :60]
    assert (caption.min(-1) > 150).any()
