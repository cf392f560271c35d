"""ambient_visibility.slang and screen_noise.slang."""

import numpy as np
import pytest
from scipy.stats import qmc

SOURCE = """
import shaders.ambient_visibility;
import shaders.screen_noise;
float3 bounced(float open, float3 albedo) { return multiBounceVisibility(open, albedo); }
float lobe(float open, float angle, float roughness)
{
    return specularVisibility(open, float3(0, 0, 1), float3(sin(angle), 0, cos(angle)), roughness);
}
uint place(uint2 pixel) { return hilbertIndex(pixel); }
float2 random(uint2 pixel, uint sample, uint seed) { return screenNoise(pixel, sample, seed); }
"""


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def lobes(shader, open_share, angle, roughness):
    arrays = np.broadcast_arrays(np.float32(open_share), np.float32(angle), np.float32(roughness))
    return shader.lobe(*(np.ascontiguousarray(array) for array in arrays), _result="numpy")


def test_bounces_brighten_bright_places_and_take_their_colour(shader):
    share = np.linspace(0, 1, 21, dtype=np.float32)
    albedo = np.tile(np.float32((0.9, 0.5, 0.0)), (21, 1))
    bounced = shader.bounced(share, albedo, _result="numpy")
    np.testing.assert_allclose(bounced[[0, -1]], [[0, 0, 0], [1, 1, 1]], atol=2e-3)
    assert (np.diff(bounced, axis=0) > 0).all()
    assert (bounced >= share[:, None]).all()
    middle = bounced[10]
    # A surrounding of albedo r that covers half sends back 0.5 + 0.5 r 0.5 + ... = 0.5 / (1 - 0.5 r) at most.
    assert middle[0] > middle[1] > middle[2] == 0.5
    assert middle[0] < 0.5 / (1 - 0.5 * 0.9) + 0.01


def test_a_lobe_is_whole_where_all_is_open_and_gone_where_all_is_closed(shader):
    angle, roughness = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1.5, 12), np.linspace(0.05, 1, 9)))
    np.testing.assert_allclose(lobes(shader, 1.0, angle, roughness), 1, atol=1e-5)
    assert lobes(shader, 0.0, angle, roughness).max() < 1e-3


def test_a_sharp_lobe_is_hidden_outside_of_the_open_cone(shader):
    """Open within 45 degrees of the normal: an open share of 1 - sin(45)^2."""
    found = lobes(shader, 0.5, np.radians([0, 30, 60, 80]), 0.1)
    np.testing.assert_allclose(found, [1, 1, 0, 0], atol=1e-3)
    shares = lobes(shader, np.linspace(0, 1, 30), 0.6, 0.5)
    assert (np.diff(shares) >= 0).all() and 0.2 < shares.mean() < 0.9


def test_the_curve_goes_from_neighbour_to_neighbour_through_every_pixel(shader):
    pixels = np.stack(np.meshgrid(np.arange(64), np.arange(64)), -1).reshape(-1, 2).astype(np.uint32)
    places = shader.place(pixels, _result="numpy").astype(int)
    assert sorted(places) == list(range(4096))
    path = pixels[np.argsort(places)].astype(int)
    assert (np.abs(np.diff(path, axis=0)).sum(1) == 1).all()
    np.testing.assert_array_equal(shader.place(pixels + np.uint32(64), _result="numpy"), places)


@pytest.mark.parametrize(("block", "samples"), [(1, 16), (4, 1), (4, 4), (8, 2)])
def test_numbers_are_even_over_frames_and_over_neighbours(shader, block, samples):
    y, x, sample = (
        grid.ravel() for grid in np.meshgrid(np.arange(block) + 8, np.arange(block) + 24, np.arange(samples))
    )
    pixels = np.stack([x, y], -1).astype(np.uint32)
    points = shader.random(pixels, sample.astype(np.uint32), np.full(len(x), 5, np.uint32), _result="numpy")
    assert points.min() >= 0 and points.max() < 1
    independent = [qmc.discrepancy(np.random.default_rng(i).random(points.shape), method="WD") for i in range(20)]
    assert qmc.discrepancy(points.astype(float), method="WD") < 0.5 * np.mean(independent)


def test_seeds_give_other_numbers(shader):
    pixels = np.zeros((2, 2), np.uint32)
    one, other = shader.random(pixels, np.zeros(2, np.uint32), np.uint32([1, 2]), _result="numpy")
    assert np.abs(one - other).min() > 1e-3
