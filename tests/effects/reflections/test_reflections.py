"""Reflections against the path tracer, each light path counted once, and what their filters leave."""

import numpy as np
import pytest
import slangpy as spy
from scipy import ndimage

import pica
from benchmarks import motion_scenes
from pica.color import luminance
from pica.quality.effects import MeasuredEffect, compare_effect
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scene.environment import Environment
from pica.scene.light import PointLight
from pica.scene.material import Material, Texture
from pica.scene.orbit import orbited, pivot
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import converged, held, lambert, left_in, placed, scene_of, settings, shining, sky, trace, uniform
from tests.effects.reflections.scenes import SCENES, VIEW, metal, striped_floor, under_clouds

SIZE = (64, 48)
UNFILTERED = {
    "reflections.mode": "ray_traced",
    "reflections.bounces": "1",
    "global_illumination.mode": "path_traced",
    "global_illumination.bounces": "1",
    "debug.filters": "false",
    "shadows.denoiser": "off",
    "transparency.map_size": "64",  # of pictures with few pixels
}
POLISHED = "lamps over a polished floor"
SHAPES = {"reflections.area_lights": "true"}
CONTACT = Camera.look_at((0, 1.2, 3), (0, 0.5, 0), vertical_fov=0.6)
LONGER = {"global_illumination.bounces": "2", "reflections.bounces": "2"}


@pytest.mark.parametrize(
    ("name", "values", "edges"),
    [
        *((name, {}, 3) for name in SCENES),
        ("glossy room", SHAPES, 3),
        ("lamps", SHAPES, 3),
        ("cornell", LONGER, 4),
        ("glossy room", LONGER, 4),
    ],
)
def test_every_path_counts_once(device, name, values, edges):
    """The owners' light adds up to the path tracer's on paths of so many edges (docs/how-it-works/light-paths.md)."""
    scene, camera = SCENES[name]()
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(UNFILTERED | values), device=device)
    frame = renderer.render(192, camera=camera)
    expected = converged(device, scene, 256, camera, SIZE, max_depth=edges)
    assert frame.color.mean() == pytest.approx(expected.mean(), rel=0.01)
    through = np.abs(frame.aov("transmission")).max(-1) > 0.01
    assert through.any() == (name == "transmissive")
    if through.any():
        assert frame.color[through].mean() == pytest.approx(expected[through].mean(), rel=0.03)
    shares = {
        effect: frame.aov(effect).mean() / expected.mean() for effect in ("reflections", "diffuse_indirect")
    }  # of one frame
    assert shares["reflections"] > 0.1 or name == "cornell", "reflections are a part worth counting"
    assert shares["diffuse_indirect"] > 0.03 or name in ("furnace", POLISHED), "so is indirect light"


def test_small_suns_in_rough_metal_are_no_rare_find(device):
    """Rays of a wide lobe rarely hit them: light samples bring them. Before, the deviation was 1.4 times the mean."""
    scene = scene_of(placed(sphere(0.6, metal(0.45)), move(0, 0.6, 0)), environment=sky())
    with pica.Renderer(scene, size=SIZE, settings=settings(UNFILTERED), device=device) as renderer:
        frames = np.array([renderer.render(1, camera=VIEW).color.mean(-1) for _ in range(24)])
        seen = renderer.render(1, camera=VIEW).aov("instance") > 0
    assert np.sqrt(frames.var(0)[seen].mean()) < 0.4 * frames.mean(0)[seen].mean()


