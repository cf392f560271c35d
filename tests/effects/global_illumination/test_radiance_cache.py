"""The world-space radiance cache: light of all bounces, and what it must not show."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.effects.global_illumination.radiance_cache import radiance_cache
from pica.scene.light import RectangleLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, settings, shining, uniform

SIZE, LARGER = (64, 36), (96, 54)
ON = {"global_illumination.mode": "path_traced", "global_illumination.bounces": "2"}
WITH_REFLECTIONS = {**ON, "reflections.mode": "ray_traced"}
CORNER = pica.Camera.look_at((-3.5, 1.2, 1.5), (-0.5, 1.2, -1), vertical_fov=np.radians(75))
DOWN = move(0, 2.45, 0) @ rotate("x", -90)
"""Of a lamp below a ceiling."""


def slabs(albedo, *more):
    """Walls of a closed room of 8 x 2.5 x 4 metres, and `more`, by size and centre."""
    walls = (
        ((8.2, 0.2, 4.2), (0, -0.1, 0)),
        ((8.2, 0.2, 4.2), (0, 2.6, 0)),
        ((8.2, 2.5, 0.2), (0, 1.25, -2.1)),
        ((8.2, 2.5, 0.2), (0, 1.25, 2.1)),
        ((0.2, 2.5, 4), (-4.1, 1.25, 0)),
        ((0.2, 2.5, 4), (4.1, 1.25, 0)),
        *more,
    )
    return [placed(box(size, lambert(albedo)), move(*center)) for size, center in walls]


def lamp(along=-2.0, radiance=20.0):
    return shining(RectangleLight(radiance=radiance, width=0.8, height=0.8), move(along, 0, 0) @ DOWN)


def white_room():
    return scene_of(*slabs(0.8), lamp())


def renderer_of(device, scene, values=ON, size=SIZE):
    return pica.Renderer(scene, size=size, settings=settings(values), device=device)


def indirect(renderer, camera, frames=1):
    return renderer.render(frames, camera=camera).aov("diffuse_indirect")


def turned(degrees):
    away = np.radians(degrees)
    return pica.Camera.look_at((-3, 1.2, 0), (-3 + np.cos(away), 1.1, np.sin(away)), vertical_fov=np.radians(75))


@pytest.mark.parametrize("degrees", [0, 1], ids=["still", "turning"])
def test_light_has_all_bounces(device, degrees):
    """With two bounces alone a white room has two thirds of its light."""
    scene = white_room()
    renderer = renderer_of(device, scene, size=LARGER)
    for frame in range(48):
        found = renderer.render(1, camera=turned(degrees * (frame - 47)), aovs=["combined"])
    tracer = pica.PathTracer(scene, size=LARGER, settings=settings(), device=device)
    expected = tracer.render(96, camera=turned(0)).color.mean()
    assert found.aov("combined").mean() == pytest.approx(expected, rel=0.03)


def test_what_the_first_rays_found_in_an_empty_cache_is_soon_forgotten(device):
    renderer = renderer_of(device, white_room())
    early, late = (indirect(renderer, CORNER, frames).mean() for frames in (16, 48))
    assert early == pytest.approx(late, rel=0.05)


def test_a_wall_thinner_than_a_cell_keeps_the_light_out(device):
    """Rays of the dark room end in entries that hold none of the lit room's light."""
    scene = scene_of(*slabs(0.7, ((0.02, 2.5, 4), (0.13, 1.25, 0))), lamp())
    beside_the_wall = np.s_[12:24, 26:38]

    def floor(renderer, eye, along, frames):
        camera = pica.Camera.look_at((eye, 1.6, 0), (along, 0, 0.01), vertical_fov=np.radians(20))
        return renderer.render(frames, camera=camera).color[beside_the_wall].mean()

    lit = floor(renderer_of(device, scene), -1.6, -0.37, 24)
    assert lit > 0.2
    assert floor(renderer_of(device, scene), 1.8, 0.63, 24) < 0.01 * lit


def test_no_light_leaks_into_a_closed_box_that_moves(device):
    """Points at which the cache takes samples move with the box: left where they were, they would be outside."""
    thick, step = 0.02, 0.06
    walls = [
        (tuple(np.where(np.arange(3) == axis, thick, 1)), tuple(np.where(np.arange(3) == axis, side, 0)))
        for axis in range(3)
        for side in (-0.5, 0.5)
    ]
    closed = [placed(box(size, lambert(0.8))) for size, _ in walls]
    scene = scene_of(*closed, environment=uniform(1, 1, 1))
    renderer = renderer_of(device, scene)
    for frame in range(16):
        away = frame * step
        for node, (_, center) in zip(closed, walls, strict=True):
            node.transform = move(away + center[0], center[1], center[2])
        camera = pica.Camera.look_at((away + 0.4, 0.1, 0.1), (away - 0.4, -0.1, 0), vertical_fov=np.radians(75))
        light = indirect(renderer, camera).mean()
    assert light < 1e-3


