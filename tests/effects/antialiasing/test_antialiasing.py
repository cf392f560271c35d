"""Temporal antialiasing and upscaling, on unlit scenes: all error is aliasing."""

import numpy as np
import pytest

import pica
from pica.errors import SettingsError
from pica.frame.aovs import at_size
from pica.frame.context import render_size
from pica.quality.sequences import sequence
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.material import Image, Material, Texture
from pica.scenes.basic_meshes import box, plane
from pica.scenes.palette import lamp
from pica.scenes.placing import aim, move, rotate
from tests.building import lambert, placed, scene_of, shining

SIZE = (64, 48)
PIXEL = 2 * 3 * np.tan(np.radians(40) / 2) / SIZE[1]  # metres, at z = 0
ACCUMULATE = {"antialiasing.mode": "accumulate"}
RED = (0.9, 0.1, 0.1)


def unlit(red, green, blue):
    return Material("unlit", base_color=(red, green, blue, 1.0), unlit=True)


def stage(**parts):
    """A dark wall with parts before it; returns the scene and the parts' nodes."""
    wall = placed(plane(12, 12, unlit(0.05, 0.3, 0.4)), move(0, 0, -0.5) @ rotate("x", 90))
    return scene_of(wall, *parts.values())


def tilted():
    """A box whose edges run across the pixels."""
    return placed(box(1.0, unlit(*RED)), rotate("z", 17))


def camera(x=0.0, y=0.0):
    return Camera.look_at((x, y, 3), (x, y, 0), vertical_fov=np.radians(40))


def renderer_of(device, scene, values=None):
    plain = {"shadows.mode": "off", "post.auto_exposure": "false"}
    return pica.Renderer(scene, size=SIZE, settings=pica.Settings().with_values(plain | (values or {})), device=device)


def shown(buffers):
    return buffers["color"].to_numpy()[..., :3].copy()


def truth(renderer, view, samples=32):
    """The mean of jittered frames of one instant; `renderer` accumulates."""
    renderer.reset()
    return renderer.render(samples, camera=view).color


@pytest.mark.parametrize("upscale", ["1", "1.5"])
def test_a_still_picture_is_the_plain_mean(device, upscale):
    scene, values = stage(box=tilted()), {"antialiasing.upscale": upscale}
    still = renderer_of(device, scene, values).render(9, camera=camera()).color
    np.testing.assert_array_equal(
        still, renderer_of(device, scene, values | ACCUMULATE).render(9, camera=camera()).color
    )
    if upscale == "1":
        renderer, frames = renderer_of(device, scene), []
        for _ in range(9):
            frames.append(shown(renderer.advance(camera())))
            renderer._stages.antialiasing.restart()
        np.testing.assert_allclose(still, np.mean(frames, axis=0), rtol=1e-5, atol=1e-6)


def test_coming_to_rest_neither_jumps_nor_leaves_a_trace(device):
    scene = stage(box=tilted())
    renderer, plain = renderer_of(device, scene), renderer_of(device, scene, ACCUMULATE)
    for frame in range(12):
        moving = shown(renderer.advance(camera(0.4 * PIXEL * frame)))
        plain.advance(camera(0.4 * PIXEL * frame))
    stop = camera(0.4 * PIXEL * 11)
    plain._stages.antialiasing.restart()
    for frame in range(34):
        resting, mean = shown(renderer.advance(stop)), shown(plain.advance(stop))
        if frame == 0:
            # The first sample at rest counts as one beside the four of the moving history, which fades besides.
            assert np.abs(resting - moving).max() < 0.25 * np.abs(mean - moving).max() < 0.25
    np.testing.assert_allclose(resting, mean, rtol=1e-4, atol=1e-5)


