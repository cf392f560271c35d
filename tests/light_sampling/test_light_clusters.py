"""light_clusters.slang: the tables of tiles, and what they and solid angles spare a frame in noise."""

import numpy as np
import pytest

import pica
from pica.light_sampling.light_sampler import _CLUSTERS, _SLOTS, _TILE
from pica.scene.light import PointLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import held, lambert, orthographic, placed, render, scene_of, settings, shining, uniform
from tests.rays import FRONT, gpu_scene

SIZE = 64, 48
ACROSS, DOWN = SIZE[0] // _TILE, SIZE[1] // _TILE
ABOVE = orthographic((0, 4, 0), (0, 0, 0), 3.0)
"""Three metres of floor from edge to edge, +X to the right."""


def tables(device, scene):
    """(DOWN, ACROSS, _SLOTS) cluster, part and count of each slot, and the density of the clusters' entries."""
    with pica.Renderer(scene, size=SIZE, settings=settings(), device=device) as renderer:
        renderer.render(1, camera=ABOVE)
        bits = held(renderer, "light_sampling", "light tiles").to_numpy().view(np.uint32)
    bits = bits.reshape(DOWN, ACROSS, _SLOTS + 1 + _CLUSTERS)[..., :_SLOTS]
    return bits & 127, bits >> 7 & 511, bits >> 16 & 511


def row_of_lights():
    """Sixty lights over the floor from left to right, near it."""
    return [shining(PointLight(intensity=1.0), move(x, 0.2, 0)) for x in np.linspace(-1.9, 1.9, 60)]


def floor():
    return placed(plane(9, 9, lambert(0.8)))


@pytest.mark.parametrize("lights", [row_of_lights, list], ids=["lights", "sky"])
def test_a_table_has_each_cluster_and_equal_parts_of_it(device, lights):
    scene = scene_of(placed(plane(3, 1, lambert(0.8))), *lights(), environment=uniform(1, 1, 1))
    clusters, parts, counts = tables(device, scene)
    assert (np.diff(clusters.astype(int), axis=2) >= 0).all()
    for tile in np.ndindex(DOWN, ACROSS):
        own = np.bincount(clusters[tile], minlength=_CLUSTERS)
        assert own.min() > 0 and own.sum() == _SLOTS
        np.testing.assert_array_equal(counts[tile], own[clusters[tile]])
        first = np.searchsorted(clusters[tile], clusters[tile])
        np.testing.assert_array_equal(parts[tile], np.arange(_SLOTS) - first)


def test_tiles_prefer_the_lights_beside_them(device):
    clusters, _, _ = tables(device, scene_of(floor(), *row_of_lights()))
    # Lights follow the row in the table, but for the strongest few, which are in another order.
    middle = np.array(
        [np.bincount(clusters[DOWN // 2, column], minlength=_CLUSTERS).argmax() for column in range(ACROSS)]
    )
    assert len(set(middle.tolist())) == ACROSS
    chosen = np.bincount(clusters[DOWN // 2, 0], minlength=_CLUSTERS)
    assert chosen.max() > 4 * np.median(chosen)


def noise(device, scene, camera=ABOVE, **values):
    """Of a frame without filters, over the mean of many; where a lamp does not cover the floor."""
    values = {"debug.filters": "false", **values}
    mean = render(device, scene, 256, camera, SIZE, values).color
    single = render(device, scene, 1, camera, SIZE, values).color
    dark = (mean < 4.9).all(-1)
    return np.abs(single - mean)[dark].mean() / mean[dark].mean()


def test_many_lights_are_sampled_where_they_are(device):
    """Most of the floor has four lights of 400 near it."""
    lights = [
        shining(PointLight(intensity=1.0), move(x, 0.15, z))
        for x in np.linspace(-6, 6, 20) for z in np.linspace(-6, 6, 20)
    ]  # fmt: skip
    assert noise(device, scene_of(floor(), *lights), **{"lighting.candidates": "8"}) < 1.1


def test_a_wall_behind_a_lamp_of_two_triangles_has_little_noise(device):
    """Points drawn by area bring the squared distance's peaks."""
    lamp = placed(box((2.0, 0.05, 0.05), Material(base_color=(0, 0, 0, 1), emission=(5, 5, 5))), move(0, 0.1, 0))
    assert noise(device, scene_of(floor(), lamp)) < 0.6


def test_a_floor_beside_a_strip_of_light_has_little_noise_and_all_of_its_light(device):
    """Most clusters are of the strip's upper face, which does not light the floor, and each triangle is in several."""
    length, height, width = 16.0, 0.02, 0.14
    strip = box((length, height, width), Material(base_color=(0, 0, 0, 1), emission=(5, 5, 5)))
    scene = scene_of(floor(), placed(strip, move(0, height / 2, 0)))
    near = orthographic((0, 4, 0), (0, 0, 0), 0.6)
    seen = render(device, scene, 128, near, SIZE, {"debug.filters": "false"})
    away = np.abs(seen.aov("position")[..., 2]) - width / 2
    beside = away > 0.02
    expected = 0.8 * 2.5 * (1 - away / np.hypot(away, height))[beside]
    assert seen.color[..., 1][beside].mean() == pytest.approx(expected.mean(), rel=0.02)
    assert noise(device, scene, near) < 0.6


def test_a_triangle_does_not_light_itself(device):
    """Rounding may put a point of it before its plane, from where it would fill half of all directions."""
    lamp = placed(plane(2, 2, Material(base_color=(1, 1, 1, 1), metallic=0.0, emission=(1, 1, 1))), rotate("z", 20))
    color = render(device, scene_of(lamp), 1, orthographic((0, 4, 0), (0, 0, 0), 1.0), SIZE).color
    np.testing.assert_allclose(color, 1, rtol=1e-3)


def test_lights_beyond_the_strongest_follow_a_curve_through_space(device):
    """Neighbours in the table are near one another, in whatever order the scene has them."""
    places = np.random.default_rng(5).permutation(np.stack(np.mgrid[0:8, 0:8], -1).reshape(-1, 2))
    lights = [shining(PointLight(intensity=1.0), move(x, 0, z)) for x, z in places]
    strong = [shining(PointLight(intensity=9.0 - number), move(number, 5, 0)) for number in range(4)]
    table = gpu_scene(device, scene_of(floor(), *lights, *strong)).lights._table
    assert (table["position"][:4, 1] == 5).all()
    steps = np.linalg.norm(np.diff(table["position"][32:64], axis=0), axis=1)
    assert np.median(steps) <= 2 < np.median(np.linalg.norm(np.diff(places, axis=0), axis=1))


def test_the_selection_of_lights_follows_their_power(device):
    """One that begins dark and is set to shine is selected as in a new scene."""
    lights = [shining(PointLight(intensity=1e-3), move(x, 1, 0)) for x in range(12)]
    scene = gpu_scene(device, scene_of(floor(), *lights))

    def shares() -> np.ndarray:
        with device.record() as recording:
            scene.update(recording, FRONT)
        cumulative = scene.lights.parameters["lightCumulative"].to_numpy().view(np.float32).reshape(-1)[:12]
        return np.diff(cumulative, prepend=0)

    np.testing.assert_allclose(shares(), 1 / 12, rtol=1e-4)
    lights[5].light = PointLight(intensity=10.0)
    found = shares()
    row = int(np.argmax(scene.lights._table["emission"][:12, 0]))
    assert found[row] == pytest.approx(0.5 + 0.5 / 12, rel=0.01)
    assert np.delete(found, row).max() < 0.5 / 11
