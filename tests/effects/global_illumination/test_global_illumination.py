"""Diffuse global illumination against many paths, and how it follows what changes."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import pica
from benchmarks import motion_scenes
from pica.quality.effects import MeasuredEffect
from pica.quality.sequences import sequence
from pica.scene.light import DirectionalLight, RectangleLight
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import checkered, lambert, placed, scene_of, settings, shining, uniform

SIZE = (96, 64)
ON = {"global_illumination.mode": "path_traced"}
SURFELS = {"global_illumination.mode": "surfels", "global_illumination.surfels": "20000"}


def reflected(frame):
    return frame.aov("diffuse_indirect")


def direct_and_indirect(device, scene, frames, values=ON):
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    return renderer, renderer.render(frames)


@pytest.mark.parametrize(
    ("name", "values", "tolerance"),
    [
        ("cornell", ON, 0.02),
        ("court", ON, 0.02),
        # What lies out of sight is reflected no oftener than that.
        pytest.param("rooms", ON | {"global_illumination.bounces": "16"}, 0.02, marks=pytest.mark.slow),
        ("cornell", SURFELS, 0.05),
        ("court", SURFELS, 0.05),
    ],
)
def test_a_still_picture_is_that_of_many_paths(device, name, values, tolerance):
    """Light of a lamp made of triangles, of a sun, and of a lamp in another room."""
    renderer = pica.Renderer(getattr(pica.scenes, name)(), size=SIZE, settings=settings(values), device=device)
    camera = renderer.scene.default_camera(1.5)
    camera = replace(camera, transform=move(0.013, 0.007, 0) @ camera.transform)  # no pixel's centre is on an edge
    measured = MeasuredEffect(renderer, "global_illumination")
    for _ in range(96):
        renderer.advance(camera, jittered=False, capture=measured.offers)
    found, expected = measured.result()["diffuse_indirect"], measured.reference(256)["diffuse_indirect"]
    there = np.isfinite(expected)
    assert found[there].mean() == pytest.approx(expected[there].mean(), rel=tolerance)
    white = np.percentile(expected[there], 95)
    error = np.clip(found[there] / white, 0, 1) - np.clip(expected[there] / white, 0, 1)
    assert -10 * np.log10(np.mean(error**2)) > 25  # dB


@pytest.mark.parametrize("values", [ON, SURFELS])
def test_a_closed_door_keeps_the_light_out(device, values):
    """Also of who has just been in the lit room, whose surfels lie a few centimetres away: the mean of four seeds, as
    the order of threads decides which surfels there are."""
    scene, shares = pica.scenes.rooms(door=0.0), []
    beside = pica.Camera.look_at((-1.2, 1.5, 1.8), (-2.4, 1.0, -1.2), vertical_fov=np.radians(75))
    towards_the_door = pica.Camera.look_at((-1.2, 1.5, 1.8), (0.2, 1.0, -1.2), vertical_fov=np.radians(75))
    for seed in range(4):
        with pica.Renderer(scene, size=SIZE, settings=settings(values | {"seed": seed}), device=device) as renderer:
            lit = reflected(renderer.render(16, camera=beside)).mean()
            renderer.render(16, camera=towards_the_door)
            shares.append(reflected(renderer.render(16)).mean() / lit)
        assert lit > 0.1
    assert np.mean(shares) < 0.01


@pytest.mark.parametrize("mode", ["path_traced", "restir"])
def test_metal_fields_keep_no_light_from_matte_ones(device, mode):
    """On one plane. No path leaves what reflects nothing diffusely: that is not to say that no light arrives there."""
    fields = np.zeros((32, 32, 4), np.uint8) + np.uint8([0, 255, 0, 255])
    fields[..., 2] = np.where(checkered().pixels[..., 0] > 200, 255, 0)
    texture = Texture(Image(fields, "metal fields"), Sampler(linear=False))
    floor = Material(base_color=(0.6, 0.6, 0.6, 1), metallic=1.0, roughness=1.0, metallic_roughness_texture=texture)
    scene = scene_of(
        placed(plane(4, 4, floor)),
        placed(plane(4, 3, lambert(0.8)), move(0, 1.5, -2) @ rotate("x", 90)),
        shining(RectangleLight(radiance=20.0, width=0.8, height=0.5), move(0, 1, -1)),
    )
    values = {"global_illumination.mode": mode, "global_illumination.bounces": "1"}
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    camera = pica.Camera.look_at((0, 1.8, 2.6), (0, 0.2, -0.5), vertical_fov=np.radians(50))
    measured = MeasuredEffect(renderer, "global_illumination")
    for _ in range(48):
        renderer.advance(camera, jittered=False, capture=measured.offers)
    found, expected = (light["diffuse_indirect"][34:] for light in (measured.result(), measured.reference(96)))
    there = np.isfinite(expected)
    assert found[there].mean() == pytest.approx(expected[there].mean(), rel=0.08)


def test_bounces_are_counted(device):
    """Each more is brighter than the one before, and by less."""
    means = []
    for bounces in range(1, 4):
        values = {**ON, "global_illumination.bounces": str(bounces)}
        means.append(reflected(direct_and_indirect(device, pica.scenes.cornell(), 12, values)[1]).mean())
    steps = np.diff(means)
    assert steps[0] > 0.15 * means[0] and 0 < steps[1] < 0.8 * steps[0]


@pytest.mark.parametrize(("values", "frames", "late"), [(ON, 20, 0.05), (SURFELS, 36, 0.1)])
def test_light_that_changes_is_followed(device, values, frames, late):
    """80 % of a step in so many frames, nearly all in 60, and no more than a tenth too much."""
    scene = pica.scenes.rooms()
    lamp = next(node for node in scene.nodes() if node.light)
    renderer, before = direct_and_indirect(device, scene, 48, values)
    lamp.light = RectangleLight(radiance=60.0, width=0.8, height=0.8)
    after = [reflected(renderer.render(1)).mean() for _ in range(60)]
    share = (np.array(after) / reflected(before).mean() - 1) / 2
    assert share[frames - 1] > 0.8 and share[59] == pytest.approx(1, abs=late) and share.max() < 1.1


def test_light_that_few_rays_find_has_no_patches_in_motion(device):
    """A room that the sun lights through its door, the camera turning: pictures of other noise are nearly alike."""
    size, light = (128, 72), []
    scene = motion_scenes.door()
    camera = sequence("orbit", scene, scene.default_camera(size[0] / size[1]), speed=1.0)
    for seed in (1, 2):
        renderer = pica.Renderer(scene, size=size, settings=pica.Settings(seed=seed), device=device)
        for number in range(39):
            renderer.render(1, camera=camera(number), aovs=())
        light.append(reflected(renderer.render(1, camera=camera(39), aovs=["diffuse_indirect"])).mean(-1))
    apart = np.abs(light[0] - light[1]) / (light[0] + light[1])
    assert np.median(apart) < 0.028 and apart.mean() < 0.043


@pytest.mark.parametrize(("values", "tolerance", "noise"), [(ON, 0.05, 0.25), (SURFELS, 0.1, 0.35)])
def test_the_first_frame_has_its_light(device, values, tolerance, noise):
    _, first = direct_and_indirect(device, pica.scenes.cornell(), 1, values)
    _, later = direct_and_indirect(device, pica.scenes.cornell(), 48, values)
    assert reflected(first).mean() == pytest.approx(reflected(later).mean(), rel=tolerance)
    # And what its filter leaves is no noise to speak of: neighbours are alike where the light is.
    inside = np.s_[20:44, 30:66]
    assert np.abs(reflected(first) - reflected(later))[inside].mean() < noise * reflected(later)[inside].mean()


def test_what_is_thinner_than_two_pixels_has_the_light_of_surfels(device):
    """Though surfels are asked for every second pixel only."""
    scene = pica.scenes.cornell()
    wire = box((0.03, 0.7, 0.03), lambert(0.8))
    wire = box((0.03, 1.2, 0.03), lambert(0.8))
    wires = [placed(wire, move(0.11 * i - 0.6, 0.9, 0.2 * (i % 3)), f"wire {i}") for i in range(12)]
    for node in wires:
        scene.add(node)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(SURFELS), device=device)
    camera = scene.default_camera(1.5)
    measured = MeasuredEffect(renderer, "global_illumination")
    for _ in range(24):
        seen = renderer.advance(camera, jittered=False, capture=measured.offers)["visibility"]
    numbers = [[node.name for node in scene.nodes()].index(node.name) + 1 for node in wires]
    thin = np.isin(seen.to_numpy()[..., 0], numbers)
    assert thin.sum() > 100
    found, expected = measured.result()["diffuse_indirect"][thin], measured.reference(256)["diffuse_indirect"][thin]
    assert found.mean() == pytest.approx(expected.mean(), rel=0.1) and (found.mean(-1) > 0.2 * expected.mean(-1)).all()


def test_surfels_of_a_scene_at_rest_are_quiet(device):
    """Once nothing has changed for long; and a lamp that changes then is followed as ever."""
    scene = pica.scenes.rooms()
    lamp = next(node for node in scene.nodes() if node.light)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(SURFELS), device=device)
    camera = scene.default_camera(1.5)

    def following():
        renderer.advance(camera, jittered=False, capture=("diffuse_indirect",))
        return renderer.captured["diffuse_indirect"]()

    means = [following() for _ in range(140)][-1]
    later = following()
    assert np.abs(later - means).mean() < 0.004 * later.mean()
    lamp.light = RectangleLight(radiance=60.0, width=0.8, height=0.8)
    after = [following().mean() for _ in range(60)]
    assert after[35] > 0.8 * 3 * later.mean() and after[-1] == pytest.approx(3 * later.mean(), rel=0.1)


def test_surfels_ride_what_moves(device):
    """What has moved keeps its surfels, and so its light, in the very next frame; what is gone gives them back."""
    scene = pica.scenes.court()
    renderer, before = direct_and_indirect(device, scene, 24, SURFELS)
    ball = next(node for node in scene.nodes() if node.name == "ball 3")
    coverage = "debug.global_illumination.coverage"
    renderer.debug = True
    ball.transform = move(0.4, 0, 0) @ ball.transform
    after = renderer.render(1)
    number = [node.name for node in scene.nodes()].index("ball 3") + 1
    there = after.aov("instance") == number
    assert there.sum() > 20 and after.aov(coverage)[there].mean() > 0.5
    was = before.aov("instance") == number
    assert reflected(after)[there].mean() == pytest.approx(reflected(before)[was].mean(), rel=0.3)


_RAILS = """
import numpy as np, pica
from pica.scenes.basic_meshes import cylinder
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, settings, uniform