def test_a_lamp_that_goes_out_takes_its_light_along(device):
    """Of two lamps: 80 % of the change in 10 frames, and no more than a tenth too much."""
    two = scene_of(*slabs(0.7), lamp(-2), lamp(2))
    off = next(node for node in two.nodes() if node.light)
    renderer = renderer_of(device, two)
    before = indirect(renderer, CORNER, 48).mean()
    two.remove(off)
    after = np.array([indirect(renderer, CORNER).mean() for _ in range(48)])
    end = indirect(renderer_of(device, two), CORNER, 96).mean()
    share = (before - after) / (before - end)
    assert share[9] > 0.8 and share.max() < 1.1 and share[-1] == pytest.approx(1, abs=0.05)


def test_entries_that_are_sampled_rarely_forget_a_lamp_too(device):
    """The lamp lights another room, whose cells few rays reach."""
    scene = pica.scenes.rooms()
    renderer = renderer_of(device, scene)
    camera = scene.default_camera(16 / 9)
    before = indirect(renderer, camera, 48).mean()
    scene.remove(next(node for node in scene.nodes() if node.light))
    assert indirect(renderer, camera, 24).mean() < 0.1 * before


def test_a_mirror_shows_no_cells(device):
    """Its rays hit surfaces that the picture does not show, lit by the cache: neighbours hardly differ."""
    mirror = Material(base_color=(0.95, 0.95, 0.95, 1), metallic=1.0, roughness=0.0)
    scene = scene_of(*slabs(0.7), lamp(2.0), placed(box((7.9, 0.02, 3.9), mirror), move(0, 0.01, 0)))
    renderer = renderer_of(device, scene, WITH_REFLECTIONS, LARGER)
    for frame in range(24):
        away = np.radians(3 * (frame - 23))
        camera = pica.Camera.look_at((-3, 1.2, 0), (-3 + np.cos(away), 0.4, np.sin(away)), vertical_fov=np.radians(60))
        light = renderer.render(1, camera=camera, aovs=["reflections"]).aov("reflections").mean(axis=-1)
    floor = light[36:]
    around = floor[2:, 1:-1] + floor[:-2, 1:-1] + floor[1:-1, 2:] + floor[1:-1, :-2]
    assert np.abs(4 * floor[1:-1, 1:-1] - around).mean() < 0.075 * floor.mean()


def test_mirrors_show_walls_beside_the_camera_as_free_of_noise_as_far_ones(device):
    """Cells there are small for the camera; over the mirror they are seen from afar, and had few samples each."""
    mirror = Material(base_color=(0.95, 0.95, 0.95, 1), metallic=1.0, roughness=0.0)
    small = shining(RectangleLight(radiance=400, width=0.2, height=0.2), move(0, 2.4, 1.5) @ rotate("y", -90))
    screen = ((1.5, 2.5, 0.1), (0.3, 1.25, -1)), ((0.1, 2.5, 1.8), (-0.2, 1.25, 1.1))
    scene = scene_of(*slabs(0.7, *screen), small, placed(box((0.02, 1.6, 3.8), mirror), move(3.9, 1.25, 0)))
    pictures = []
    for seed in range(3):
        renderer = renderer_of(device, scene, {**WITH_REFLECTIONS, "seed": seed}, LARGER)
        for frame in range(24):
            away = np.radians((frame - 23) / 2)
            at = -3.6 + 7.6 * np.cos(away), 1.2, 0.3 + 7.6 * np.sin(away)
            camera = pica.Camera.look_at((-3.6, 1.6, 0.3), at, vertical_fov=0.5)
            light = renderer.render(1, camera=camera, aovs=["reflections"]).aov("reflections").mean(axis=-1)
        pictures.append(light)
    mean = np.mean(pictures, 0)
    shown = mean > 0.3 * mean.max()
    assert (np.std(pictures, 0, ddof=1)[shown] / mean[shown]).mean() < 0.1


def test_same_frames_have_the_same_bits(device):
    """On all threads: sums do not depend on their order."""
    first, second = (renderer_of(device, white_room(), WITH_REFLECTIONS) for _ in range(2))
    for frame in range(12):
        camera = turned(3 * frame)
        pictures = [renderer.render(1, camera=camera).color for renderer in (first, second)]
        np.testing.assert_array_equal(*pictures)


def test_a_reset_discards_all_entries(device):
    scene = white_room()
    renderer = renderer_of(device, scene, WITH_REFLECTIONS)
    renderer.render(20, camera=CORNER)
    light = next(node for node in scene.nodes() if node.light)
    light.light = RectangleLight(radiance=40.0, width=0.8, height=0.8)
    renderer.render(3, camera=CORNER)
    renderer.reset()
    expected = renderer_of(device, scene, WITH_REFLECTIONS).render(8, camera=CORNER).color
    np.testing.assert_array_equal(renderer.render(8, camera=CORNER).color, expected)
    renderer.render(20, camera=CORNER)
    np.testing.assert_array_equal(renderer.render(8, camera=CORNER, cut=True).color, expected)


