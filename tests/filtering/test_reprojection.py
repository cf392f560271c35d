"""Where pixels were in the previous frame, against the same search over the G-buffers in NumPy."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.frame.aovs import motion_of
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import RASTER, lambert, placed, scene_of, settings, shining

SIZE = WIDTH, HEIGHT = (80, 56)
VIEW = Camera.look_at((0.4, 1.5, 3.4), (0.1, 0.4, 0), vertical_fov=np.radians(42))


def stage():
    return scene_of(
        placed(plane(4, 4, lambert())),
        placed(sphere(0.5, lambert()), move(-0.7, 0.5, 0), "ball"),
        placed(box(0.6, lambert()), move(0.6, 0.3, 0.4) @ rotate("y", 30), "box"),
        shining(DirectionalLight(illuminance=2.0), aim((1, 2, 1.5), (0, 0, 0))),
    )


@pytest.fixture
def renderer(device):
    return pica.Renderer(stage(), size=SIZE, settings=settings({**RASTER, "shadows.mode": "off"}), device=device)


def advance(renderer, camera=VIEW, jittered=True):
    """The words of a frame and what they were found from."""
    aovs, words = ("depth", "geometric_normal"), "debug.reprojection.found"
    buffers = renderer.advance(camera, jittered=jittered, capture=(*aovs, words))
    seen = {name: renderer.captured[name]() for name in aovs}
    seen |= {"record": buffers["visibility"].to_numpy()[..., 0], "motion": motion_of(buffers["motion"].to_numpy())}
    return renderer.captured[words](), {**seen, "camera": camera}


def stillness(words):
    return words >> 16 & 255


def unprojected(camera, place, distance):
    """World positions (..., 3) of what was seen at places (..., 2), in texels whose centres lie at whole numbers."""
    half = np.tan(camera.vertical_fov / 2)
    x = ((place[..., 0] + 0.5) / WIDTH * 2 - 1) * half * WIDTH / HEIGHT
    y = (1 - (place[..., 1] + 0.5) / HEIGHT * 2) * half
    offsets = np.stack([x, y, -np.ones_like(x)], -1) * distance[..., None]
    return offsets @ camera.transform[:3, :3].T + camera.transform[:3, 3]


def shows_the_same(now, before, texel):
    """(height, width) whether the previous frame's texels (height, width, 2) show what the pixels show now."""
    inside = ((texel >= 0) & (texel < (WIDTH, HEIGHT))).all(-1)
    x, y = np.clip(texel, 0, (WIDTH - 1, HEIGHT - 1)).transpose(2, 0, 1)
    with np.errstate(invalid="ignore"):
        distance = now["depth"] + now["motion"][..., 2]
        expected = unprojected(before["camera"], now["place"], distance)
        seen = unprojected(before["camera"], texel.astype(float), before["depth"][y, x])
        off = np.abs(((seen - expected) * before["geometric_normal"][y, x]).sum(-1))
        width = 2 * np.tan(before["camera"].vertical_fov / 2) / HEIGHT * distance
        facing = (before["geometric_normal"][y, x] * now["geometric_normal"]).sum(-1)
        surface = (facing >= 0.9) & (off < 2 * width)
    return inside & (before["record"][y, x] == now["record"]) & ((now["record"] == 0) | surface)


def test_the_texture_holds_what_a_search_in_both_frames_finds(renderer):
    ball = next(node for node in renderer.scene.nodes() if node.name == "ball")
    advance(renderer)
    _, before = advance(renderer)
    ball.transform = move(-0.16, 0, 0) @ ball.transform
    moved = replace(VIEW, transform=move(0.03, 0.01, 0) @ VIEW.transform)
    words, now = advance(renderer, moved)

    now["place"] = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), -1) + now["motion"][..., :2]
    corner = np.floor(now["place"]).astype(int)
    share = now["place"] - corner
    across, down = np.stack([1 - share[..., 0], share[..., 0]]), np.stack([1 - share[..., 1], share[..., 1]])
    weights = [across[tap & 1] * down[tap >> 1] for tap in range(4)]
    taps = [shows_the_same(now, before, np.add(corner, (tap & 1, tap >> 1))) & (weights[tap] > 0) for tap in range(4)]
    weight = sum(tap * weight for tap, weight in zip(taps, weights, strict=True))
    expected = np.where(weight > 0.01, sum(taps[tap] << tap for tap in range(4)), 0)
    middle = np.floor(now["place"] + 0.5).astype(int)
    for number in reversed(range(9)):
        beside = shows_the_same(now, before, np.add(middle, (number % 3 - 1, number // 3 - 1)))
        expected = np.where((weight <= 0.01) & beside, (number + 1) << 4, expected)

    assert (expected == 0).sum() > 20 and (expected >> 4 != 0).sum() > 20 and (expected == 15).sum() > 2000
    assert ((words & 255) != expected).mean() < 2e-3, "but for rounding"


def test_nothing_is_found_in_a_first_frame(renderer):
    assert not advance(renderer)[0].any()
    assert (advance(renderer)[0] & 255).any()
    renderer.reset()
    assert not advance(renderer)[0].any()


def test_stillness_counts_frames_where_nothing_moves_and_elsewhere_stays_zero(renderer):
    ball = next(node for node in renderer.scene.nodes() if node.name == "ball")
    for _ in range(6):
        ball.transform = move(0.01, 0, 0) @ ball.transform
        words, now = advance(renderer, jittered=False)
    on_ball = now["record"] == 2
    assert on_ball.sum() > 100 and (stillness(words)[on_ball] == 0).all()
    assert np.median(stillness(words)[~on_ball]) == 5 and (stillness(words)[now["record"] == 0] >= 1).all()
    for _ in range(3):
        words, _ = advance(renderer, jittered=False)
    assert (stillness(words)[on_ball] == 3).all()


def test_jitter_does_not_end_stillness_at_edges(renderer):
    for _ in range(8):
        words, _ = advance(renderer)
    assert (stillness(words) == 7).mean() > 0.98


def test_a_light_that_changes_ends_all_stillness(renderer):
    for _ in range(4):
        advance(renderer)
    sun = next(node for node in renderer.scene.nodes() if node.light)
    sun.transform = rotate("y", 1) @ sun.transform
    words, _ = advance(renderer)
    assert not stillness(words).any() and (words & 255).any()
