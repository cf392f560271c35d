"""noise.slang: the Halton sequence, its order over pixels, and the streams made of it."""

import numpy as np
import pytest
from scipy.stats import kstest, qmc

SOURCE = """
import shaders.noise;
float halton(uint dimension, uint index) { return haltonSample(dimension, index); }
uint indexOf(uint2 pixel, uint frame) { return haltonIndex(pixel, frame); }
float random(uint2 pixel, uint frame, uint seed, uint dimension)
{
    return Noise.create(pixel, frame, seed).at(dimension);
}
float step(uint2 pixel, uint frame, uint seed, uint count)
{
    Noise noise = Noise.create(pixel, frame, seed);
    float value = 0;
    for (uint i = 0; i < count; i++)
        value = noise.next();
    return value;
}
float3 mixed(uint2 pixel)
{
    Noise noise = Noise.create(pixel, 3, 7);
    noise.next2();
    return noise.next3();
}
uint hash1(uint v) { return pcg(v); }
uint2 hash2(uint2 v) { return pcg2d(v); }
uint3 hash3(uint3 v) { return pcg3d(v); }
uint4 hash4(uint4 v) { return pcg4d(v); }
"""
PIXELS = np.stack(np.meshgrid(np.arange(64), np.arange(64)), -1).reshape(-1, 2).astype(np.uint32)


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def test_halton_is_scipys(shader):
    count = 2000
    expected = qmc.Halton(d=32, scramble=False).random(count)
    dimension, index = (a.astype(np.uint32) for a in np.meshgrid(np.arange(32), np.arange(count)))
    got = shader.halton(dimension, index, _result="numpy")
    np.testing.assert_allclose(got, expected, atol=1e-6)


def test_halton_of_late_indices_stays_below_one(shader):
    index = np.uint32([2**32 - 1, 2**31 - 1, 3**20 - 1, 3_057_647_616])
    for dimension in range(32):
        values = shader.halton(dimension, index, _result="numpy")
        assert (values >= 0).all() and (values < 1).all()


@pytest.mark.parametrize("frame", [0, 1, 1000])
def test_first_two_dimensions_fall_into_the_pixel(shader, frame):
    pixels = np.uint32([[0, 0], [1, 0], [0, 1], [255, 255], [37, 201], [128, 3], [256 + 5, 512 + 9]])
    index = shader.indexOf(pixels, frame, _result="numpy").astype(np.int64)
    assert (index // 186624 == frame).all()
    x = np.array([mirrored(i, 2) for i in index]) * 256
    y = np.array([mirrored(i, 3) for i in index]) * 729
    np.testing.assert_array_equal(np.floor(np.stack([x, y], 1)), pixels % 256)


def mirrored(index, base):
    value, scale = 0.0, 1.0 / base
    while index:
        value += index % base * scale
        index //= base
        scale /= base
    return value


def test_stream_is_the_same_as_random_access(shader):
    for count in (1, 2, 17, 30, 31, 40):
        stream = shader.step(PIXELS, 5, 9, count, _result="numpy")
        np.testing.assert_array_equal(stream, shader.random(PIXELS, 5, 9, count + 1, _result="numpy"))
    mixed = shader.mixed(PIXELS, _result="numpy")
    for column in range(3):
        np.testing.assert_array_equal(mixed[:, column], shader.random(PIXELS, 3, 7, 4 + column, _result="numpy"))


@pytest.mark.parametrize("dimension", [2, 3, 10, 31, 32, 100])
def test_numbers_are_uniform_over_pixels(shader, dimension):
    values = shader.random(PIXELS, 0, 1, dimension, _result="numpy")
    assert values.min() >= 0 and values.max() < 1
    assert kstest(values, "uniform").pvalue > 1e-3
    neighbours = values.reshape(64, 64)
    assert abs(np.corrcoef(neighbours[:, 1:].ravel(), neighbours[:, :-1].ravel())[0, 1]) < 0.06


def test_seeds_dimensions_and_pixels_differ(shader):
    columns = [shader.random(PIXELS, 0, seed, d, _result="numpy") for seed in (0, 1) for d in (2, 3, 4, 40, 41)]
    correlation = np.corrcoef(columns) - np.eye(len(columns))
    assert np.abs(correlation).max() < 0.08


@pytest.mark.parametrize("dimension", [2, 4, 6, 10])
def test_frames_of_a_pixel_are_of_low_discrepancy(shader, dimension):
    frames = np.arange(256, dtype=np.uint32)
    random = qmc.discrepancy(np.random.default_rng(0).random((256, 2)))
    for pixel in ([3, 4], [100, 200], [700, 33]):
        pixel = np.uint32(pixel)
        points = np.stack([shader.random(pixel, frames, 0, dimension + i, _result="numpy") for i in range(2)], 1)
        assert qmc.discrepancy(points) < random / 4


def test_a_new_cycle_of_frames_brings_new_numbers(shader):
    first, later = (shader.random(PIXELS, frame, 0, 2, _result="numpy") for frame in (0, 16384))
    assert (first != later).all()


def published(v, products):
    """Jarzynski and Olano's hashes of three and four words: "xyz" stands for x += y * z."""
    words = dict(zip("xyzw", v.T * np.uint32(1664525) + np.uint32(1013904223), strict=False))
    for mix in (False, True):
        if mix:
            words = {name: word ^ (word >> 16) for name, word in words.items()}
        for target, a, b in products.split():
            words[target] = words[target] + words[a] * words[b]
    return np.stack(list(words.values()), 1)


def test_every_dimension_has_a_rotation_of_its_own(shader):
    index = shader.indexOf(PIXELS, 0, _result="numpy")
    rotations = [
        (shader.random(PIXELS, 0, 0, d, _result="numpy") - shader.halton(d, index, _result="numpy")) % 1
        for d in (2, 3, 4, 5, 31)
    ]
    assert np.abs(np.corrcoef(rotations) - np.eye(5)).max() < 0.06


def test_hashes_are_the_published_ones(shader):
    mask = 2**32 - 1
    state = (12345 * 747796405 + 2891336453) & mask
    word = (((state >> ((state >> 28) + 4)) ^ state) * 277803737) & mask
    assert shader.hash1(12345) == (word >> 22) ^ word
    v = np.random.default_rng(0).integers(0, 2**32, (100, 4), np.uint32)
    np.testing.assert_array_equal(shader.hash3(v[:, :3].copy(), _result="numpy"), published(v[:, :3], "xyz yzx zxy"))
    np.testing.assert_array_equal(shader.hash4(v, _result="numpy"), published(v, "xyw yzx zxy wyz"))
    for size, function in ((2, shader.hash2), (3, shader.hash3), (4, shader.hash4)):
        v = np.random.default_rng(size).integers(0, 2**32, (20_000, size), np.uint32)
        hashed = function(v, _result="numpy")
        bits = (hashed[..., None] >> np.arange(32, dtype=np.uint32)) & 1
        np.testing.assert_allclose(bits.mean(0), 0.5, atol=0.02)
        flipped = v.copy()
        flipped[:, 0] ^= 1 << 20
        changed = ((function(flipped, _result="numpy") ^ hashed)[..., None] >> np.arange(32, dtype=np.uint32)) & 1
        assert changed.mean() > 0.3
