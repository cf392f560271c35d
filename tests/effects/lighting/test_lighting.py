"""Direct light and its shadows, against formulas and against the path tracer at two edges."""

import math

import numpy as np
import pytest

import pica
from pica.quality.picture_errors import compare
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, DiskLight, PointLight, RectangleLight, SphereLight, SpotLight, TubeLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import (
    converged,
    lambert,
    leaves,
    orthographic,
    placed,
    render,
    scene_of,
    settings,
    shining,
    sky,
    trace,
    uniform,
)

SIZE = (64, 48)
VIEW = Camera.look_at((0.3, 2.2, 3.2), (0, 0.3, 0), vertical_fov=math.radians(40))
ABOVE = orthographic((0, 4, 0), (0, 0, 0), 2.0)
"""Two metres of floor from edge to edge."""
FROM = aim((0.8, 1.8, 0.9), (0, 0, 0))


def stage(*lights, environment=None):
    """A floor, a shiny ball, a box and a board with holes, to cast shadows on each other."""
    shiny = Material(base_color=(0.9, 0.7, 0.4, 1), metallic=0.8, roughness=0.4)
    return scene_of(
        placed(plane(4, 4, lambert(0.7, 0.6, 0.5))),
        placed(sphere(0.35, shiny), move(-0.6, 0.35, 0.1)),
        placed(box(0.5, Material(base_color=(0.3, 0.5, 0.8, 1), metallic=0.0, roughness=0.6)), move(0.5, 0.25, -0.3)),
        placed(plane(0.6, 0.6, leaves()), move(0.1, 0.3, 0.6) @ rotate("x", 65)),
        *lights,
        environment=environment,
    )


def lamp(double_sided=False):
    """Emissive triangles: a small bright quad under which the stage stands, and a dim ball."""
    quad = lambert(0.5, emission=(20.0, 15.0, 10.0), double_sided=double_sided)
    return (
        placed(plane(0.4, 0.3, quad), move(0.2, 1.5, 0.3) @ rotate("x", 170)),
        placed(sphere(0.15, lambert(0.5, emission=(1.0, 3.0, 4.0)), 12), move(-0.9, 0.8, -0.6)),
    )


STAGES = {
    "sun": lambda: stage(shining(DirectionalLight(illuminance=5.0), FROM)),
    "wide sun": lambda: stage(shining(DirectionalLight((1, 0.9, 0.7), 5.0, math.radians(15)), FROM)),
    "point": lambda: stage(shining(PointLight(intensity=8.0), FROM)),
    "ball of a point": lambda: stage(shining(PointLight(intensity=8.0, radius=0.2), FROM)),
    "point with range": lambda: stage(shining(PointLight(intensity=20.0, range=2.5), FROM)),
    "spot": lambda: stage(shining(SpotLight(intensity=20.0, inner_cone_angle=0.2, outer_cone_angle=0.5), FROM)),
    "ball of a spot": lambda: stage(
        shining(SpotLight((0.5, 1, 0.8), 20.0, inner_cone_angle=0.2, outer_cone_angle=0.5, radius=0.15), FROM)
    ),
    "rectangle": lambda: stage(shining(RectangleLight((1, 0.8, 0.6), 15.0, 0.8, 0.5), FROM)),
    "disk": lambda: stage(shining(DiskLight(radiance=15.0, radius=0.35), FROM)),
    "sphere": lambda: stage(shining(SphereLight(radiance=12.0, radius=0.25), FROM)),
    "emissive triangles": lambda: stage(*lamp()),
    "double-sided emissive triangles": lambda: stage(*lamp(double_sided=True)),
    "environment": lambda: stage(environment=sky()),
    "all together": lambda: stage(
        shining(DirectionalLight(illuminance=1.0, angular_diameter=0.1), FROM),
        shining(PointLight((1, 0.3, 0.2), 2.0, radius=0.1), move(-1.2, 0.8, 0.6)),
        shining(RectangleLight(radiance=3.0), aim((-1, 1.5, -1), (0, 0, 0))),
        *lamp(),
        environment=sky(),
    ),
}


NOISY = {"environment": 0.08, "all together": 0.14}
"""What FLIP may be where a few hundred samples leave noise, most of it the path tracer's."""