@pytest.mark.parametrize("roughness", [0.05, 0.2, 0.4])
def test_metal_whose_normals_mirror_what_is_below_it_is_bright(device, roughness):
    """Without bending them: 0, .21 and .75 path traced; in the frame 1, as samples below the surface were left out."""
    tilted = np.float32([0, np.sin(np.radians(15)), np.cos(np.radians(15))])  # from 20 degrees above: mirrors -10
    material = metal(roughness, 1, 1, 1)
    material.normal_texture = Texture.from_array(np.tile((tilted + 1) / 2, (4, 4, 1)), encoding="linear")
    scene = scene_of(placed(plane(10, 10, material)), environment=uniform(1, 1, 1))
    low = Camera.look_at((0, 4 * np.tan(np.radians(20)), 4), (0, 0, 0), vertical_fov=0.1)
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        light = renderer.render(16, camera=low).color.mean()
    expected = converged(device, scene, 64, low, SIZE).mean()
    assert expected > 0.7
    assert light == pytest.approx(expected, rel=0.04)


def test_metal_below_a_sharp_coat_is_smooth(device):
    """Neighbours' rays serve the wide lobe of the metal. With one mean for both lobes: .34."""
    cells = np.random.default_rng(3).choice([0.05, 0.3, 3.0], (8, 16, 1), p=[0.5, 0.35, 0.15])
    patches = Environment(np.float32(np.kron(cells, np.ones((4, 4, 3)))))
    lacquered = Material(base_color=(0.8, 0.6, 0.5, 1), metallic=1.0, roughness=0.6, coats=(Coat(),))
    scene = scene_of(placed(sphere(0.6, lacquered, 64), move(0, 0.6, 0)), environment=patches)
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        frame = renderer.render(48, camera=VIEW)
    expected = converged(device, scene, 256, VIEW, SIZE)
    inside = ndimage.binary_erosion(frame.aov("instance") > 0, iterations=2)
    light, truth = frame.color[inside], expected[inside]
    assert np.sqrt((((light - truth) / truth) ** 2).mean()) < 0.2
    assert light.mean() == pytest.approx(truth.mean(), rel=0.045)


def test_glossy_metal_on_a_floor_mirrors_the_floor_below_it(device):
    """Rays of the pixels above meet it further off, and the sky: with weights by lobes alone the contact was 1.7."""
    floor = Material(base_color=(0, 0, 0, 1), metallic=0.0, roughness=1.0, specular=0.0, emission=(0.03,) * 3)
    up = np.linspace(1, -1, 32)[:, None, None] > 0
    scene = scene_of(
        placed(plane(20, 20, floor)),
        placed(box((3, 3, 0.1), metal(0.3)), move(0, 1.5, 0)),
        environment=Environment(np.float32(np.where(up, 1.0, 0.05) * np.ones((32, 64, 3)))),
    )
    means = []
    for filters in ("true", "false"):
        frames, renderer = rebuilt_frames(device, scene, CONTACT, (80, 45), 24, {"debug.filters": filters})
        with renderer:
            frame = renderer.render(1, camera=CONTACT)
            means.append(frames[:, (frame.aov("instance") > 1) & (frame.aov("position")[..., 1] < 0.25)].mean())
    assert means[0] < 1.45 * means[1]


def test_a_polished_floor_is_dark_before_what_hides_a_lamp(device):
    """Rays of pixels nearer to the camera meet the lamp above the wall: the dark rows had 1 % of its light."""
    wall = placed(box((6, 0.25, 0.3), lambert(0)), move(0, 0.125, -0.6))
    lamp = placed(box((6, 2, 0.1), lambert(0, emission=(20.0, 18.0, 15.0))), move(0, 1.4, -4))
    camera = Camera.look_at((0, 1.0, 3.0), (0, 0.2, -0.6), vertical_fov=np.radians(30))
    scene = scene_of(placed(plane(12, 12, metal(0.14))), wall, lamp)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({"reflections.mode": "ray_traced"}), device=device)
    measured = MeasuredEffect(renderer, "reflections")
    frames = []
    for _ in range(16):
        renderer.advance(camera, jittered=False, capture=measured.offers)
        frames.append(np.nan_to_num(measured.result()["reflections"]).mean((1, 2)))
    rows, truth = np.mean(frames[8:], 0), np.nan_to_num(measured.reference(512)["reflections"]).mean((1, 2))
    below = len(rows) // 2 + 3
    hidden = below + np.flatnonzero(truth[below:] < 0.01 * truth.max())
    mirrored = below + np.flatnonzero(truth[below:] > 0.9 * truth.max())
    assert rows[hidden].mean() < 0.004 * truth.max()
    assert rows[mirrored].mean() == pytest.approx(truth[mirrored].mean(), rel=0.09)


