"""ambient_visibility.slang."""

import numpy as np
import pytest

SOURCE = """
import shaders.ambient_visibility;
float3 bounced(float open, float3 albedo) { return multiBounceVisibility(open, albedo); }
float lobe(float open, float angle, float roughness)
{
    return specularVisibility(open, float3(0, 0, 1), float3(sin(angle), 0, cos(angle)), roughness);
}
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