def test_after_a_detected_cut_entries_remain(device):
    """So the second frame of a camera that returns is nearer to all the light than a new renderer's."""
    scene = white_room()
    renderer = renderer_of(device, scene)
    indirect(renderer, turned(0), 32)
    indirect(renderer, turned(180))
    expected = indirect(renderer_of(device, scene), turned(0), 96)
    returned, new = indirect(renderer, turned(0), 2), indirect(renderer_of(device, scene), turned(0), 2)
    assert np.abs(returned - expected).mean() < 0.7 * np.abs(new - expected).mean()


def street():
    """Houses along 60 metres, below lamps."""
    random = np.random.default_rng(3)
    houses = [
        placed(box((3, height, 3), lambert(*random.uniform(0.3, 0.8, 3))), move(side * 4, height / 2, -4 * number))
        for number in range(15)
        for side, height in ((-1, random.uniform(2, 6)), (1, random.uniform(2, 6)))
    ]
    ground = placed(box((16, 0.2, 70), lambert(0.6)), move(0, -0.1, -28))
    lamps = [shining(RectangleLight(radiance=40.0, width=1, height=1), move(0, 5, -8 * n) @ DOWN) for n in range(8)]
    return scene_of(ground, *houses, *lamps)


def test_a_crowded_table_only_costs_data(device, monkeypatch):
    """A flight over cells of which the smallest table holds a few: rays that find none go on."""
    cameras = [
        pica.Camera.look_at((0.4, 1.7, 2 - 0.25 * n), (-0.3, 1.5, -4 - 0.25 * n), vertical_fov=np.radians(70))
        for n in range(200)
    ]

    def flight():
        renderer = renderer_of(device, street(), {**ON, "global_illumination.bounces": "8"})
        means, memory = [], []
        for number, camera in enumerate(cameras):
            renderer.advance(camera)
            if number % 20 == 19:
                means.append(renderer.render(1, camera=camera).color.mean())
                memory.append(renderer.graph.memory)
        assert all(bytes_by_effect == memory[0] for bytes_by_effect in memory)
        return np.array(means)

    expected = flight()
    monkeypatch.setattr(radiance_cache, "_SMALLEST", 256)
    monkeypatch.setattr(radiance_cache, "_LARGEST", 256)
    found = flight()
    assert np.isfinite(found).all() and (found != expected).any()
    assert found.mean() == pytest.approx(expected.mean(), rel=0.05)


def test_pictures_of_another_size_begin_with_an_empty_cache(device):
    scene = white_room()
    renderer = renderer_of(device, scene, WITH_REFLECTIONS, (48, 27))
    renderer.render(12, camera=CORNER)
    renderer.resize(SIZE)
    expected = renderer_of(device, scene, WITH_REFLECTIONS).render(8, camera=CORNER).color
    np.testing.assert_array_equal(renderer.render(8, camera=CORNER).color, expected)


def test_views_of_one_scene_have_caches_of_their_own(device):
    scene = white_room()
    cameras = CORNER, turned(20)
    alone = [renderer_of(device, scene).render(8, camera=camera).color for camera in cameras]
    renderers = [renderer_of(device, scene) for _ in cameras]
    for _ in range(8):
        together = [
            renderer.render(1, camera=camera).color for renderer, camera in zip(renderers, cameras, strict=True)
        ]
    for found, expected in zip(together, alone, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_cells_of_an_orthographic_camera_do_not_grow_with_its_distance(device):
    """Seen through a wall's back, from 40 metres away, a dark room beside a lit one stays dark."""
    front = placed(plane(8.2, 2.5, lambert(0.7)), move(0, 1.25, 2) @ rotate("x", -90))
    walls = slabs(0.7, ((0.02, 2.5, 4), (2, 1.25, 0)))
    scene = scene_of(*walls[:3], *walls[4:], front, lamp())
    camera = replace(pica.Camera.look_at((1, 1.25, 40), (1, 1.25, 0)), orthographic_height=2.6)
    picture = indirect(renderer_of(device, scene), camera, 24)
    lit, dark = picture[:, :34].mean(), picture[:, 54:].mean()
    assert lit > 0.1 and dark < 0.1 * lit


@pytest.mark.parametrize("lights", [0, 1])
def test_points_that_no_ray_has_written_are_none(device, lights):
    """In an empty scene no entry is made."""
    scene = scene_of(*([lamp()] if lights else []))
    renderer = renderer_of(device, scene)
    renderer.render(3, camera=CORNER)
    cache = renderer._stages.global_illumination._way.radiance_cache
    assert not any(buffer.to_numpy().any() for buffer in cache._occupancy)
