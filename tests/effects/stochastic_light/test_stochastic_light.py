"""Light of many lights, emissive triangles and the surroundings from one ray a pixel, and its filter."""

from itertools import combinations

import numpy as np
import pytest

import pica
from pica import quality
from pica.scene.anisotropy import Anisotropy
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scene.environment import Environment
from pica.scene.iridescence import Iridescence
from pica.scene.light import PointLight, RectangleLight, SphereLight
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scene.sheen import Sheen
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import converged, edges, lambert, orthographic, placed, scene_of, settings, shining, sky

SIZE = (64, 48)
VIEW = Camera.look_at((0.3, 2.2, 3.2), (0, 0.3, 0), vertical_fov=np.radians(40))
GLOSSY = Material(base_color=(0.9, 0.6, 0.3, 1), metallic=1.0, roughness=0.4)


def things(*more, environment=None):
    return scene_of(
        placed(plane(4, 4, lambert(0.7, 0.6, 0.5))),
        placed(sphere(0.35, GLOSSY), move(-0.6, 0.35, 0.1), "ball"),
        placed(box(0.5, Material(base_color=(0.3, 0.5, 0.8, 1), metallic=0.0, roughness=0.6)), move(0.5, 0.25, -0.3)),
        *more,
        environment=environment,
    )


def many_lights(number=60):
    random = np.random.default_rng(3)
    places = random.uniform((-1.5, 0.6, -1.5), (1.5, 1.5, 1.5), (number, 3))
    colors = random.uniform(0.3, 1, (number, 3))
    return [
        shining(PointLight(tuple(map(float, color)), 4 / number), move(*place))
        for color, place in zip(colors, places, strict=True)
    ]


def glow():
    return placed(plane(0.4, 0.3, lambert(0.5, emission=(20.0, 15.0, 10.0))), move(0.2, 1.5, 0.3) @ rotate("x", 170))


SCENES = {
    "many lights": lambda: things(*many_lights()),
    "emissive triangles": lambda: things(glow()),
    "surroundings": lambda: things(environment=sky()),
}


def soft_lights():
    """Two more than get filtered shadows."""
    return things(*(shining(SphereLight(radiance=9, radius=0.3), move(x / 2, 1.4, 0.8)) for x in range(-2, 4)))


def renderer_of(device, scene, size=SIZE, filters=True):
    values = {"shadows.max_lights": "8", "debug.filters": str(filters)}
    renderer = pica.Renderer(scene, size=size, settings=settings(values), device=device)
    renderer.debug = True
    return renderer


def relative_error(found, expected):
    """Mean difference over the mean; squares would tell of nothing but highlights smaller than a pixel."""
    return np.abs(found - expected).mean() / expected.mean()


@pytest.mark.parametrize("name", SCENES)
def test_few_frames_come_nearer_to_the_mean_of_many(device, name):
    many = renderer_of(device, SCENES[name](), filters=False).render(400, camera=VIEW)
    inside = ~edges(many.aov("instance"))  # elsewhere four frames are too few for antialiasing
    expected = many.color
    raw = renderer_of(device, SCENES[name](), filters=False).render(4, camera=VIEW).color
    filtered = renderer_of(device, SCENES[name]()).render(4, camera=VIEW).color
    before, after = (relative_error(picture[inside], expected[inside]) for picture in (raw, filtered))
    assert after < 0.9 * before, f"{before:.3f} as it is, {after:.3f} filtered"
    np.testing.assert_allclose(filtered.mean((0, 1)), raw.mean((0, 1)), rtol=0.02)


def test_a_still_picture_converges_to_that_without_filter(device):
    unfiltered = renderer_of(device, SCENES["emissive triangles"](), filters=False).render(400, camera=VIEW).color
    errors = []
    for frames in (8, 40, 200):
        found = renderer_of(device, SCENES["emissive triangles"]()).render(frames, camera=VIEW).color
        errors.append(relative_error(found, unfiltered))
    assert errors[2] < 0.5 * errors[1] < 0.5 * errors[0], errors
    np.testing.assert_allclose(found.mean((0, 1)), unfiltered.mean((0, 1)), rtol=0.003)


