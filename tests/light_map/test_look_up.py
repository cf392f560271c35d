"""What shaders read of a light map that is known everywhere."""

import numpy as np
import pytest

from pica.baking.seams import without_seams
from pica.light_map.bricks import CELLS, LEVELS, bricks_around
from pica.light_map.gpu_light_map import GpuLightMap
from pica.light_map.light_map import HARMONICS, SEEN_PER_BRICK, LightMap
from tests.tracing.kernels import kernel, read

LOOK_UP = """
import light_map.light_map;
StructuredBuffer<float4> places;
StructuredBuffer<float4> normals;
float lift;
RWStructuredBuffer<float4> found;
[shader("compute")] [numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    float3 normal = normals[thread.x].xyz;
    found[thread.x] = float4(indirectLightAt(places[thread.x].xyz, normal, lift * normal, 0), 0);
}
"""
COUNT = 256
LOW, HIGH = np.array([-1.0, 0.5, 2.0]), np.array([3.0, 2.0, 5.0])
SPACING = 0.125
BAND_0, BAND_1 = 0.5 / np.sqrt(np.pi), np.sqrt(0.75 / np.pi)


@pytest.fixture(scope="module")
def look_up(device):
    """Asks a light map at (COUNT, 3) places for surfaces that face (COUNT, 3): (COUNT, 3) nits."""
    compute = kernel(device, LOOK_UP)

    def ask(light_map, places, normals, lift=0.0):
        rows = (np.concatenate([rows, np.zeros((COUNT, 1))], 1).astype(np.float32) for rows in (places, normals))
        inputs = {name: device.structured(name, each) for name, each in zip(("places", "normals"), rows, strict=True)}
        found = device.structured("found", np.zeros((COUNT, 4), np.float32))
        with device.record() as recording:
            compute(recording, (COUNT, 1, 1), lightMap=GpuLightMap(device, light_map), lift=lift, found=found, **inputs)
        device.handle.wait_for_idle()
        return read(found, np.float32).reshape(COUNT, 4)[:, :3]

    return ask


@pytest.fixture(scope="module")
def bricks():
    """Of all three levels."""
    occupied = np.zeros((9, 4, 7), bool)
    occupied[1:3, 0:2, 0:5] = True
    found = bricks_around(LOW, HIGH, SPACING, occupied, occupied)
    assert set(found.places[:, 3]) == {0, 1, 2}
    return found


def known(bricks, harmonics, in_the_open=None, seen=None):
    """A map of this light: (probes, 9, 3) numbers that 16 bits hold."""
    if in_the_open is None:
        in_the_open = np.ones(len(bricks.probes), bool)
    if seen is None:
        seen = np.full((len(bricks.places), SEEN_PER_BRICK), 255, np.uint8)
    return LightMap(bricks, 2.0, harmonics.astype(np.float16), in_the_open, seen, "", "")