def rebuilt_frames(device, scene, camera, size, count, values):
    """(count, height, width) what each frame's rays alone tell, and a renderer."""
    renderer = pica.Renderer(
        scene, size=size, settings=settings({"reflections.mode": "ray_traced", **values}), device=device
    )
    renderer.debug = True
    frames = [renderer.render(1, camera=camera).aov("debug.reflections.reconstructed").mean(-1) for _ in range(count)]
    return np.array(frames), renderer


def test_rough_surfaces_take_the_paths_of_diffuse_light(device):
    """The same light as by rays of their own, which `restir` leaves them, and no ray."""
    plastic = Material(base_color=(0.7, 0.5, 0.3, 1), metallic=0.0, roughness=0.8)
    scene = scene_of(
        placed(plane(4, 4, plastic)),
        placed(plane(4, 3, plastic), move(0, 1.5, -1) @ rotate("x", 90)),
        placed(sphere(0.5, plastic), move(0, 0.5, -0.2)),
        shining(PointLight(intensity=5.0), move(1, 1.6, 0.5)),
    )
    lights, rays = {}, {}
    for mode in ("path_traced", "restir"):
        values = pica.Settings().with_values(UNFILTERED | {"global_illumination.mode": mode})
        with pica.Renderer(scene, size=SIZE, settings=values, device=device) as renderer:
            frames = [renderer.render(1, camera=VIEW, aovs=["reflections"]) for _ in range(128)]
            lights[mode] = np.mean([frame.aov("reflections") for frame in frames], 0)
            rays[mode] = renderer.count_rays(VIEW)["reflection_rays"]
    assert rays["path_traced"] == 0 and rays["restir"] > 500
    blocks = {mode: light.reshape(4, 12, 4, 16, 3).mean((1, 3, 4)) for mode, light in lights.items()}
    lit = blocks["restir"] > 0.2 * blocks["restir"].max()
    np.testing.assert_allclose(blocks["path_traced"][lit], blocks["restir"][lit], rtol=0.12)
    np.testing.assert_allclose(lights["path_traced"].mean(), lights["restir"].mean(), rtol=0.03)


def test_neighbours_rays_cut_the_variance(device):
    """RTG 25, 25.2.2: as 16 rays a pixel would. Here alpha is 0.3, on a flat and on a curved surface."""
    scene, _ = under_clouds(0.3**0.5)
    camera, size, count = Camera.look_at((0, 1.3, 1.9), (0, 0.5, 0), vertical_fov=np.radians(60)), (160, 120), 32
    rebuilt, renderer = rebuilt_frames(device, scene, camera, size, count, {})
    rays, _ = rebuilt_frames(device, scene, camera, size, count, {"debug.filters": "false"})
    # Of four pixels one has the ray's light, four times of it: which one, frame/half.slang tells.
    turns = np.arange(count) + np.arange(count) // 4
    own = [rays[turn, t & 1 :: 2, (t ^ t >> 1) & 1 :: 2] / 4 for turn, t in enumerate(turns)]
    seen = renderer.render(1, camera=camera).aov("instance")
    for number in np.unique(seen[seen > 0]):
        inside = fours(seen == number).min((1, 3)) > 0
        of_pixels = fours(rebuilt.var(0)).mean((1, 3))[inside].mean()
        assert inside.sum() > 500 and np.var(own, axis=0)[inside].mean() > 12 * of_pixels