def test_patterns_stay_sharp_and_black_channels_hide_nothing(device):
    """A board of pure red and white fields: each field is its own colour times the same light."""
    fields = np.indices((8, 8)).sum(0) % 2
    pixels = np.full((8, 8, 4), 255, np.uint8)
    pixels[fields == 1, 1:3] = 0
    pattern = Texture(Image(pixels, "board"), Sampler(linear=False))
    board = lambert(1.0, base_color_texture=pattern)
    camera = orthographic((0, 4, 0), (0, 0, 0), 2.0)
    scene = scene_of(placed(plane(4, 4, board)), *many_lights())
    frame = renderer_of(device, scene, (64, 64)).render(1, camera=camera)
    albedo = frame.aov("albedo")
    white, red = (albedo[..., 1] > 0.9), (albedo[..., 1] < 0.1)
    assert white.sum() > 500 and red.sum() > 500
    assert frame.color[red][:, 1:].max() == 0
    light = frame.aov("debug.stochastic_light.diffuse.filtered")
    # The same in both kinds of fields, all over the board.
    np.testing.assert_allclose(light[white].mean(0), light[red].mean(0), rtol=0.1)
    assert np.abs(np.diff(light.mean(-1), axis=1)).mean() < 0.1 * light.mean()


def test_light_that_went_is_gone_soon_and_leaves_no_trail(device):
    lamps = many_lights()
    scene = things(*lamps)
    # Antialiasing has a history of its own, which is not what is tested.
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({"antialiasing.mode": "accumulate"}), device=device)
    ball = next(node for node in scene.nodes() if node.name == "ball")

    def step():
        ball.transform = move(1e-6, 0, 0) @ ball.transform  # something moves in every frame
        return renderer.render(1, camera=VIEW).color

    for _ in range(16):
        before = step()
    for lamp in lamps[:-9]:
        scene.remove(lamp)
    after = [step() for _ in range(12)]
    level = np.mean(after[8:], 0)
    assert level.mean() < 0.6 * before.mean(), "nothing to see"
    left = [(picture - level).mean() / (before - level).mean() for picture in after]
    assert left[3] < 0.1 and left[7] < 0.03, left


def test_a_picture_with_little_noise_is_soon_without_filter(device):
    renderer = renderer_of(device, things(*many_lights(20)), (32, 24))
    assert "stochastic_light_filter" in renderer.render(50, camera=VIEW).timings
    assert "stochastic_light_filter" not in renderer.render(10, camera=VIEW).timings


def test_a_picture_at_rest_leaves_its_history_as_it_is_until_something_moves(device):
    scene = things(*many_lights(20))
    renderer = renderer_of(device, scene, (32, 24))
    for _ in range(130):
        renderer.advance(VIEW)
    resting = renderer.render(1, camera=VIEW)
    assert "stochastic_light_history" not in resting.timings and "stochastic_light_modulate" in resting.timings
    ball = next(node for node in scene.nodes() if node.name == "ball")
    ball.transform = move(0.01, 0, 0) @ ball.transform
    moved = renderer.render(1, camera=VIEW)
    assert "stochastic_light_history" in moved.timings
    assert np.median(moved.aov("debug.stochastic_light.diffuse.history")) > 100, "what stands still is known"


def test_noise_in_motion_is_less_than_without_filter(device):
    def flicker(filters=True):
        renderer = renderer_of(device, SCENES["many lights"](), filters=filters)
        pictures = []
        for frame in range(12):
            camera = Camera.look_at((0.3 + 0.005 * frame, 2.2, 3.2), (0, 0.3, 0), vertical_fov=np.radians(40))
            pictures.append(renderer.render(1, camera=camera).color)
        return np.abs(pictures[-1] - pictures[-2]).mean() / pictures[-1].mean()

    raw, filtered = flicker(filters=False), flicker()
    assert filtered < 0.35 * raw, f"{raw:.3f} as it is, {filtered:.3f} filtered"


def test_highlights_of_mirrors_stay_where_they_are_seen(device):
    """The camera turns about balls of smooth metal below lamps: what they mirror wanders over them."""
    metal = Material(base_color=(0.9, 0.9, 0.9, 1), metallic=1.0, roughness=0.12)
    balls = [placed(sphere(0.35, metal), move(x, 0.35, z)) for x in (-0.9, 0, 0.9) for z in (-0.5, 0.5)]
    lamp = RectangleLight(radiance=20.0, width=0.5, height=0.15)
    lamps = [shining(lamp, move(x, 1.6, z) @ rotate("x", -90)) for x in (-0.8, 0, 0.8) for z in (-0.8, 0.6)]
    scene = scene_of(placed(plane(4, 4, lambert(0.3))), *balls, *lamps)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(), device=device)
    for frame in range(16):
        angle = np.radians(0.4 * frame)
        camera = Camera.look_at((3 * np.sin(angle), 2.2, 3 * np.cos(angle)), (0, 0.3, 0), vertical_fov=np.radians(40))
        picture = renderer.render(1, camera=camera)
    reference = converged(device, scene, 512, camera, SIZE, max_depth=2)
    assert quality.compare(reference, picture.color).flip < 0.14


