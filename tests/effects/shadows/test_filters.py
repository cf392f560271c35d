"""The two shadow filters against what many samples converge to."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, PointLight, RectangleLight, SphereLight
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import lambert, left_in, orthographic, placed, scene_of, settings, shining

SIZE = (96, 64)
VIEW = Camera.look_at((0.3, 2.6, 3.2), (0, 0.3, 0), vertical_fov=math.radians(40))
FROM = aim((1.5, 3.0, 2.0), (0, 0.3, 0))
FILTERS = ["svgf", "anisotropic"]
LIGHTS = {
    "sun": (DirectionalLight(illuminance=2.0, angular_diameter=math.radians(5)), FROM),
    "rectangle": (RectangleLight(radiance=5.0, width=1.0, height=1.0), FROM),
    "big rectangle": (RectangleLight(radiance=2.0, width=4.0, height=4.0), aim((2, 4, 3), (0, 0.3, 0))),
    "sphere": (SphereLight(radiance=8.0, radius=0.4), FROM),
}


def stage(*lights):
    grey = lambert(0.6)
    return scene_of(
        placed(plane(8, 8, grey)),
        placed(box(0.6, grey), move(0.4, 0.301, -0.3) @ rotate("y", 25), "box"),
        placed(sphere(0.3, grey), move(-0.6, 0.7, 0.2), "ball"),
        *lights,
    )


def renderer_of(device, scene, size=SIZE, **shadows):
    values = {f"shadows.{name}": str(value) for name, value in shadows.items()}
    renderer = pica.Renderer(scene, size=size, settings=settings(values), device=device)
    renderer.debug = True
    return renderer


def view(frame, name, slot=0):
    return frame.aov(f"debug.shadows.{name}")[..., slot]


@pytest.fixture(scope="module")
def truth(device):
    """By light: (height, width) visibility from 300 samples, and which pixels the light can reach."""
    kept = {}

    def make(name):
        if name not in kept:
            renderer = renderer_of(device, stage(shining(*LIGHTS[name])), history=1)
            weighted = 0
            for _ in range(300):
                renderer.advance(VIEW, capture=left_in(renderer, "shadows", "samples"))
                weighted = weighted + renderer.captured["test.samples"]()[0].astype(np.float64)
            kept[name] = weighted[..., 0] / np.maximum(weighted[..., 3], 1e-9), weighted[..., 3] > 300 * 0.05
        return kept[name]

    return make


def psnr(found, truth):
    expected, lit = truth
    return 10 * math.log10(1 / np.square(found - expected)[lit].mean())


@pytest.mark.parametrize("denoiser", FILTERS)
@pytest.mark.parametrize("name", LIGHTS)
def test_still_shadows_come_near_the_truth(device, truth, name, denoiser):
    frame = renderer_of(device, stage(shining(*LIGHTS[name])), denoiser=denoiser).render(24, camera=VIEW)
    raw, filtered = psnr(view(frame, "raw"), truth(name)), psnr(view(frame, "filtered"), truth(name))
    assert filtered > 27 and filtered > raw + 8, f"{raw:.1f} dB raw, {filtered:.1f} dB filtered"


def test_footprints_beat_variance_on_a_big_light_without_history(device, truth):
    lights = {name: stage(shining(*LIGHTS["big rectangle"])) for name in FILTERS}
    found = {
        name: psnr(view(renderer_of(device, scene, denoiser=name, history=1).render(1, camera=VIEW), "filtered"),
                   truth("big rectangle"))
        for name, scene in lights.items()
    }  # fmt: skip
    assert found["anisotropic"] > found["svgf"] + 2, found


@pytest.mark.parametrize("denoiser", FILTERS)
def test_penumbra_widens_with_the_distance_of_the_occluder(device, denoiser):
    """The shade of a board's edge under the sun is as wide as the sun's disk seen from the floor, times the height."""
    diameter = math.radians(12)
    widths = []
    for height in (0.3, 0.6, 0.9):
        board = placed(box((2.0, 0.01, 2.0), lambert()), move(-1, height, 0))
        sun = shining(DirectionalLight(illuminance=2.0, angular_diameter=diameter), rotate("x", -90))
        scene = scene_of(placed(plane(9, 9, lambert())), board, sun)
        camera = orthographic((0, 0.25, 0), (0, 0, 0), 0.5)
        frame = renderer_of(device, scene, (64, 32), denoiser=denoiser).render(48, camera=camera)
        row = view(frame, "filtered").mean(0)
        # Between 15 and 85 percent, where noise does not decide.
        crossings = np.interp([0.15, 0.85], np.maximum.accumulate(row), np.arange(64))
        widths.append((crossings[1] - crossings[0]) / 64)
        # Share of a disk beyond a line at x radii: 1/2 + (x sqrt(1 - x^2) + asin x) / pi; 85 % at x = 0.5665.
        assert widths[-1] == pytest.approx(2 * 0.5665 * height * math.tan(diameter / 2), rel=0.1), height
    assert widths[0] < widths[1] < widths[2]


@pytest.mark.parametrize("denoiser", FILTERS)
def test_the_shadow_of_what_moved_away_is_gone_within_eight_frames(device, denoiser):
    scene = stage(shining(*LIGHTS["rectangle"]))
    ball = next(node for node in scene.nodes() if node.name == "ball")
    gone = move(0, 50, 0) @ ball.transform
    box_ = next(node for node in scene.nodes() if node.name == "box")
    renderer = renderer_of(device, scene, denoiser=denoiser)

    def step():
        box_.transform = move(1e-6, 0, 0) @ box_.transform  # something moves in every frame
        return view(renderer.render(1, camera=VIEW), "filtered")

    for _ in range(12):
        before = step()
    ball.transform = gone
    found = [step() for _ in range(9)]
    level = np.mean([step() for _ in range(8)], 0)
    shade = (before < 0.5) & (level > 0.9)
    assert shade.sum() > 50
    left = [np.abs(picture - level)[shade].mean() for picture in found]
    assert left[5] < 0.05 * np.abs(before - level)[shade].mean(), left
    assert left[8] < 0.02, left


@pytest.mark.parametrize("denoiser", FILTERS)
def test_still_shadows_do_not_flicker(device, denoiser):
    renderer = renderer_of(device, stage(shining(*LIGHTS["rectangle"])), denoiser=denoiser)
    pictures = [view(renderer.render(1, camera=VIEW), "filtered") for _ in range(20)]
    assert np.mean([np.abs(b - a).mean() for a, b in pairwise(pictures[10:])]) < 0.003


def test_each_light_may_choose_its_filter(device):
    sun = replace(LIGHTS["sun"][0], shadow_denoiser="anisotropic")
    lamp = replace(LIGHTS["sphere"][0], shadow_denoiser="off")
    scene = stage(*(shining(light, FROM) for light in (sun, lamp, LIGHTS["rectangle"][0], PointLight(intensity=4.0))))
    frame = renderer_of(device, scene, max_lights=8, denoiser="svgf").render(1, camera=VIEW)
    assert frame.aov("shadows").shape[-1] == 4
    assert frame.aov("debug.shadows.filtered").shape[-1] == 2, "neither the lamp that wants none nor the sharp one"
    assert frame.aov("debug.shadows.footprint").shape == (SIZE[1], SIZE[0], 3)
    assert not any("anisotropic" in name for name in renderer_of(device, stage()).render(1, camera=VIEW).timings)


def test_a_light_may_change_its_filter(device):
    node = shining(LIGHTS["sun"][0], FROM)
    renderer = renderer_of(device, stage(node), denoiser="svgf")
    assert "svgf" in renderer.render(2, camera=VIEW).timings
    node.light = replace(node.light, shadow_denoiser="anisotropic")
    timings = renderer.render(1, camera=VIEW).timings
    assert "anisotropic" in timings and "svgf" not in timings
    node.light = replace(node.light, shadow_denoiser="off")
    assert "shadow_history" not in renderer.render(1, camera=VIEW).timings


def test_history_follows_its_light_when_another_goes(device):
    strong, weak = (shining(LIGHTS[name][0], FROM) for name in ("rectangle", "sun"))
    scene = stage(strong, weak)
    renderer = renderer_of(device, scene, max_lights=8, denoiser="svgf")
    renderer.render(6, camera=VIEW)
    scene.remove(strong)
    frame = renderer.render(1, camera=VIEW)
    assert np.median(view(frame, "history")) == 7


def test_reset_drops_the_history(device):
    renderer = renderer_of(device, stage(shining(*LIGHTS["sun"])))
    assert view(renderer.render(5, camera=VIEW), "history").max() == 5
    renderer.reset()
    assert view(renderer.render(1, camera=VIEW), "history").max() == 1


def test_shadows_follow_a_lamp_that_moves(device):
    """The history is where the shadow was, so that it is no more wrong in motion than the first frame, but less."""
    lamp = shining(*LIGHTS["rectangle"])
    renderer = renderer_of(device, stage(lamp), denoiser="anisotropic")
    start = lamp.transform
    for step in range(13):
        lamp.transform = move(0.03 * step, 0, 0) @ start
        found = view(renderer.render(1, camera=VIEW), "filtered")
    renderer.scene.remove(lamp)
    stopped = stage(lamp)
    alone = view(renderer_of(device, stopped, denoiser="anisotropic").render(1, camera=VIEW), "filtered")
    truth = view(renderer_of(device, stopped, denoiser="anisotropic").render(128, camera=VIEW), "filtered")
    errors = [np.square(picture - truth).mean() for picture in (found, alone)]
    assert errors[0] < 0.5 * errors[1], errors


def test_a_sharp_shadow_is_no_change(device):
    """What moves elsewhere must not cost a shadow its history, however much neighbours differ."""
    elsewhere = placed(box((0.1, 0.1, 0.1), lambert()), move(0, -20, 0))
    scene = stage(shining(*LIGHTS["rectangle"]), elsewhere)
    renderer = renderer_of(device, scene, denoiser="anisotropic")
    for _ in range(12):
        elsewhere.transform = move(1e-3, 0, 0) @ elsewhere.transform
        buffers = renderer.advance(VIEW, jittered=False, capture=("debug.shadows.filtered", "debug.shadows.history"))
    shadow, history = (renderer.captured[f"debug.shadows.{name}"]()[..., 0] for name in ("filtered", "history"))
    floor = buffers["visibility"].to_numpy()[..., 0] == 1
    edges = (np.abs(np.diff(shadow, axis=1)) > 0.2) & floor[:, 1:] & floor[:, :-1]
    assert edges.sum() > 20
    assert (history[:, 1:][edges] > 5).mean() > 0.9
