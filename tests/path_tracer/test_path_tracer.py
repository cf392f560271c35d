"""The reference path tracer: energy, depth, determinism, and pictures whose values are known."""

import math

import numpy as np
import pytest

import pica
from pica.errors import PicaError, SettingsError
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, PointLight, SphereLight
from pica.scene.material import AlphaMode, Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate, stretch
from tests.building import (
    CAMERA,
    lambert,
    leaves,
    orthographic,
    placed,
    render,
    scene_of,
    shining,
    still_life,
    trace,
    uniform,
)

SIZE = (48, 36)
ABOVE = orthographic((0, 4, 0), (0, 0, 0), 1.0)


@pytest.mark.parametrize("roughness", [0.15, 0.6, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_a_white_ball_vanishes_in_a_white_world(device, metallic, roughness):
    """The furnace: what neither absorbs nor emits shows the radiance around it."""
    white = Material(base_color=(1, 1, 1, 1), metallic=metallic, roughness=roughness)
    scene = scene_of(placed(sphere(0.8, white)), environment=uniform(2.0))
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(25))
    frame = trace(device, scene, 128, camera, SIZE)
    seen = frame.aov("instance") == 1
    assert seen.mean() > 0.5
    assert frame.color[seen].mean() == pytest.approx(2.0, rel=0.01)


def test_a_white_bowl_vanishes_in_a_white_world(device):
    """The same with light that goes to and fro: Lambert walls around a hollow, open towards the camera."""
    white = lambert(1.0, double_sided=True)
    walls = [
        placed(plane(1, 1, white), place)
        for place in (
            move(0, -0.5, 0),
            move(0, 0.5, 0) @ rotate("x", 180),
            move(-0.5, 0, 0) @ rotate("z", -90),
            move(0.5, 0, 0) @ rotate("z", 90),
            move(0, 0, -0.5) @ rotate("x", 90),
        )
    ]
    scene = scene_of(*walls, environment=uniform(1.0))
    frame = trace(device, scene, 256, Camera.look_at((0, 0, 1.5), (0, 0, 0), vertical_fov=math.radians(40)), SIZE)
    assert frame.color.mean() == pytest.approx(1.0, rel=0.01)
    half_depth = trace(
        device, scene, 16, Camera.look_at((0, 0, 1.5), (0, 0, 0), vertical_fov=math.radians(40)), SIZE, max_depth=4
    )
    assert half_depth.color.mean() < 0.95, "light is still under way after four edges"


def closed_room(albedo, emission):
    """Inside a box whose walls all shine and reflect: radiance emission / (1 - albedo) everywhere."""
    wall = lambert(albedo, emission=(emission,) * 3, double_sided=True)
    return scene_of(placed(box(2.0, wall)))


@pytest.mark.parametrize(("albedo", "samples"), [(0.5, 64), (0.8, 64)])
def test_radiance_in_a_closed_room(device, albedo, samples):
    """The geometric series of all bounces, Russian roulette included."""
    camera = Camera.look_at((0.3, 0.2, 0.4), (-1, -0.3, -0.5), vertical_fov=math.radians(80))
    color = trace(device, closed_room(albedo, 1.0), samples, camera, SIZE).color
    assert color.mean() == pytest.approx(1 / (1 - albedo), rel=0.01)


@pytest.mark.parametrize("depth", [1, 2, 3, 6])
def test_depth_counts_path_edges(device, depth):
    """1 shows what shines, each further edge one more bounce: a partial sum of the series."""
    camera = Camera.look_at((0.3, 0.2, 0.4), (-1, -0.3, -0.5), vertical_fov=math.radians(80))
    color = trace(device, closed_room(0.5, 1.0), 64, camera, SIZE, max_depth=depth).color
    assert color.mean() == pytest.approx(sum(0.5**bounce for bounce in range(depth)), rel=0.01)


def test_depth_one_shows_surroundings_and_unlit_surfaces(device):
    wall = placed(plane(0.5, 0.5, lambert(0.25, unlit=True)))
    scene = scene_of(wall, shining(PointLight(intensity=100), move(0, 1, 0)), environment=uniform(3.0))
    frame = trace(device, scene, 1, ABOVE, SIZE, max_depth=1)
    shown = np.unique(frame.color)
    np.testing.assert_allclose(shown, [0.25, 3.0])


@pytest.mark.parametrize("depth", [0, -1])
def test_impossible_depth_is_named(device, depth):
    with pytest.raises(SettingsError, match=f"max_depth {depth}"):
        pica.PathTracer(scene_of(), size=SIZE, max_depth=depth, device=device)


def test_impossible_size_is_named(device):
    with pytest.raises(pica.errors.PicaError, match="picture size 0x5"):
        pica.PathTracer(scene_of(), size=(0, 5), device=device)


def test_same_seed_same_bits(device):
    tracer = pica.PathTracer(still_life(), size=SIZE, device=device)
    first, again = tracer.render(3, camera=CAMERA).color, tracer.render(3, camera=CAMERA).color
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first, trace(device, still_life(), 3, CAMERA, SIZE).color)
    other = trace(device, still_life(), 3, CAMERA, SIZE, values={"seed": "1"}).color
    assert (first != other).mean() > 0.5