rails = [placed(cylinder(0.025, 40, lambert()), move(x, 1, -14) @ rotate("x", 90)) for x in np.arange(-3.4, -1.4, 0.1)]
scene = scene_of(*rails, environment=uniform(1, 1, 1))
camera = pica.Camera.look_at((-1.2, 1.5, 3.5), (-1.8, 1, -6), vertical_fov=np.radians(45))
with pica.Renderer(scene, size=(96, 64), settings=settings({"global_illumination.mode": "surfels"})) as renderer:
    renderer.debug = True
    seen = renderer.render(16, camera=camera)
print((seen.aov("debug.global_illumination.discs") > 0).sum() / (seen.aov("instance") > 0).sum())
"""


def test_surfels_lie_on_long_thin_triangles(device):
    """By itself, since a surfel that was infinitely far away would be put into cells for ever."""
    run = subprocess.run([sys.executable, "-c", _RAILS], capture_output=True, text=True, timeout=300)
    assert float(run.stdout) > 0.9, run.stderr


def test_the_pool_of_surfels_never_runs_over(device):
    """A camera that looks elsewhere all the time, and room for few."""
    values = {**SURFELS, "global_illumination.surfels": "1000"}
    renderer = pica.Renderer(pica.scenes.court(), size=SIZE, settings=settings(values), device=device)
    for frame in range(40):
        angle = frame * 0.7
        target = (np.cos(angle), 1.2, np.sin(angle))
        camera = pica.Camera.look_at((0, 1.5, 0), target, vertical_fov=np.radians(70))
        assert renderer.count_rays(camera)["surfel_rays"] <= 1024
        picture = renderer.render(1, camera=camera)
        assert np.isfinite(picture.color).all()
    assert reflected(picture).mean() > 0.05


def test_surfels_lie_evenly(device):
    """Coverage's deviation is small beside its mean."""
    renderer = pica.Renderer(pica.scenes.cornell(), size=SIZE, settings=settings(SURFELS), device=device)
    renderer.render(63)
    renderer.debug = True
    picture = renderer.render(1)
    coverage = picture.aov("debug.global_illumination.coverage")[picture.aov("instance") > 0]
    assert coverage.mean() > 1 and coverage.std() / coverage.mean() < 0.3
    renderer.advance(renderer.scene.default_camera(SIZE[0] / SIZE[1]), capture=("count.surfels",))
    assert 0 < renderer.captured["count.surfels"]() < 20_000