def test_highlights_leave_a_plate_that_tilts(device):
    """The camera rests: a flat plate of satin metal shows a lamp, and turns away from it."""
    satin = Material(base_color=(0.9, 0.9, 0.9, 1), metallic=1.0, roughness=0.15)
    plate = placed(plane(1, 1, satin))
    lamp = lambert(0.5, emission=(60.0, 60.0, 60.0))
    scene = scene_of(plate, placed(plane(0.4, 0.4, lamp), move(0, 2, -1.2) @ rotate("x", 149)))
    camera = Camera.look_at((0, 2, 1.2), (0, 0, 0), vertical_fov=np.radians(25))

    def glossy(frames, renderer, degrees):
        plate.transform = rotate("x", degrees)
        return renderer.render(frames, camera=camera).aov("glossy_direct")[20:28, 24:40].mean()

    with pica.Renderer(scene, size=SIZE, settings=settings(), device=device) as renderer:
        moving = [glossy(1, renderer, 1.5 * frame) for frame in range(13)]
        renderer.reset()
        bright, away = (glossy(32, renderer, degrees) for degrees in (0, 18))
    assert moving[0] > 0.5 * bright
    assert moving[-1] - away < 0.003 * bright


def test_highlights_leave_a_plate_that_the_camera_goes_round(device):
    """A bright band of the surroundings, in a plate of satin metal, at a degree a frame."""
    radiance = np.full((32, 64, 3), 0.2, np.float32)
    radiance[:, 30:34] = 20.0
    satin = Material(base_color=(0.9, 0.9, 0.9, 1), metallic=1.0, roughness=0.45)
    scene = scene_of(placed(plane(2, 2, satin), rotate("x", 90)), environment=Environment(radiance))

    def light(renderer, frames, degrees):
        angle = np.radians(degrees)
        camera = Camera.look_at((4 * np.sin(angle), 0, 4 * np.cos(angle)), (0, 0, 0), vertical_fov=np.radians(20))
        return renderer.render(frames, camera=camera).color[12:36, 16:48].mean()

    with pica.Renderer(scene, size=SIZE, settings=pica.Settings(), device=device) as renderer:
        moving = [light(renderer, 1, degrees) for degrees in range(-63, -39)]
        renderer.reset()
        assert moving[-1] == pytest.approx(light(renderer, 48, -40), rel=0.09)


def test_only_noisy_light_is_filtered(device):
    def passes(scene, filters=True):
        return set(renderer_of(device, scene, filters=filters).render(1, camera=VIEW).timings)

    mine = {"stochastic_light_history", "stochastic_light_filter", "stochastic_light_modulate"}
    assert mine <= passes(SCENES["many lights"]())
    assert not mine & passes(SCENES["many lights"](), filters=False)
    assert not mine & passes(things(shining(PointLight(intensity=3.0), move(0, 2, 0))))
    assert mine <= passes(soft_lights())
    unwanted = settings({"shadows.max_lights": "8", "shadows.denoiser": "off"})
    assert not mine & set(
        pica.Renderer(soft_lights(), size=SIZE, settings=unwanted, device=device).render(1, camera=VIEW).timings
    )


def test_soft_lights_beyond_the_filtered_keep_their_light(device):
    raw, filtered = (renderer_of(device, soft_lights(), filters=on).render(4, camera=VIEW) for on in (False, True))
    np.testing.assert_allclose(filtered.color.mean((0, 1)), raw.color.mean((0, 1)), rtol=0.005)
    assert filtered.aov("debug.stochastic_light.diffuse.filtered").mean() > 0.1