def fours(picture):
    """(height / 2, 2, width / 2, 2): the pixels that share a ray."""
    height, width = picture.shape
    return picture.reshape(height // 2, 2, width // 2, 2)


def mirrored_board():
    """A mirror for a floor, and far behind it a board that shines in stripes."""
    light = lambert(0, emission=(4.0, 4.0, 4.0))
    stripes = [placed(box((0.25, 2, 0.1), light), move(x, 1.2, -4)) for x in np.arange(-3, 3.1, 0.5)]
    return scene_of(placed(plane(12, 12, metal(0.02))), *stripes, environment=uniform(0.2, 0.2, 0.2))


def ball_before_stripes():
    """A mirror that bulges, and behind the camera stripes that shine."""
    light = lambert(0, emission=(4.0, 4.0, 4.0))
    stripes = [placed(box((0.25, 4, 0.1), light), move(x, 1, 6)) for x in range(-6, 7)]
    return scene_of(placed(sphere(4.0, metal(0.05)), move(0, 1, -4)), *stripes, environment=uniform(0.2, 0.2, 0.2))


FLAT = mirrored_board, Camera.look_at((0, 0.8, 3), (0, 0.2, 0), vertical_fov=np.radians(50))
CURVED = ball_before_stripes, Camera.look_at((0, 1.2, 4), (0, 1, 0), vertical_fov=np.radians(32))


@pytest.mark.parametrize(("scene", "camera"), [FLAT, CURVED], ids=["flat", "curved"])
def test_what_a_mirror_shows_moves_with_its_image(device, scene, camera):
    """Its history is found where the image of the mirrored point was, not where the mirror was."""
    errors = []
    for follows in (True, False):
        shown, values = scene(), {"reflections.mode": "ray_traced", "reflections.rays": "quarter"}
        renderer = pica.Renderer(shown, size=SIZE, settings=settings(values), device=device)
        center = pivot(shown, camera)

        def orbit(frame, center=center):
            return orbited(camera, center, np.radians(0.25 * frame))

        if not follows:
            accumulate = renderer._stages.reflections._accumulate
            blank = device.texture("nowhere", spy.Format.rg32_float, SIZE)
            blank.copy_from_numpy(np.zeros_like(blank.to_numpy()))

            def without_distances(*arguments, accumulate=accumulate, blank=blank, **values):
                return accumulate(*arguments, **(values | {"distances": blank}))

            without_distances.blocks = accumulate.blocks
            renderer._stages.reflections._accumulate = without_distances  # before the frame is declared
        errors.append(np.mean(compare_effect(renderer, "reflections", orbit, 10, 32).psnr[4:]))
    assert errors[0] > errors[1] + 1.5


def test_rays_of_their_own_keep_a_curved_mirror_sharp_in_motion(device):
    """Neighbours mirror other things, and so does the past of a pixel."""
    light = lambert(0, emission=(4.0, 4.0, 4.0))
    stripes = [placed(box((0.5, 4, 0.1), light), move(x, 1, 6)) for x in range(-6, 7, 2)]
    ball = placed(sphere(1.0, metal(0.05)), move(0, 1, 0))
    scene = scene_of(ball, *stripes, environment=uniform(0.2, 0.2, 0.2))
    camera = Camera.look_at((0, 1, 4), (0, 1, 0), vertical_fov=np.radians(30))
    errors, counts = {}, {}
    for rays in ("quarter", "adaptive"):
        chosen = settings({"reflections.mode": "ray_traced", "reflections.rays": rays})
        renderer = pica.Renderer(scene, size=(96, 54), settings=chosen, device=device)

        measured = MeasuredEffect(renderer, "reflections")
        for frame in range(12):
            moved = orbited(camera, (0, 1, 0), np.radians(2 * frame))
            renderer.advance(moved, jittered=False, capture=measured.offers)
        found, truth = measured.result()["reflections"], measured.reference(64)["reflections"]
        errors[rays] = np.nanmean(np.abs(found - truth)[18:36, 30:66])  # not the outline
        counts[rays] = renderer.count_rays(moved)["reflection_rays"]
    assert errors["adaptive"] < 0.7 * errors["quarter"], errors
    assert 3 * counts["quarter"] < counts["adaptive"] < 5 * counts["quarter"]


def test_mirrors_in_mirrors_are_not_black(device):
    """Where a path of `reflections.bounces` ends on metal, it takes what reaches the metal there."""
    size, room = (48, 27), motion_scenes.metal()
    with pica.Renderer(room, size=size, device=device) as renderer:
        color = renderer.render(24).color
    with pica.PathTracer(room, size=size, device=device) as tracer:
        expected = tracer.render(256).color
    dark = (luminance(color) < 0.3 * luminance(expected)).mean()
    assert dark < 0.006
    assert color.mean() == pytest.approx(expected.mean(), rel=0.08)


def test_mirrors_in_mirrors_are_not_black_in_the_first_frame(device):
    """Where the cache knows no light yet, paths of more than `reflections.bounces` surfaces go on."""
    board = placed(plane(4, 4, metal(0.0)))
    wall = placed(plane(4, 4, metal(0.0)), move(0, 2, -2) @ rotate("x", 90))
    other = placed(plane(4, 4, metal(0.0)), move(0, 2, 2) @ rotate("x", -90))
    scene = scene_of(board, wall, other, environment=uniform(1, 1, 1))
    camera = Camera.look_at((0.3, 1.2, 1.9), (0, 1.0, -2), vertical_fov=np.radians(50))
    with pica.Renderer(scene, size=(48, 27), device=device) as renderer:
        color = luminance(renderer.render(1, camera=camera).color)
    assert (color < 0.2).mean() < 0.023  # .019 to .022 by seed


def test_views_show_where_the_past_was_looked_for(device):
    """What a mirror shows moves otherwise than the mirror, and stays where both stand still."""
    renderer = pica.Renderer(
        mirrored_board(), size=SIZE, settings=settings({"reflections.mode": "ray_traced"}), device=device
    )
    renderer.debug = True
    assert not renderer.render(1, camera=FLAT[1]).aov("debug.reflections.of_image").any(), "nothing was before"
    apart = []
    for aside in (0.1, 0.2, 0.2):
        frame = renderer.render(1, camera=Camera.look_at((aside, 0.8, 3), (aside, 0.2, 0), vertical_fov=np.radians(50)))
        floor = frame.aov("metallic") > 0.5
        places = [frame.aov(f"debug.reflections.{name}")[floor] for name in ("of_surface", "of_image")]
        apart.append(np.abs(places[0] - places[1]).mean() / places[0].mean())
    assert apart[1] > 0.1 and apart[2] < 1e-4, apart
    share, kernel = (frame.aov(f"debug.reflections.{name}") for name in ("image_share", "kernel"))
    assert share.min() >= 0 and share.max() <= 1 and np.median(share[floor]) == pytest.approx(0.5, abs=1e-3), (
        "both tell the same"
    )
    assert kernel[floor].mean() > 0 and kernel.max() <= 8


@pytest.mark.parametrize(("error", "least", "most"), [(300, 1, 2), (10, 150, 310)], ids=["one ray", "all rays"])
def test_what_one_ray_alone_finds_leaves_no_blotch(device, error, least, most):
    """A frame 300 times as bright as those before: noise, where its rays differ as much, and else another light."""
    scene, _ = under_clouds(0.7)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({"reflections.mode": "ray_traced"}), device=device)
    effect = renderer._stages.reflections
    accumulate = effect._accumulate
    frames = {}
    for light, deviation in ((1, 0.3), (300, error)):
        frames[light] = device.texture(f"light {light}", spy.Format.rgba32_float, SIZE)
        found = np.full_like(frames[light].to_numpy(), light)
        found[..., 3] = deviation**2
        frames[light].copy_from_numpy(found)
    shown = [1] * 12 + [300] + [1] * (error == 300)

    def given(frame, threads, /, **values):
        return accumulate(frame, threads, **(values | {"reconstructed": frames[shown[frame.index]]}))

    given.blocks = accumulate.blocks
    effect._accumulate = given  # before the frame is declared
    for number in range(len(shown)):
        aside = 0.002 * number
        renderer.advance(Camera.look_at((aside, 1, 2.5), (aside, 0.3, 0), vertical_fov=np.radians(40)), jittered=False)
    history = held(renderer, "reflections", "history history").to_numpy().reshape(SIZE[1], SIZE[0], 4)
    assert least <= np.median(history[history[..., 3] > 0][:, 0]) < most