def test_what_is_known_of_surfels_can_be_seen(device):
    renderer = pica.Renderer(pica.scenes.court(), size=SIZE, settings=settings(SURFELS), device=device)
    renderer.render(8)
    assert not any(recipe.module.endswith("surfel_debug.slang") for recipe in device.planned)  # nobody asked for it
    renderer.debug = True
    picture = renderer.render(1)
    view = {
        name: picture.aov(f"debug.global_illumination.{name}") for name in ("discs", "age", "samples", "rays", "cells")
    }
    covered = view["discs"] > 0
    assert covered.sum() > 0.9 * (picture.aov("instance") > 0).sum()
    ages = view["age"][covered]
    assert ages.min() >= 1 and ages.max() == 9 and not view["age"][~covered].any()
    # 16 in a surfel's first frame, then 8, then at least one.
    older = covered & (view["age"] > 1)
    assert (view["samples"][older] >= 24).all() and (view["rays"][covered] >= 1).all()
    # A surfel's pixels lie together: it is no larger than its disc. Cells are larger, and of more than one level.
    for number in np.unique(view["discs"][covered])[:20]:
        rows, columns = np.nonzero(view["discs"] == number)
        assert np.ptp(rows) < SIZE[1] / 3 and np.ptp(columns) < SIZE[0] / 3
    colors = np.unique(view["cells"][covered], axis=0)
    assert 4 < len(colors) < len(np.unique(view["discs"]))
    hues = colors / colors.max(1, keepdims=True)
    assert len(np.unique(np.round(hues, 2), axis=0)) >= 2