@pytest.mark.parametrize("name", STAGES)
def test_mean_of_many_frames_is_path_traced_direct_light(device, name):
    hybrid = render(device, STAGES[name](), 128, VIEW, SIZE).color
    reference = converged(device, STAGES[name](), 256, VIEW, SIZE, max_depth=2)
    assert reference.mean() > 0.03
    np.testing.assert_allclose(hybrid.mean((0, 1)), reference.mean((0, 1)), rtol=0.01)
    assert compare(reference, hybrid).flip < NOISY.get(name, 0.03)


def test_irradiance_of_a_directional_light(device):
    """A Lambert floor sends back albedo / pi of the illuminance, times the cosine."""
    for angle in (0, 40, 75):
        floor = placed(plane(9, 9, lambert(0.8, 0.4, 0.2)))
        sun = shining(DirectionalLight((1, 0.5, 0.25), 3.0), rotate("z", angle) @ rotate("x", -90))
        color = render(device, scene_of(floor, sun), 1, ABOVE, SIZE).color
        expected = np.multiply((0.8, 0.4, 0.2), (1, 0.5, 0.25)) * 3 * math.cos(math.radians(angle)) / math.pi
        np.testing.assert_allclose(color, np.broadcast_to(expected, color.shape), rtol=0.005)


def floor_points(size):
    """(height, width) x and z of the floor at the pixel centres of ABOVE."""
    width, height = size
    x, z = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return (x - 0.5) * 2 * width / height, (z - 0.5) * 2


def test_irradiance_of_a_point_light(device):
    """I cos / distance squared."""
    height = 0.7
    floor = placed(plane(9, 9, lambert(0.6)))
    color = render(
        device, scene_of(floor, shining(PointLight(intensity=5.0), move(0, height, 0))), 1, ABOVE, SIZE
    ).color
    x, z = floor_points(SIZE)
    square = x**2 + z**2 + height**2
    expected = 0.6 / math.pi * 5 * height / square**1.5
    np.testing.assert_allclose(color[..., 0], expected, rtol=0.01)


def test_cone_of_a_spot(device):
    light = SpotLight(intensity=5.0, inner_cone_angle=math.radians(20), outer_cone_angle=math.radians(35))
    scene = scene_of(placed(plane(9, 9, lambert(0.6))), shining(light, move(0, 1, 0) @ rotate("x", -90)))
    color = render(device, scene, 1, ABOVE, SIZE).color[..., 0]
    x, z = floor_points(SIZE)
    angle = np.degrees(np.arctan(np.hypot(x, z)))
    full = 0.6 / math.pi * 5 * np.cos(np.radians(angle)) ** 3
    inside, outside = angle < 20, angle > 35
    assert inside.any() and outside.any()
    np.testing.assert_allclose(color[inside], full[inside], rtol=0.01)
    assert not color[outside].any()
    between = (angle > 22) & (angle < 33)
    assert (color[between] < full[between]).all() and (color[between] > 0).all()


def test_irradiance_under_a_uniform_sky(device):
    """A Lambert floor under radiance L all around shows albedo * L."""
    scene = scene_of(placed(plane(9, 9, lambert(0.8, 0.4, 0.2))), environment=uniform(2.0))
    color = render(device, scene, 64, ABOVE, SIZE).color
    np.testing.assert_allclose(color.mean((0, 1)), [1.6, 0.8, 0.4], rtol=0.005)


def test_irradiance_of_a_disk_above(device):
    """On the axis: pi L sin^2 of the half angle; pictures of a few pixels around the axis."""
    scene = scene_of(
        placed(plane(9, 9, lambert(1.0))),
        shining(DiskLight(radiance=3.0, radius=0.5), move(0, 1, 0) @ rotate("x", -90)),
    )
    color = render(device, scene, 256, orthographic((0, 0.9, 0), (0, 0, 0), 0.02), (16, 16)).color
    np.testing.assert_allclose(color.mean(), 3.0 * 0.5**2 / (1 + 0.5**2), rtol=0.01)