def test_off_traces_nothing_and_leaves_what_shines_to_the_samples(device):
    scene, camera = under_clouds(0.3)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({"debug.filters": "false"}), device=device)
    assert "reflections" not in [effect.name for effect in renderer.effects]
    found = renderer.render(96, camera=camera).color
    expected = trace(device, scene, 96, camera, SIZE, 2).color
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)


@pytest.mark.parametrize("way", ["sampled", "prefiltered"])
def test_what_mirrors_show_is_lit_by_the_environment(device, way):
    """However that lights what the camera sees: a mirror before a matt wall under a white sky."""
    mirror = placed(plane(3, 3, metal(0.1)), move(0, 1, -1) @ rotate("x", 90))
    scene = scene_of(mirror, placed(box((3, 2, 0.2), lambert(0.8)), move(0, 1, 2)), environment=uniform(1, 0.8, 0.6))
    values = {"reflections.mode": "ray_traced", "lighting.environment": way, "global_illumination.mode": "off"}
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    measured = MeasuredEffect(renderer, "reflections")
    camera = Camera.look_at((0, 1, 0.5), (0, 1, -1), vertical_fov=np.radians(40))
    for _ in range(16):
        renderer.advance(camera, jittered=False, capture=measured.offers)
    found, truth = measured.result()["reflections"], measured.reference(256)["reflections"]
    assert np.nanmean(truth) > 0.1
    assert np.nanmean(found, (0, 1)) == pytest.approx(np.nanmean(truth, (0, 1)), rel=0.05)