def test_a_round_surface_shows_no_triangles(device):
    """Below the middle of a ball over a sunlit floor: filtered each by itself, triangles are off by 3 %."""
    camera = pica.Camera.look_at((0, 0.4, 3.6), (0, 1, 0), vertical_fov=np.radians(34))
    sun = shining(DirectionalLight(illuminance=10.0), aim((0, 5, 0.1), (0, 0, 0)))

    def underside(segments):
        ball = placed(sphere(1, lambert(0.8), segments), move(0, 1.2, 0))
        scene = scene_of(ball, placed(plane(20, 20, lambert(0.8))), sun)
        renderer = pica.Renderer(scene, size=SIZE, settings=settings(ON), device=device)
        frame = renderer.render(16, camera=camera)
        height, facing = frame.aov("position")[..., 1], frame.aov("normal")[..., 2]
        return reflected(frame).mean(-1), (height > 0.25) & (height < 1.2) & (facing > 0.5)

    (coarse, there), (fine, _) = underside(16), underside(128)
    assert np.abs(coarse - fine)[there].mean() < 0.02 * fine[there].mean()


def test_unlit_surfaces_light_others(device):
    """What they show is light that no light sample has."""
    unlit = Material(base_color=(0.9, 0.3, 0.1, 1), unlit=True)
    scene = scene_of(placed(plane(4, 4, lambert(0.8, 0.8, 0.8))), placed(box(0.5, unlit), move(0, 0.6, 0)))
    camera = pica.Camera.look_at((0, 3, 3), (0, 0, 0), vertical_fov=np.radians(60))
    plain = settings(ON | {"debug.filters": "false"})
    frame = pica.Renderer(scene, size=SIZE, settings=plain, device=device).render(64, camera=camera)
    expected = pica.PathTracer(scene, size=SIZE, device=device).render(128, camera=camera).color
    floor = frame.aov("normal")[..., 1] > 0.99
    floor &= frame.aov("position")[..., 1] < 0.01
    np.testing.assert_allclose(frame.color[floor].mean(0), expected[floor].mean(0), rtol=0.04)


def test_metal_has_no_irradiance_for_others_to_read(device):
    """Its pixels have no rays. What the filters of a moving picture bring there is of other surfaces."""
    metal = Material(base_color=(0.9, 0.9, 0.9, 1.0), metallic=1.0, roughness=0.6)
    ball = placed(sphere(0.6, metal), move(0, 0.6, 0), "ball")
    scene = scene_of(placed(plane(6, 6, lambert(0.7))), ball, environment=uniform(1, 1, 1))
    coverage = "debug.global_illumination.coverage"
    with pica.Renderer(scene, size=SIZE, settings=settings(ON), device=device) as renderer:
        renderer.debug = True
        for step in range(6):
            eye = (0.15 * step - 0.5, 1.2, 3)
            camera = pica.Camera.look_at(eye, (0, 0.5, 0), vertical_fov=np.radians(40))
            frame = renderer.render(1, camera=camera)
    on_ball = frame.aov("instance") == [node.name for node in scene.nodes()].index("ball") + 1
    assert on_ball.any() and not frame.aov(coverage)[on_ball].any()
    assert (frame.aov(coverage)[(frame.aov("instance") > 0) & ~on_ball] > 0).mean() > 0.99