def test_specular_zero_is_pure_lambert(device):
    """From every side the same radiance; with the dielectric reflection it is not."""
    sun = shining(DirectionalLight(illuminance=math.pi), rotate("x", -90))

    def seen(specular, eye):
        floor = placed(plane(9, 9, lambert(0.5, specular=specular)))
        camera = orthographic(eye, (0, 0, 0), 0.5)
        return render(device, scene_of(floor, sun), 1, camera, (16, 16)).color.mean()

    views = [(0, 2, 0.001), (1, 2, 0), (3, 1, 1)]
    np.testing.assert_allclose([seen(0.0, eye) for eye in views], 0.5, rtol=1e-3)
    shiny = [seen(1.0, eye) for eye in views]
    assert max(shiny) - min(shiny) > 0.005


def board_shadow(device, mode, light, frames):
    """The floor under a square board of half a metre, as the share of the light that arrives."""
    board = placed(box((0.5, 0.01, 0.5), lambert()), move(0, 0.5, 0))
    scene = scene_of(placed(plane(9, 9, lambert(1.0))), board, shining(light, rotate("x", -90)))
    camera = orthographic((0, 0.4, 0), (0, 0, 0), 1.0)
    values = {"shadows.mode": mode, "shadows.denoiser": "off"}  # effects/shadows/ has the filters' tests
    color = render(device, scene, frames, camera, (64, 64), values).color[..., 0]
    return color * math.pi / light.illuminance


def test_hard_shadows_are_all_or_nothing(device):
    share = board_shadow(device, "hard", DirectionalLight(illuminance=2.0, angular_diameter=0.5), 1)
    # The middle of a disk this wide stands for the cosine of all of it, which is a little less.
    dark, lit = np.isclose(share, 0, atol=1e-6), np.isclose(share, 1, rtol=0.02)
    assert (dark | lit).all()
    assert dark.mean() == pytest.approx(0.25, abs=0.01)
    x = np.abs((np.arange(64) + 0.5) / 64 - 0.5)
    np.testing.assert_array_equal(dark, (x < 0.25)[:, None] & (x < 0.25))


def test_soft_shadows_have_a_half_shade_of_the_right_width(device):
    """The sun's disk seen past the board's edge, half a metre above: the shade spreads by tan of the half angle."""
    diameter = math.radians(20)
    share = board_shadow(device, "soft", DirectionalLight(illuminance=2.0, angular_diameter=diameter), 128)
    row = share[28:36].mean(0)
    place = ((np.arange(64) + 0.5) / 64 - 0.5) - 0.25  # from the edge, metres
    reach = 0.5 * math.tan(diameter / 2)
    np.testing.assert_allclose(row[(place > reach + 0.02)], 1, rtol=0.02)
    np.testing.assert_allclose(row[(place < -reach - 0.02) & (place > -0.2)], 0, atol=1e-6)
    assert row[np.argmin(np.abs(place))] == pytest.approx(0.5, abs=0.1)
    half_shade = (row > 0.02) & (row < 0.98) & (place > -0.2)
    assert half_shade.sum() / 64 == pytest.approx(2 * reach, abs=0.06)


def test_one_frame_of_soft_shadows_is_noise_of_all_or_nothing(device):
    share = board_shadow(device, "soft", DirectionalLight(illuminance=2.0, angular_diameter=0.4), 1)
    assert (np.isclose(share, 0, atol=1e-6) | np.isclose(share, 1, rtol=0.02)).all()


def test_no_shadows(device):
    share = board_shadow(device, "off", DirectionalLight(illuminance=2.0), 1)
    np.testing.assert_allclose(share, 1, rtol=0.01)


def test_shadow_of_a_mask_has_holes(device):
    """Half of the board is clear: half of its shadow is lit."""
    board = placed(plane(0.5, 0.5, leaves()), move(0, 0.5, 0))
    sun = shining(DirectionalLight(illuminance=math.pi), rotate("x", -90))
    scene = scene_of(placed(plane(9, 9, lambert(1.0))), board, sun)
    color = render(device, scene, 1, orthographic((0, 0.4, 0), (0, 0, 0), 1.0), (64, 64)).color[..., 0]
    assert (color < 0.01).mean() == pytest.approx(0.25 / 2, abs=0.005)
    solid = np.kron(np.indices((4, 4)).sum(0) % 2, np.ones((8, 8))) == 1
    np.testing.assert_array_equal(color[16:48, 16:48] < 0.01, solid)