def test_noise_falls_with_the_square_root_of_the_samples(device):
    tracer = pica.PathTracer(still_life(), size=SIZE, device=device)
    reference = tracer.render(512, camera=CAMERA).color
    errors = [np.abs(tracer.render(samples, camera=CAMERA).color - reference).mean() for samples in (4, 64)]
    assert 2.5 < errors[0] / errors[1] < 6


def test_every_pixel_is_a_number(device):
    """Mirrors, grazing light, a tiny fierce lamp, a surface at the origin."""
    mirror = Material(base_color=(1, 1, 1, 1), metallic=1.0, roughness=0.0)
    radiance = np.zeros((8, 16, 3), np.float32)
    radiance[3, 5] = 1e5
    scene = scene_of(
        placed(plane(4, 4, mirror)),
        placed(sphere(0.5, Material(base_color=(1, 1, 1, 1), metallic=0.0, roughness=0.02)), move(0, 0.5, 0)),
        placed(box(0.4, lambert(0.0)), move(0.8, 0.2, 0)),
        shining(SphereLight(radiance=1e4, radius=0.01), move(0, 1.5, 0)),
        shining(PointLight(intensity=1.0), move(0.5, 0, 0.5)),
        shining(DirectionalLight(illuminance=1.0, angular_diameter=1e-3), rotate("x", 180)),
        environment=Environment(radiance),
    )
    color = trace(device, scene, 32, CAMERA, SIZE).color
    assert np.isfinite(color).all() and (color >= 0).all() and color.mean() > 0


def test_sizes_of_objects_and_places_do_not_matter(device):
    """The same scene a thousand times larger, or far from the origin: the same picture, no self-shadowing."""

    def picture(scale, offset):
        whole = move(*offset) @ stretch(scale, scale, scale)
        ball = placed(sphere(0.5, lambert(0.7)), whole @ move(0, 0.5, 0))
        floor = placed(plane(3, 3, lambert(0.5)), whole)
        eye = (whole @ (0.4, 1.5, 3.4, 1))[:3]
        camera = Camera.look_at(eye, (whole @ (0.1, 0.4, 0, 1))[:3], vertical_fov=math.radians(42), near=0.01 * scale)
        scene = scene_of(
            ball, floor, shining(DirectionalLight(illuminance=3.0), rotate("x", -50)), environment=uniform(0.5)
        )
        return trace(device, scene, 128, camera, SIZE).color.mean((0, 1))

    expected = picture(1, (0, 0, 0))
    np.testing.assert_allclose(picture(1000, (0, 0, 0)), expected, rtol=0.01)
    np.testing.assert_allclose(picture(0.01, (0, 0, 0)), expected, rtol=0.01)
    np.testing.assert_allclose(picture(1, (500, 200, -300)), expected, rtol=0.01)


def sun_on_a_board(device, board):
    """Seen from right below the board: the floor with its shadow, 1 where all light arrives."""
    sun = shining(DirectionalLight(illuminance=math.pi), rotate("x", -90))
    scene = scene_of(placed(plane(9, 9, lambert(1.0))), board, sun)
    return trace(device, scene, 32, orthographic((0, 0.4, 0), (0, 0, 0), 1.0), (64, 64), max_depth=2).color[..., 0]


def test_shadow_of_a_mask_has_the_area_of_its_solid_part(device):
    color = sun_on_a_board(device, placed(plane(0.5, 0.5, leaves()), move(0, 0.5, 0)))
    assert 1 - color.mean() == pytest.approx(0.25 / 2, abs=0.003)