def somewhere(seed=1):
    """Places in the box and directions."""
    random = np.random.default_rng(seed)
    normals = random.normal(size=(COUNT, 3))
    return random.uniform(LOW, HIGH, (COUNT, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_every_place_is_in_its_finest_brick(bricks):
    """And probes are there once, at the corners of all that they belong to."""
    assert len(np.unique(bricks.probes, axis=0)) == len(bricks.probes)
    steps, side = np.indices((CELLS + 1,) * 3).reshape(3, -1)[::-1].T, CELLS ** bricks.places[:, 3]
    corners = CELLS * bricks.places[:, None, :3] + side[:, None, None] * steps
    np.testing.assert_array_equal(bricks.probes[bricks.probe_of], corners)
    levels = bricks.finest_at & 3
    assert (levels[0:5, 0:2, 1:3] == 0).all() and (levels == 0).sum() == 20
    assert (levels[0:4, :, 0:4] <= 1).all() and levels[6, 3, 8] == 2
    z, y, x = np.indices(levels.shape)
    places = bricks.places[bricks.finest_at >> 2]
    for axis, at in enumerate((x, y, z)):
        assert ((places[..., axis] <= at) & (at < places[..., axis] + CELLS**levels)).all()


def test_a_constant_field_is_found_everywhere(bricks, look_up):
    """Also beyond the box, and off the surface that asks."""
    harmonics = np.zeros((len(bricks.probes), HARMONICS, 3))
    harmonics[:, 0], harmonics[:, 3] = (1, 2, 4), (0.5, 0, -0.5)
    places, normals = somewhere()
    places[:32] += 10
    expected = 2 * (BAND_0 * np.array([1, 2, 4]) + BAND_1 * np.outer(normals[:, 0], [0.5, 0, -0.5]))
    for lift in (0.0, 1.0):
        np.testing.assert_allclose(look_up(known(bricks, harmonics), places, normals, lift), expected, rtol=1e-5)


def test_a_linear_field_is_found_everywhere(bricks, look_up):
    """Within bricks of all levels."""
    harmonics = np.zeros((len(bricks.probes), HARMONICS, 3))
    harmonics[:, 0] = bricks.probes * (1, 2, 3) + 5  # whole numbers that 16 bits hold
    assert harmonics.max() < 2048
    places, normals = somewhere(2)
    expected = 2 * BAND_0 * ((places - bricks.origin) / SPACING * (1, 2, 3) + 5)
    np.testing.assert_allclose(look_up(known(bricks, harmonics), places, normals), expected, rtol=1e-4)


def test_light_that_a_place_does_not_see_is_left_out(bricks, look_up):
    """What is beyond a wall, and what is inside of something; where there is nothing else, that is taken after all."""
    harmonics = np.zeros((len(bricks.probes), HARMONICS, 3))
    beyond = bricks.probes[:, 2] >= 12
    harmonics[:, 0] = np.where(beyond, 1000.0, 1.0)[:, None]
    places, normals = somewhere(3)
    places = np.random.default_rng(4).uniform(
        bricks.origin + SPACING * 11.01, bricks.origin + SPACING * 11.99, places.shape
    )
    expected = 2 * BAND_0 * np.ones((COUNT, 3))
    plain = look_up(known(bricks, harmonics), places, normals)
    assert plain.mean() > 100 * expected.mean()
    this_side = np.full((len(bricks.places), SEEN_PER_BRICK), 0b00001111, np.uint8)
    np.testing.assert_allclose(look_up(known(bricks, harmonics, seen=this_side), places, normals), expected, rtol=1e-3)
    np.testing.assert_allclose(look_up(known(bricks, harmonics, ~beyond), places, normals), expected, rtol=1e-3)
    nothing_seen = np.zeros_like(this_side)
    np.testing.assert_allclose(look_up(known(bricks, harmonics, seen=nothing_seen), places, normals), plain, rtol=1e-3)


def across_levels(bricks):
    """(COUNT, 3) places a hair to either side of faces between levels, within the box."""
    random, levels = np.random.default_rng(5), (bricks.finest_at & 3).transpose(2, 1, 0)
    faces = []
    for axis in range(3):
        low = np.argwhere(np.diff(levels.astype(int), axis=axis) != 0)
        corner = low + np.eye(3, dtype=int)[axis]
        faces.append(np.concatenate([corner, np.full((len(low), 1), axis)], 1))
    faces = np.concatenate(faces)
    chosen = faces[random.integers(0, len(faces), COUNT)]
    along = np.eye(3)[chosen[:, 3]]
    places = (chosen[:, :3] + random.random((COUNT, 3)) * (1 - along)) * CELLS
    return tuple(bricks.origin + SPACING * (places + side * along * 1e-4) for side in (-1, 1))


def test_light_has_no_step_where_probes_become_coarser(bricks, look_up):
    """Of a field that bends, which coarse probes cannot follow; also where finer probes are inside of something."""
    harmonics = np.zeros((len(bricks.probes), HARMONICS, 3), np.float32)
    place = bricks.probes / bricks.probes.max(0)
    harmonics[:, 0] = ((place - 0.4) ** 2 * (100, 200, 300)).sum(-1, keepdims=True) * np.float32([1, 2, 0.5])
    coarser = np.unique(bricks.probe_of[bricks.places[:, 3] > 0])
    in_the_open = np.random.default_rng(6).random(len(bricks.probes)) < 0.9
    in_the_open[coarser] = True
    seen = np.full((len(bricks.places), SEEN_PER_BRICK), 255, np.uint8)
    before, after = across_levels(bricks)
    normals = somewhere()[1]

    def step(light, in_the_open):
        light_map = known(bricks, light, in_the_open)
        sides = (look_up(light_map, places, normals) for places in (before, after))
        return np.abs(np.subtract(*sides)).max() / light.max()

    assert step(harmonics, in_the_open) > 0.01
    assert step(*without_seams(bricks, harmonics, in_the_open, seen)) < 0.001


def test_seams_leave_linear_light_as_it_is(bricks):
    """And all light of probes that belong to the coarser side too."""
    light = np.zeros((len(bricks.probes), HARMONICS, 3), np.float32)
    light[:, 0] = bricks.probes * (1, 2, 3) + 5
    light[:, 4] = bricks.probes * (-1, 0, 2)
    everywhere = np.ones(len(bricks.probes), bool)
    seen = np.full((len(bricks.places), SEEN_PER_BRICK), 255, np.uint8)
    np.testing.assert_allclose(without_seams(bricks, light, everywhere, seen)[0], light, rtol=1e-6)
    bent = np.random.default_rng(7).random(light.shape).astype(np.float32)
    closed, _ = without_seams(bricks, bent, everywhere, seen)
    coarsest = np.unique(bricks.probe_of[bricks.places[:, 3] == LEVELS - 1])
    np.testing.assert_array_equal(closed[coarsest], bent[coarsest])
    assert 0.01 < (closed != bent).any((1, 2)).mean() < 0.9


def test_seams_keep_what_is_behind_a_wall_out(bricks):
    """A probe that the coarser side's corners do not see keeps its own light."""
    bent = np.random.default_rng(8).random((len(bricks.probes), HARMONICS, 3)).astype(np.float32)
    everywhere = np.ones(len(bricks.probes), bool)
    nothing = np.zeros((len(bricks.places), SEEN_PER_BRICK), np.uint8)
    np.testing.assert_array_equal(without_seams(bricks, bent, everywhere, nothing)[0], bent)