def test_lights_do_not_shine_through_what_they_stand_on(device):
    """No light leaks and no surface shades itself: a sun at grazing angles on a closed box."""
    sun = shining(DirectionalLight(illuminance=math.pi), rotate("z", 88) @ rotate("x", -90))
    floor = placed(plane(9, 9, lambert(1.0)))
    color = render(device, scene_of(floor, sun), 8, ABOVE, SIZE).color
    np.testing.assert_allclose(color, math.cos(math.radians(88)), rtol=0.01)
    under = scene_of(placed(plane(9, 9, lambert(1.0, double_sided=True))), sun)
    below = render(device, under, 8, orthographic((0, -1, 0.001), (0, 0, 0), 1.0), SIZE)
    assert below.aov("instance").all() and not below.color.any()


def many_lights(count):
    random = np.random.default_rng(3)
    return [
        shining(PointLight(tuple(random.uniform(0.2, 1, 3)), random.uniform(0.1, 1)), move(x, y, z))
        for x, y, z in random.uniform((-1.5, 0.4, -1.5), (1.5, 1.2, 1.5), (count, 3))
    ]


@pytest.mark.parametrize(("count", "slots"), [(33, 29), (300, 1)])
def test_lights_beyond_the_slots_share_one_ray_and_bring_all_their_light(device, count, slots):
    """Up to 29 slots, and one more for all other lights, the emissive triangles and the environment."""
    scene = stage(*many_lights(count), *lamp(), environment=uniform(0.3, 0.4, 0.5))
    values = {"shadows.max_lights": str(slots)}
    hybrid = render(device, scene, 160, VIEW, SIZE, values)
    reference = converged(device, scene, 1024, VIEW, SIZE, max_depth=2)
    np.testing.assert_allclose(hybrid.color.mean((0, 1)), reference.mean((0, 1)), rtol=0.02)
    assert hybrid.aov("shadows").shape == (48, 64, slots + 1)


@pytest.mark.parametrize(("level", "rays"), [("low", 1), ("medium", 2)])
def test_no_scene_takes_more_rays_than_the_budget(device, level, rays):
    """One for each of most pixels, or two."""
    sun = shining(DirectionalLight(illuminance=0.1, angular_diameter=0.02), rotate("x", -60))
    sun.name = "sun"
    scene = stage(*many_lights(12), *lamp(), sun, environment=uniform(0.3, 0.4, 0.5))
    renderer = pica.Renderer(scene, size=SIZE, settings=pica.Settings().with_values({"shadows": level}), device=device)
    renderer.render(1, camera=VIEW)
    traced = renderer.count_rays(VIEW)["shadow_rays"]
    assert (rays - 1) * SIZE[0] * SIZE[1] < traced <= rays * SIZE[0] * SIZE[1]
    assert renderer.single_lights == ["sun"][: rays - 1], "the strongest light is another one"


@pytest.mark.parametrize("candidates", [1])
def test_any_number_of_candidates_has_the_same_mean(device, candidates):
    """A shadow that most lights cannot cast, metal that shows some lights more than others."""
    scene = stage(*many_lights(12), *lamp())
    values = {"shadows.max_lights": "1", "lighting.candidates": str(candidates)}
    few = render(device, scene, 256, VIEW, SIZE, values).color
    many = render(device, scene, 128, VIEW, SIZE, {**values, "lighting.candidates": "16"}).color
    np.testing.assert_allclose(few.mean((0, 1)), many.mean((0, 1)), rtol=0.02)


def test_more_candidates_make_less_noise(device):
    scene = stage(*many_lights(40))

    def error(candidates):
        values = {"shadows.max_lights": "1", "lighting.candidates": str(candidates)}
        few = render(device, scene, 4, VIEW, SIZE, values).color
        return np.abs(few - mean).mean()

    mean = render(device, scene, 128, VIEW, SIZE, {"shadows.max_lights": "29"}).color
    assert error(32) < 0.6 * error(1)