def test_shadow_of_a_blended_surface_is_its_alpha(device):
    veil = lambert(alpha_mode=AlphaMode.BLEND)
    veil.base_color = (1, 1, 1, 0.4)
    color = sun_on_a_board(device, placed(plane(0.5, 0.5, veil), move(0, 0.5, 0)))
    assert color[20:44, 20:44].mean() == pytest.approx(0.6, abs=0.02)
    np.testing.assert_allclose(color[:12], 1, rtol=0.01)


def directions_map():
    """A sky with a patch of its own colour towards each axis: +X red, +Y green, +Z blue; -X, -Y, -Z half of them."""
    radiance = np.full((32, 64, 3), 0.01, np.float32)
    for (column, row), color in {
        (32, 16): (1, 0, 0),
        (48, 16): (0, 0, 1),
        (16, 16): (0, 0, 0.5),
        (0, 16): (0.5, 0, 0),
    }.items():
        columns = np.arange(column - 4, column + 4) % 64
        radiance[row - 4 : row + 4, columns] = color
    radiance[:4], radiance[-4:] = (0, 1, 0), (0, 0.5, 0)
    return radiance


LOOKS = {
    (1, 0, 0): (1, 0, 0),
    (0, 1, 0): (0, 1, 0),
    (0, 0, 1): (0, 0, 1),
    (-1, 0, 0): (0.5, 0, 0),
    (0, -1, 0): (0, 0.5, 0),
    (0, 0, -1): (0, 0, 0.5),
}


@pytest.mark.parametrize("way", ["path traced", "hybrid"])
def test_surroundings_lie_the_right_way_round(device, way):
    """The centre column is +X, to its right +Z, the top row +Y."""
    scene = scene_of(environment=Environment(directions_map()))
    picture = trace if way == "path traced" else render
    for direction, expected in LOOKS.items():
        color = picture(
            device, scene, 1, Camera.look_at((0, 0, 0), direction, vertical_fov=math.radians(20)), (16, 16)
        ).color
        np.testing.assert_allclose(color, np.broadcast_to(expected, color.shape), atol=1e-5)
    # Facing +X with +Y up, +Z is to the right: the blue patch shows there in a wide view.
    wide = picture(
        device, scene, 1, Camera.look_at((0, 0, 0), (1, 0, 0), vertical_fov=math.radians(120)), (64, 32)
    ).color
    assert wide[:, 32:, 2].max() == pytest.approx(1, abs=1e-3)
    assert wide[:, :32, 2].max() == pytest.approx(0.5, abs=1e-3)


def test_surroundings_turn_from_z_towards_x_and_scale(device):
    scene = scene_of(environment=Environment(directions_map(), strength=3.0, rotation=math.pi / 2))
    for look, expected in (((1, 0, 0), (0, 0, 3)), ((0, 0, -1), (3, 0, 0))):
        color = trace(device, scene, 1, Camera.look_at((0, 0, 0), look, vertical_fov=math.radians(20)), (16, 16)).color
        np.testing.assert_allclose(color, np.broadcast_to(expected, color.shape), atol=1e-4)


def test_lights_with_a_shape_are_not_seen_but_reflected(device):
    """The camera looks through a sphere light; a mirror behind it shows it."""
    mirror = Material(base_color=(1, 1, 1, 1), metallic=1.0, roughness=0.0)
    light = shining(SphereLight(radiance=5.0, radius=0.3))
    alone = trace(device, scene_of(light), 4, Camera.look_at((0, 0, 3), (0, 0, 0)), SIZE)
    assert not alone.color.any()
    scene = scene_of(light, placed(plane(4, 4, mirror), move(0, 0, -1) @ rotate("x", 90)))
    # A sample in some hundreds follows the lobe of many bounces and misses.
    reflected = trace(device, scene, 512, Camera.look_at((0, 0, 3), (0, 0, -1), vertical_fov=math.radians(20)), SIZE)
    assert reflected.color[18, 24].mean() == pytest.approx(5.0, rel=0.02)


