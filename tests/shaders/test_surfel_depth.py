"""surfel_depth.slang: which places a surfel sees, by how far its rays went."""

import numpy as np
import pytest

SOURCE = """
import effects.global_illumination.surfels.surfel_depth;

// What is seen `length` metres away after `rays` rays of 1 metre, every second of which went `farther` metres on.
float seenAfter(uint rays, float farther, float length)
{
    uint depth = UNKNOWN;
    for (uint i = 0; i < rays; ++i)
        depth = withRay(depth, 1 + (i & 1) * farther);
    return seenAt(depth, length, .01);
}

uint texel(float3 direction) { return depthTowards(direction, float3(0, 1, 0)); }
"""


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def test_what_lies_behind_a_wall_is_not_seen(shader):
    lengths = np.array([0.2, 0.99, 1.1, 2.0], np.float32)
    assert shader.seenAfter(20, 0.0, lengths, _result="numpy").tolist() == [1, 1, 0, 0]
    # What some rays passed is seen in part; nothing beyond where they ended.
    beside = shader.seenAfter(40, 1.0, np.array([1.2, 1.9, 4.0], np.float32), _result="numpy")
    assert beside[0] > 0.9 and 0 < beside[1] < 0.9 and beside[2] == 0


def test_nothing_hides_what_no_ray_has_looked_for(shader):
    assert shader.seenAfter(0, 0.0, 5.0) == 1


def test_directions_share_the_hemisphere(shader):
    generator = np.random.default_rng(5)
    directions = generator.normal(size=(4000, 3)).astype(np.float32)
    directions[:, 1] = np.abs(directions[:, 1])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    texels = shader.texel(directions, _result="numpy")
    counts = np.bincount(texels, minlength=16)
    assert len(counts) == 16 and counts.min() > 0.5 * counts.mean()
    # Below the surfel is its horizon; across it, there are twelve.
    level = directions * np.float32([1, 0, 1])
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    horizon = shader.texel(level, _result="numpy")
    below = shader.texel(np.float32([1, 0, 1]) * level - np.float32([0, 1e-3, 0]), _result="numpy")
    assert len(np.unique(horizon)) == 12 and (horizon == below).mean() > 0.99