def test_mirrors_find_lamps_that_share_a_ray(device):
    """A point drawn on a lamp is rarely where a sharp lobe shows it."""
    metal = Material(base_color=(0.9, 0.8, 0.7, 1), metallic=1.0, roughness=0.12)
    lamps = [
        shining(RectangleLight(radiance=8.0, width=0.8, height=0.3), aim((1, 1.6, -0.8), (0, 0, 0))),
        shining(RectangleLight(radiance=5.0, width=0.2, height=1.2), aim((-1.2, 1.4, -1), (0, 0, 0))),
        shining(DiskLight(radiance=9.0, radius=0.3), aim((0, 1.8, 0.9), (0, 0, 0))),
        shining(SphereLight(radiance=12.0, radius=0.2), move(-0.8, 1.2, 0.8)),
        shining(TubeLight(radiance=9.0, radius=0.04, length=1.2), move(0.3, 1.2, -1.4)),
    ]
    balls = [placed(sphere(0.3, metal), move(x, 0.3, z)) for x in (-0.9, 0, 0.9) for z in (-0.6, 0.3)]
    scene = scene_of(placed(plane(4, 4, metal)), *balls, *lamps)
    hybrid = render(device, scene, 48, VIEW, SIZE, {"shadows.max_lights": "1"}).color
    reference = converged(device, scene, 512, VIEW, SIZE, max_depth=2)
    np.testing.assert_allclose(hybrid.mean((0, 1)), reference.mean((0, 1)), rtol=0.03)
    white = np.percentile(reference, 98)
    assert np.minimum(hybrid, white).mean() == pytest.approx(np.minimum(reference, white).mean(), rel=0.1)


def test_the_shared_ray_goes_where_the_light_comes_from(device):
    """Of thirty lights, one near the floor outshines all others there: nearly all rays look at it."""
    near = shining(PointLight(intensity=1.0), move(0, 0.2, 0))
    far = [shining(PointLight(intensity=1.0), move(x, 6, 8)) for x in np.linspace(-9, 9, 29)]
    scene = scene_of(placed(plane(9, 9, lambert(1.0))), near, *far)
    camera = orthographic((0, 0.1, 0), (0, 0, 0), 0.1, near=0.01)
    values = {"shadows.max_lights": "1", "lighting.candidates": "64"}
    color = render(device, scene, 1, camera, (32, 32), values).color
    assert np.median(np.abs(color - color.mean())) < 0.05 * color.mean()


def test_with_all_slots_taken_each_light_keeps_its_own_shadow(device):
    """The strongest light is hidden everywhere, the last slot, the sky, nowhere."""
    roof = placed(plane(9, 9, lambert()), move(0, 50, 0))
    sun = shining(DirectionalLight(illuminance=1000.0), rotate("x", -90))
    rest = [shining(PointLight(intensity=1e-3), move(place / 28 - 0.5, 0.5, 0)) for place in range(29)]
    scene = scene_of(placed(plane(9, 9, lambert(1.0))), roof, sun, *rest, environment=uniform(1.0))
    color = render(device, scene, 32, ABOVE, SIZE, {"shadows.max_lights": "29"}).color
    assert color.mean() == pytest.approx(1.0, rel=0.03)


def test_shadow_layers_show_the_lights_one_by_one(device):
    """Strongest first; 1 where the sample is free."""
    left = shining(DirectionalLight(illuminance=1.0), rotate("z", 45) @ rotate("x", -90))
    strong = shining(DirectionalLight(illuminance=5.0), rotate("x", -90))
    scene = scene_of(placed(plane(9, 9, lambert())), placed(box(0.3, lambert()), move(0, 0.3, 0)), left, strong)
    layers = render(device, scene, 1, ABOVE, SIZE).aov("shadows")
    assert layers.shape == (48, 64, 2) and set(np.unique(layers)) == {0, 1}
    shade = layers == 0
    assert shade[..., 1].sum() > 0 and shade[..., 1][:, :32].sum() != shade[..., 1][:, 32:].sum()
    assert shade[..., 0].sum() < shade[..., 1].sum()