def test_what_rests_converges_while_something_else_moves(device):
    fan = placed(box(0.5, unlit(*RED)), move(-1, 0, 0))
    scene = stage(box=placed(box(0.8, unlit(0.2, 0.8, 0.2)), move(0.8, 0, 0) @ rotate("z", 17)), fan=fan)
    renderer = renderer_of(device, scene)
    for frame in range(24):
        fan.transform = move(-1, 0, 0) @ rotate("z", 7 * frame)
        moving = shown(renderer.advance(camera()))
    still = renderer_of(device, scene, ACCUMULATE).render(24, camera=camera()).color
    right = np.s_[:, SIZE[0] // 2 + 4 :]
    off = np.abs(moving[right] - still[right]).max(-1)
    assert (off > 1e-4).mean() < 0.005 and off.max() < 0.02


def test_shading_that_changes_at_rest_is_followed(device):
    lamp = shining(DirectionalLight(illuminance=1.0), aim((0, 0, 1), (0, 0, 0)))
    scene = scene_of(placed(plane(12, 12, lambert(0.5)), rotate("x", 90)), lamp)
    renderer = renderer_of(device, scene, {"lighting.environment": "off"})
    dim = renderer.render(30, camera=camera()).color
    lamp.light = DirectionalLight(illuminance=4.0)
    np.testing.assert_allclose(renderer.render(1, camera=camera()).color, 4 * dim, rtol=0.03)


def test_shadows_leave_no_trail_on_surfaces_at_rest(device):
    scene, size = pica.scenes.machine_world(), (256, 144)
    view = scene.default_camera(16 / 9)
    play = sequence("objects", scene, view, speed=1 / 30)
    with pica.Renderer(scene, size=size, device=device) as renderer:
        frame = [renderer.render(1, camera=play(index), aovs=["motion"]) for index in range(24)][-1]
        reference = renderer.render(32, camera=view, cut=True).color
    resting = np.abs(frame.aov("motion")).max(-1) == 0
    off = np.abs(frame.color - reference).max(-1) > 0.5 * reference.mean()
    assert off[resting].mean() < 0.01  # .0092; each pixel judged alone .0118


@pytest.mark.parametrize(("upscale", "bound"), [("1", 0.6), ("1.5", 0.75)])
def test_a_moving_edge_is_smooth(device, upscale, bound):
    scene = stage(box=tilted())
    views = [camera(0.7 * PIXEL * frame, 0.3 * PIXEL * frame) for frame in range(16)]
    pictures = {
        name: [shown(renderer.advance(view)) for view in views]
        for name, renderer in {
            "off": renderer_of(device, scene, ACCUMULATE),
            "temporal": renderer_of(device, scene, {"antialiasing.upscale": upscale}),
        }.items()
    }
    exact = renderer_of(device, scene, ACCUMULATE)
    errors = dict.fromkeys(pictures, 0.0)
    for frame in (9, 12, 15):
        reference = truth(exact, views[frame])
        for name in errors:
            errors[name] += float(np.square(pictures[name][frame] - reference).mean()) ** 0.5
    assert errors["temporal"] < bound * errors["off"], errors


def test_a_fine_texture_keeps_its_contrast_in_motion(device):
    """Half a pixel a frame is where reading the history blurs most: .80 is left of waves of four pixels, and .67 by a
    Catmull-Rom filter."""
    period, side = 4 * PIXEL, 12.0
    wave = 128 + 76 * np.sin(2 * np.pi * (np.arange(2048) + 0.5) / 2048 * side / period)
    waves = Texture(Image(np.broadcast_to(wave[None, :, None], (2, 2048, 4)).astype(np.uint8)))
    wall = plane(side, side, Material("waves", base_color_texture=waves, unlit=True))
    renderer = renderer_of(device, scene_of(placed(wall, rotate("x", 90))))
    for frame in range(12):
        moving = renderer.render(1, camera=camera(0.5 * PIXEL * frame)).color
    true = truth(renderer_of(device, renderer.scene, ACCUMULATE), camera(0.5 * PIXEL * frame))
    inside = np.s_[8:-8, 8:-8, 1]
    assert moving[inside].std() > 0.77 * true[inside].std()


def test_thin_wires_do_not_flicker(device):
    thin = 0.7 * PIXEL
    wire = box((3, thin, thin), unlit(0.9, 0.8, 0.5))
    scene = stage(**{f"wire {n}": placed(wire, move(0, 0.2 * n, 0)) for n in (-3, -1, 1, 3)})
    views = [camera(0, 0.13 * PIXEL * frame) for frame in range(24)]

    exact = renderer_of(device, scene, ACCUMULATE)
    changes = np.diff([truth(exact, view, 16) for view in views[12:]], axis=0)

    def flicker(values):
        renderer = renderer_of(device, scene, values)
        pictures = [shown(renderer.advance(view)) for view in views][12:]
        return float(np.abs(np.diff(pictures, axis=0) - changes).mean())

    assert flicker({}) < 0.35 * flicker(ACCUMULATE)


def test_what_comes_to_light_has_no_trail(device):
    card = plane(0.6, 0.6, unlit(*RED))
    passing = placed(card)
    scene = stage(passing=passing)
    renderer, exact = renderer_of(device, scene), renderer_of(device, scene, ACCUMULATE)
    for frame in range(14):
        passing.transform = move(-0.8 + 2.3 * PIXEL * frame, 0, 0) @ rotate("x", 90)
        picture = shown(renderer.advance(camera()))
    reference = truth(exact, camera())
    behind = (reference[..., 0] < 0.06) & (np.roll(reference[..., 0], 2, axis=1) < 0.06)
    assert behind.sum() > 1000
    assert np.abs(picture - reference)[behind].max() < 0.06  # of 0.85 between the card and the wall


def test_bright_edges_leave_nothing_behind(device):
    board = placed(box(0.5, lamp("board", "#ffffff", 20.0)))
    scene = stage(board=board)
    renderer, exact = renderer_of(device, scene), renderer_of(device, scene, ACCUMULATE)
    for frame in range(24):
        board.transform = move(-0.8 + 1.3 * PIXEL * frame, 0, 0) @ rotate("z", 8)
        picture = shown(renderer.advance(camera()))
    reference = truth(exact, camera())
    left = np.argmax((reference[..., 0] > 0.06).any(0))
    behind = np.abs(picture - reference)[:, : left - 1]
    assert left > 30
    assert behind.max() < 0.004  # of 20


def test_all_pictures_have_the_output_size_and_nothing_is_blended(device):
    scene = stage(box=tilted())
    native, small = renderer_of(device, scene), renderer_of(device, scene, {"antialiasing.upscale": "1.5"})
    assert small.render_size == (43, 32) and small.size == SIZE
    frames = []
    for renderer in (native, small):
        renderer.render(1, camera=camera())
        frames.append(renderer.render(4, camera=camera(2 * PIXEL, PIXEL)))
    full, scaled = frames
    assert scaled.aov_names == full.aov_names
    for name in full.aov_names:
        assert scaled.aov(name).shape == full.aov(name).shape, name
    assert scaled.color.shape == scaled.display.shape == (SIZE[1], SIZE[0], 3)
    for name in ("instance", "material", "depth"):
        assert np.isin(np.unique(np.round(scaled.aov(name), 3)), np.unique(np.round(full.aov(name), 3))).all(), name
        assert (np.abs(scaled.aov(name) - full.aov(name)) > 1e-3).mean() < 0.04, name
    motions = [np.median(frame.aov("motion"), (0, 1)) for frame in frames]
    assert np.abs(motions[0]).max() > 0.5
    np.testing.assert_allclose(motions[1], motions[0], atol=0.02)
    assert np.abs(scaled.color - full.color).mean() < 0.01


def test_resizing_goes_by_the_output(device):
    renderer = renderer_of(device, stage(box=tilted()), {"antialiasing.upscale": "2"})
    renderer.render(1, camera=camera())
    renderer.resize((50, 30))
    frame = renderer.render(2, camera=camera())
    assert frame.color.shape == frame.display.shape == (30, 50, 3)
    assert renderer.render_size == (25, 15)


def test_sharpness_raises_contrast_and_keeps_flat_areas(device):
    scene = stage(box=tilted())
    soft, sharp = (
        renderer_of(device, scene, {"antialiasing.sharpness": str(s)}).render(16, camera=camera()).color for s in (0, 1)
    )
    slope = [np.abs(np.diff(picture[..., 0], axis=1)).max(axis=1).mean() for picture in (soft, sharp)]
    assert slope[1] > 1.03 * slope[0]
    corner = np.s_[:6, :6]
    np.testing.assert_allclose(sharp[corner], soft[corner], rtol=1e-3)


def test_samples_are_repeated_not_blended():
    ids = np.arange(6).reshape(2, 3)
    found = at_size((6, 3), {"id": lambda: ids, "motion": lambda: np.ones((2, 3, 2), np.float32)})
    np.testing.assert_array_equal(found["id"](), ids[[0, 1, 1]][:, [0, 0, 1, 1, 2, 2]])
    np.testing.assert_array_equal(found["motion"]()[0, 0], (2, 1.5))


def test_render_size_is_whole_and_never_nothing():
    assert render_size((1920, 1080), 1.5) == (1280, 720)
    assert render_size((1, 1), 3) == (1, 1)


@pytest.mark.parametrize(
    ("name", "value"),
    [("upscale", "0.9"), ("upscale", "3.1"), ("sharpness", "1.1"), ("mode", "fxaa")],
)
def test_settings_out_of_range_are_errors(name, value):
    with pytest.raises(SettingsError, match=f"antialiasing.{name}"):
        pica.Settings().with_values({f"antialiasing.{name}": value})