def test_an_environment_that_is_off_is_not_mirrored(device):
    scene, camera = under_clouds(0.2)
    values = {"reflections.mode": "ray_traced", "lighting.environment": "off"}
    frame = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device).render(1, camera=camera)
    assert frame.color[frame.aov("instance") > 0].max() == 0


@pytest.mark.parametrize(("alpha", "bias", "error"), [(0.05, 0.03, 0.07), (0.15, 0.1, 0.112)])
def test_mirror_rays_draw_a_glossy_floor(device, alpha, bias, error):
    """RTG 19, 19.3.2.2: a lobe from rays of perfect mirrors, in one frame. Of a wide one much is beyond the edge."""
    scene, camera = striped_floor(alpha)
    errors = {}
    for way in ("ratio_estimator", "mirror_rays"):
        values = {"reflections.mode": "ray_traced", "reflections.reconstruction": way}
        renderer = pica.Renderer(scene, size=(96, 72), settings=settings(values), device=device)
        measured = MeasuredEffect(renderer, "reflections")
        hits = left_in(renderer, "reflections", "hit position and pdf")
        renderer.advance(camera, jittered=False, capture=lambda: {*measured.offers(), *hits()})  # noqa: B023
        found = np.nan_to_num(measured.result()["reflections"])
        densities = renderer.captured["test.hit position and pdf"]()[..., 3]
        assert (densities < 0).any() == (way == "mirror_rays"), "mirror rays have none"
        # Mirror rays bring all light of what shines, others share it with light samples.
        truth = np.nan_to_num(measured.reference(512)["reflections"])
        there = truth.max(-1) > 0
        errors[way] = np.abs(found - truth)[there].mean() / truth[there].mean()
    assert found[there].mean() == pytest.approx(truth[there].mean(), rel=bias)
    assert errors["mirror_rays"] < min(error, 1.05 * errors["ratio_estimator"])