def test_emission_is_seen_on_the_front_only(device):
    material = lambert(emission=(3.0, 2.0, 1.0))
    for double_sided, angle, expected in ((False, 90, (3, 2, 1)), (True, -90, (3, 2, 1)), (False, -90, (0, 0, 0))):
        material.double_sided = double_sided
        frame = render(
            device,
            scene_of(placed(plane(9, 9, material), rotate("x", angle))),
            1,
            Camera.look_at((0, 0, 2), (0, 0, 0)),
            SIZE,
        )
        np.testing.assert_allclose(frame.color, np.broadcast_to(expected, frame.color.shape), rtol=1e-6)


@pytest.mark.parametrize(("sun", "tolerance"), [(False, 0.01), (True, 0.07)], ids=["smooth", "sunny"])
def test_prefiltered_sky_is_close_to_the_sampled_one_on_diffuse_surfaces(device, sun, tolerance):
    """One ball alone, so that nothing hides the sky: irradiance by direction. A small sun is caught less well."""
    environment = sky() if sun else Environment(np.clip(sky().radiance, 0, 0.5))
    scene = scene_of(placed(sphere(0.8, lambert(0.8), 64)), environment=environment)
    camera = Camera.look_at((0, 0.5, 3), (0, 0, 0), vertical_fov=math.radians(32))
    sampled = trace(device, scene, 256, camera, SIZE, max_depth=2)
    prefiltered = render(device, scene, 1, camera, SIZE, {"lighting.environment": "prefiltered"})
    # Away from the ball's edge, where the path tracer's pixels are partly sky.
    inner = (sampled.aov("instance") == 1) & (sampled.aov("normal") @ camera.transform[:3, 2] > 0.4)
    assert inner.sum() > 300
    np.testing.assert_allclose(prefiltered.color[inner].mean(0), sampled.color[inner].mean(0), rtol=tolerance)
    relative = prefiltered.color[inner].mean(1) / sampled.color[inner].mean(1)
    assert np.abs(relative - 1).mean() < 2 * tolerance


def test_floors_take_prefiltered_light_from_above(device):
    """A sky that is bright on one side, whose light on a level floor is that of its mean: a tilted floor has more."""
    polar, azimuth = np.meshgrid(
        (np.arange(64) + 0.5) * math.pi / 64, (np.arange(128) - 63.5) * math.pi / 64, indexing="ij"
    )
    radiance = np.repeat((1 + np.sin(polar) * np.cos(azimuth))[..., None], 3, 2)
    scene = scene_of(placed(plane(9, 9, lambert(0.5))), environment=Environment(radiance.astype(np.float32)))
    frame = render(device, scene, 1, ABOVE, SIZE, {"lighting.environment": "prefiltered"})
    np.testing.assert_allclose(frame.color.mean(), 0.5, rtol=0.01)


def test_prefiltered_sky_reflects_by_roughness(device):
    """A mirror ball in a uniform sky shows the sky's radiance at every roughness."""
    for roughness in (0.1, 0.5, 1.0):
        ball = Material(base_color=(1, 1, 1, 1), metallic=1.0, roughness=roughness)
        scene = scene_of(placed(sphere(0.8, ball, 64)), environment=uniform(2.0))
        values = {"lighting.environment": "prefiltered"}
        frame = render(
            device, scene, 1, Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(30)), SIZE, values
        )
        seen = frame.aov("instance") == 1
        np.testing.assert_allclose(frame.color[seen].mean(), 2.0, rtol=0.03)


def test_surroundings_off_light_nothing_but_are_seen(device):
    scene = scene_of(placed(sphere(0.5, lambert())), environment=uniform(2.0))
    frame = render(device, scene, 2, Camera.look_at((0, 0, 3), (0, 0, 0)), SIZE, {"lighting.environment": "off"})
    ball = frame.aov("instance") == 1
    # After two frames a pixel at the edge may have seen both.
    assert np.median(frame.color[ball]) == 0
    np.testing.assert_allclose(frame.color[0, 0], 2.0)


def test_another_seed_is_another_noise_of_the_same_strength(device):
    scene = STAGES["wide sun"]()
    first, again, other = (
        pica.Renderer(scene, size=SIZE, settings=settings({"seed": seed}), device=device).render(1, camera=VIEW).color
        for seed in ("0", "0", "7")
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    assert other.std() == pytest.approx(first.std(), rel=0.05)