def test_mirror_balls_reflection_is_sharp_and_complete(device):
    """A fully smooth metal mirror under a uniform sky shows it unchanged."""
    mirror = Material(base_color=(0.9, 0.8, 0.7, 1), metallic=1.0, roughness=0.0)
    scene = scene_of(placed(plane(9, 9, mirror)), environment=uniform(1.0))
    color = trace(device, scene, 32, Camera.look_at((0, 3, 0.01), (0, 0, 0)), SIZE).color
    np.testing.assert_allclose(color.mean((0, 1)), [0.9, 0.8, 0.7], rtol=0.01)


def test_progress_is_told(device):
    told = []
    trace_progress = pica.PathTracer(still_life(), size=(8, 8), device=device)
    trace_progress.render(5, camera=CAMERA, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)]


@pytest.mark.parametrize("samples", [0, -3])
def test_no_samples_are_refused(device, samples):
    tracer = pica.PathTracer(still_life(), size=(8, 8), device=device)
    with pytest.raises(PicaError, match=rf"^render: samples: {samples} is not from 1 to "):
        tracer.render(samples, camera=CAMERA)


def test_frame_carries_the_same_aovs_as_the_renderers(device):
    traced, hybrid = trace(device, still_life(), 1, CAMERA, SIZE), render(device, still_life(), 1, CAMERA, SIZE)
    assert set(traced.aov_names) == set(hybrid.aov_names) - {
        "shadows",
        "diffuse_direct",
        "glossy_direct",
        "subsurface",
        "transmission",
    }
    for name in ("instance", "material", "depth", "albedo"):
        np.testing.assert_array_equal(traced.aov(name), hybrid.aov(name))


def test_older_pictures_stay(device):
    tracer = pica.PathTracer(still_life(), size=SIZE, device=device)
    frame = tracer.render(2, camera=CAMERA)
    tracer.render(3, camera=Camera.look_at((3, 1, 0), (0, 0, 0)))
    np.testing.assert_array_equal(frame.color, trace(device, still_life(), 2, CAMERA, SIZE).color)


def test_pixels_are_box_filtered(device):
    """An edge through the middle of a column of pixels: half of each, no more, no less."""
    left = placed(plane(1, 9, lambert(emission=(1, 1, 1))), move(-0.5, 0, 0))
    camera = orthographic((0, 4, 0), (0, 0, 0), 1.0)
    color = trace(device, scene_of(left), 512, camera, (9, 9), max_depth=1).color[..., 0]
    np.testing.assert_allclose(color[:, :4], 1, rtol=1e-6)
    assert color[:, 4].mean() == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(color[:, 5:], 0)


@pytest.mark.parametrize("way", ["path traced", "hybrid"])
def test_a_panel_close_to_a_floor_lights_it_beside_the_panel(device, way):
    """Shadow rays begin off the floor: in the direction from the floor itself, at a grazing angle, they passed the
    panel's plane before its point, and found it in their way."""
    low, width, depth = 0.06, 1.6, 0.9
    panel = placed(plane(width, depth, lambert(0, emission=(5.0, 5.0, 5.0))), move(0, low, 0) @ rotate("x", 180))
    scene = scene_of(placed(plane(8, 8, lambert(0.5))), panel)
    camera = Camera.look_at((1.3, 1.0, 0), (1.1, 0, 0), vertical_fov=math.radians(25))
    if way == "hybrid":
        values = {"global_illumination.mode": "off", "reflections.mode": "off"}
        given = pica.Settings().with_values(values)
        with pica.Renderer(scene, size=SIZE, settings=given, device=device) as renderer:
            frame = renderer.render(64, camera=camera)
    else:
        with pica.PathTracer(scene, size=SIZE, max_depth=2, device=device) as tracer:
            frame = tracer.render(256, camera=camera)
    places = frame.aov("position")[::6, ::6].reshape(-1, 3)
    x, z = ((np.arange(400) + 0.5) / 400 - 0.5) * width, ((np.arange(200) + 0.5) / 200 - 0.5) * depth
    x, z = np.meshgrid(x, z)
    squared = np.array([(x - place[0]) ** 2 + low**2 + (z - place[2]) ** 2 for place in places])
    expected = 0.5 / np.pi * 5 * (low**2 / squared**2).mean((1, 2)) * width * depth
    beside = places[:, 0] > 0.9
    assert beside.sum() > 20
    found = frame.color[::6, ::6].mean(-1).reshape(-1)
    assert found[beside].mean() == pytest.approx(expected[beside].mean(), rel=0.05)