def test_views_show_history_and_variance(device):
    renderer = renderer_of(device, SCENES["surroundings"]())
    frame = renderer.render(5, camera=VIEW)
    for part in ("diffuse", "specular"):
        raw, filtered = (frame.aov(f"debug.stochastic_light.{part}.{name}") for name in ("raw", "filtered"))
        assert raw.shape == filtered.shape == (SIZE[1], SIZE[0], 3)
        assert filtered.std() < raw.std()
        assert frame.aov(f"debug.stochastic_light.{part}.history").max() == 5
        assert frame.aov(f"debug.stochastic_light.{part}.variance").max() > 0
    renderer.reset()
    assert renderer.render(1, camera=VIEW).aov("debug.stochastic_light.diffuse.history").max() == 1


def test_sunlight_of_a_hundred_thousand_lux_does_not_overflow(device):
    radiance = np.full((16, 32, 3), 3000, np.float32)
    radiance[4, 20] = 1e8
    color = renderer_of(device, things(environment=Environment(radiance))).render(2, camera=VIEW).color
    assert np.isfinite(color).all() and color.max() > 1e4


def test_a_first_frame_is_filtered_by_what_neighbours_tell(device):
    """Without any history the variance that guides the filter is a number everywhere."""
    renderer = pica.Renderer(pica.scenes.cornell(), size=(48, 32), device=device)
    renderer.debug = True
    frame = renderer.render(1)
    for part in ("diffuse", "specular"):
        assert np.isfinite(frame.aov(f"debug.stochastic_light.{part}.variance")).all()
    raw, filtered = (frame.aov(f"debug.stochastic_light.diffuse.{name}").mean(-1) for name in ("raw", "filtered"))
    lit = raw > 0
    across = [np.abs(np.diff(values, axis=1))[lit[:, 1:] & lit[:, :-1]].mean() for values in (raw, filtered)]
    assert across[1] < 0.7 * across[0]


def test_light_through_a_window_is_smooth_at_rest(device):
    """Most samples of the sky point to a sun that the walls hide: the filter stays until the rare others suffice."""
    slabs = {  # size, middle; the last two leave a slit
        (0.1, 3, 4): (-2, 1.5, 0),
        (4, 3, 0.1): (0, 1.5, -2),
        (4.0, 3, 0.11): (0, 1.5, 2),
        (4, 0.1, 4): (0, 3, 0),
        (0.1, 1.2, 4): (2, 0.6, 0),
        (0.1, 1, 4): (2, 2.5, 0),
    }
    walls = [placed(box(size, lambert(0.7)), move(*middle)) for size, middle in slabs.items()]
    scene = scene_of(placed(plane(4, 4, lambert(0.5))), *walls, environment=sky())
    camera = Camera.look_at((1.2, 1.5, 1.5), (-0.6, 1.3, -2), vertical_fov=1.0)
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        light = renderer.render(48, camera=camera).color.mean(-1)
        assert "stochastic_light_filter" in renderer.render(32, camera=camera).timings
    expected = converged(device, scene, 256, camera, SIZE).mean(-1)
    assert light.mean() == pytest.approx(expected.mean(), rel=0.03)
    assert np.median(np.abs(np.diff(light, axis=1))) < 0.05 * light.mean()  # .1 if it fades with time alone


LOBES = {
    "coats": {"coats": (Coat(),)},
    "anisotropy": {"anisotropy": Anisotropy(strength=0.6)},
    "sheen": {"sheen": Sheen(color=(0.5, 0.5, 0.6), roughness=0.4)},
    "iridescence": {"iridescence": Iridescence()},
}


@pytest.mark.slow
@pytest.mark.parametrize("names", [some for count in range(1, 5) for some in combinations(LOBES, count)], ids="-".join)
def test_a_floor_under_a_sky_is_lit_beside_any_materials(device, names):
    """Each combination is another program. A card's driver compiled some wrongly: the floor was black."""
    things = [
        placed(sphere(0.2, Material(roughness=0.4, metallic=0.0, **LOBES[name])), move(0.5 * number - 0.75, 0.2, 0))
        for number, name in enumerate(names)
    ]
    floor = placed(plane(10, 10, lambert(0.5)))
    scene = scene_of(floor, *things, environment=Environment(np.full((2, 4, 3), 0.7, np.float32)))
    with pica.Renderer(scene, size=SIZE, settings=settings(), device=device) as renderer:
        lit = renderer.render(4, camera=VIEW).aov("diffuse_direct")[-8:].mean()
    assert lit == pytest.approx(0.35, rel=0.05)
