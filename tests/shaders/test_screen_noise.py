"""screen_noise.slang."""

import numpy as np
import pytest
from scipy.stats import qmc

SOURCE = """
import shaders.screen_noise;
uint place(uint2 pixel) { return hilbertIndex(pixel); }
uint2 pixelAt(uint index, uint digits) { return hilbertPixel(index, digits); }
float3 random(uint2 pixel, uint sample, uint seed) { return screenNoise(pixel, sample, seed); }
"""


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def test_the_curve_goes_from_neighbour_to_neighbour_through_every_pixel(shader):
    pixels = np.stack(np.meshgrid(np.arange(256), np.arange(256)), -1).reshape(-1, 2).astype(np.uint32)
    places = shader.place(pixels, _result="numpy").astype(int)
    assert sorted(places) == list(range(65536))
    path = pixels[np.argsort(places)].astype(int)
    assert (np.abs(np.diff(path, axis=0)).sum(1) == 1).all()
    np.testing.assert_array_equal(shader.place(pixels + np.uint32(256), _result="numpy"), places)


def test_a_place_on_the_curve_leads_back_to_its_pixel(shader):
    places = np.arange(65536, dtype=np.uint32)
    pixels = shader.pixelAt(places, np.full(65536, 8, np.uint32), _result="numpy")
    np.testing.assert_array_equal(shader.place(pixels, _result="numpy"), places)
    small = shader.pixelAt(places[:16], np.full(16, 2, np.uint32), _result="numpy").astype(int)
    assert small.max() == 3 and (np.abs(np.diff(small, axis=0)).sum(1) == 1).all()


@pytest.mark.parametrize(("block", "samples"), [(1, 16), (1, 64), (4, 1), (4, 4), (8, 2), (8, 4)])
def test_numbers_are_even_over_frames_and_over_neighbours(shader, block, samples):
    """The first two together, the third by itself."""
    y, x, sample = (
        grid.ravel() for grid in np.meshgrid(np.arange(block) + 8, np.arange(block) + 24, np.arange(samples))
    )
    pixels = np.stack([x, y], -1).astype(np.uint32)
    points = shader.random(pixels, sample.astype(np.uint32), np.full(len(x), 5, np.uint32), _result="numpy")
    assert points.min() >= 0 and points.max() < 1
    independent = [np.random.default_rng(i).random(points.shape) for i in range(20)]
    for numbers in (slice(0, 2), slice(2, 3)):
        found, usual = (
            [qmc.discrepancy(np.float64(p[:, numbers]), method="WD") for p in sets] for sets in ([points], independent)
        )
        assert found[0] < 0.5 * np.mean(usual)


def test_r2_is_far_evener_than_chance(shader):
    """By a measure that no shift of all points, which is what seeds do, changes; random points have 18e-4 and 72e-4."""
    x, y, frame = (a.ravel().astype(np.uint32) for a in np.meshgrid(np.arange(8), np.arange(8), np.arange(4)))
    seeds = np.full(len(x), 3, np.uint32)
    block = shader.random(np.stack([x + 24, y + 8], -1).astype(np.uint32), frame, seeds, _result="numpy")
    assert qmc.discrepancy(np.float64(block[:, :2]), method="WD") < 2.4e-4
    own = shader.random(np.zeros((64, 2), np.uint32), np.arange(64, dtype=np.uint32), seeds[:64], _result="numpy")
    assert qmc.discrepancy(np.float64(own[:, :2]), method="WD") < 17e-4


def test_seeds_give_other_numbers(shader):
    pixels = np.zeros((2, 2), np.uint32)
    one, other = shader.random(pixels, np.zeros(2, np.uint32), np.uint32([1, 2]), _result="numpy")
    assert np.abs(one - other).min() > 1e-3
