"""The hybrid renderer as people use it."""

import time

import numpy as np
import pytest

import pica
from pica.errors import DeviceError, PicaError
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.light import PointLight
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move
from tests.building import (
    CAMERA,
    RAYS,
    SIZE,
    lambert,
    placed,
    render,
    scene_of,
    settings,
    shining,
    still_life,
    trace,
    uniform,
)

WHOLE = {"reflections.mode": "ray_traced", "global_illumination.mode": "path_traced"}
"""The default, which `settings` leaves something out of."""
OTHER = Camera.look_at((-1.5, 1.2, 2.5), (0, 0.3, 0))


@pytest.fixture(scope="module")
def shared(device):
    """One renderer of the still life for all tests that leave its scene alone."""
    return pica.Renderer(still_life(), size=SIZE, device=device)


@pytest.fixture
def renderer(shared):
    shared.reset()
    return shared


@pytest.mark.smoke
def test_pictures_have_their_shapes_and_types(renderer):
    frame = renderer.render(2, camera=CAMERA)
    width, height = SIZE
    assert frame.color.shape == (height, width, 3) and frame.color.dtype == np.float32
    assert frame.display.shape == (height, width, 3) and frame.display.dtype == np.uint8
    assert np.isfinite(frame.color).all() and frame.color.min() >= 0
    shapes = {
        "depth": (np.float32, ()),
        "normal": (np.float32, (3,)),
        "geometric_normal": (np.float32, (3,)),
        "albedo": (np.float32, (3,)),
        "metallic": (np.float32, ()),
        "roughness": (np.float32, ()),
        "emission": (np.float32, (3,)),
        "motion": (np.float32, (2,)),
        "instance": (np.uint32, ()),
        "material": (np.uint32, ()),
        "shadows": (np.float32, (2,)),  # the sun; the glowing quad and the sky
    }
    assert set(shapes) <= set(frame.aov_names)
    for name, (dtype, channels) in shapes.items():
        assert frame.aov(name).shape == (height, width, *channels), name
        assert frame.aov(name).dtype == dtype, name


def test_display_is_exposed_and_not_clipped_away(renderer):
    display = renderer.render(8, camera=CAMERA).display
    assert 60 < display.mean() < 190
    assert (display == 255).mean() < 0.2 and (display == 0).mean() < 0.2


def test_automatic_exposure_does_not_care_how_strong_the_lights_are(device):
    def picture(strength):
        lamp = shining(PointLight(intensity=strength), move(0.5, 1.5, 1))
        return render(device, scene_of(placed(plane(4, 4, lambert())), placed(box(1, lambert())), lamp), 2, CAMERA)

    dim, bright = picture(0.01), picture(10_000)
    np.testing.assert_allclose(bright.color, dim.color * 1e6, rtol=1e-3, atol=1e-9)
    assert np.abs(bright.display.astype(int) - dim.display).max() <= 12  # the histogram's bins are a third of a stop


def test_exposure_without_automatic_is_what_was_asked(device):
    def grey(stops, radiance=0.18):
        values = {"post.auto_exposure": "false", "post.exposure": str(stops)}
        return int(render(device, scene_of(environment=uniform(radiance)), 1, values=values).display[0, 0, 0])

    assert grey(0) < grey(1) < grey(2)
    assert grey(-3, 0.18 * 8) == grey(0)
    assert grey(0, 1e-9) == 0 and grey(30) == 255


def test_stops_add_to_the_automatic_exposure(device):
    plain, more = (
        render(device, still_life(), 1, CAMERA, values={"post.exposure": stops}).display.mean() for stops in ("0", "1")
    )
    assert more > plain + 15


def test_timings_name_the_passes(renderer):
    timings = renderer.render(2, camera=CAMERA).timings
    assert {"resolve", "lighting", "temporal_resolve", "histogram", "exposure", "tone_map"} <= set(timings)
    assert any(name.startswith("shadow_rays") for name in timings)
    assert all(0 < milliseconds < 10_000 for milliseconds in timings.values())


def test_raster_preset_traces_no_ray(device):
    renderer = pica.Renderer(still_life(), size=SIZE, settings=pica.Settings.preset("raster"), device=device)
    frame = renderer.render(2, camera=CAMERA)
    assert not [name for name in frame.timings if "rays" in name], frame.timings
    assert "raster" in frame.timings
    assert {"shadows", "ambient_occlusion"} <= set(frame.aov_names)  # from maps and from the depth buffer
    hybrid = render(device, still_life(), 32, CAMERA)
    # Lit by the same lights, bar their shadows.
    assert 0.8 < frame.color.mean() / hybrid.color.mean() < 1.6


def test_hybrid_preset_is_the_default(device):
    assert pica.Settings.preset("quality") == pica.Settings()


def test_noise_falls_as_frames_grow(device):
    # Filtered light has little noise to begin with.
    renderer = pica.Renderer(still_life(), size=SIZE, settings=settings({"debug.filters": "false"}), device=device)
    reference = renderer.render(256, camera=CAMERA).color
    errors = []
    for frames in (1, 16, 64):
        renderer.reset()
        errors.append(np.abs(renderer.render(frames, camera=CAMERA).color - reference).mean())
    assert errors[0] > 2 * errors[1] > 2 * 1.3 * errors[2]


def test_frames_add_up_over_calls(renderer):
    whole = renderer.render(6, camera=CAMERA).color
    renderer.reset()
    renderer.render(2, camera=CAMERA)
    renderer.render(3, camera=CAMERA)
    np.testing.assert_array_equal(renderer.render(1, camera=CAMERA).color, whole)


def test_the_mean_of_frames_is_a_mean(renderer):
    """Each frame by itself, averaged in NumPy: the picture of all of them."""
    camera, twin = CAMERA, Camera.look_at((0.4, 1.5, 3.4), (0.1, 0.4, 0), vertical_fov=np.radians(42))
    frames = []
    for index in range(5):
        renderer.reset()
        for _ in range(index):
            renderer.advance(camera)
        renderer._stages.antialiasing.restart()
        frames.append(renderer.render(1, camera=camera).color)
    renderer.reset()
    np.testing.assert_allclose(renderer.render(5, camera=twin).color, np.mean(frames, axis=0), rtol=1e-4, atol=1e-5)


def test_a_first_picture_is_made_of_several_frames(renderer, device):
    told = []
    first = pica.Renderer(
        still_life(), size=SIZE, settings=pica.Settings().with_values({"antialiasing.first_samples": 4}), device=device
    )
    one = first.render(1, camera=CAMERA, progress=lambda done, frames: told.append((done, frames)))
    np.testing.assert_array_equal(one.color, renderer.render(4, camera=CAMERA).color)
    assert told == [(1, 1)]
    np.testing.assert_array_equal(first.render(2, camera=CAMERA).color, renderer.render(2, camera=CAMERA).color)
    again = first.render(1, camera=CAMERA, cut=True)
    np.testing.assert_array_equal(again.color, one.color)
    renderer.reset()  # buffers have the first frame's samples, at the centres of pixels
    np.testing.assert_array_equal(again.aov("position"), renderer.render(1, camera=CAMERA).aov("position"))


def test_reset_starts_the_same_noise_again(renderer):
    first = renderer.render(3, camera=CAMERA)
    renderer.reset()
    again = renderer.render(3, camera=CAMERA)
    np.testing.assert_array_equal(first.color, again.color)
    np.testing.assert_array_equal(first.display, again.display)


def test_two_renderers_make_the_same_bits(renderer, device):
    np.testing.assert_array_equal(
        renderer.render(3, camera=CAMERA).color, render(device, still_life(), 3, CAMERA, values=WHOLE).color
    )


def test_a_moving_camera_starts_the_mean_anew(device):
    # Filters remember what they saw before.
    unfiltered = settings({"shadows.denoiser": "off", "debug.filters": "false", "antialiasing.mode": "accumulate"})
    renderer = pica.Renderer(still_life(), size=SIZE, settings=unfiltered, device=device)
    renderer.render(20, camera=CAMERA)
    moved = renderer.render(1, camera=OTHER).color
    renderer.reset()
    for _ in range(20):
        renderer.advance(CAMERA)
    renderer._stages.antialiasing.restart()
    np.testing.assert_array_equal(renderer.render(1, camera=OTHER).color, moved)


def test_a_camera_that_only_has_another_name_does_not(renderer):
    whole = renderer.render(4, camera=CAMERA).color
    renderer.reset()
    renderer.render(3, camera=CAMERA)
    twin = Camera.look_at((0.4, 1.5, 3.4), (0.1, 0.4, 0), vertical_fov=np.radians(42), name="twin")
    np.testing.assert_array_equal(renderer.render(1, camera=twin).color, whole)


def test_a_moving_object_starts_the_mean_anew(device):
    scene = still_life()
    renderer = pica.Renderer(scene, size=SIZE, device=device)
    ball = next(node for node in scene.nodes() if node.name == "ball")
    renderer.render(10, camera=CAMERA)
    ball.transform = move(0, 2, 0) @ ball.transform
    moved = renderer.render(1, camera=CAMERA).color
    renderer._stages.antialiasing.restart()
    assert not np.array_equal(moved, renderer.render(1, camera=CAMERA).color), "other noise in the next frame"
    # Nothing of the old place is left: the picture of one frame, bar its noise, is that of the moved scene.
    still = renderer.render(64, camera=CAMERA).color
    assert np.abs(moved - still).mean() < 0.5 * still.mean()
    renderer.reset()
    assert np.abs(renderer.render(64, camera=CAMERA).color - still).mean() < 0.05 * still.mean()


def test_older_frames_stay_as_they_were(device):
    scene = still_life()
    renderer = pica.Renderer(scene, size=SIZE, device=device)
    frame = renderer.render(2, camera=CAMERA)
    next(node for node in scene.nodes() if node.name == "box").transform = move(0, 1, 0)
    newer = renderer.render(2, camera=OTHER)
    same = render(device, still_life(), 2, CAMERA, values=WHOLE)
    for name in same.aov_names:
        np.testing.assert_array_equal(frame.aov(name), same.aov(name), err_msg=name)
    np.testing.assert_array_equal(frame.color, same.color)
    np.testing.assert_array_equal(frame.display, same.display)
    assert not np.array_equal(frame.color, newer.color)


def test_a_frame_outlives_its_renderer(device):
    frame = render(device, still_life(), 1, CAMERA)
    assert frame.color.mean() > 0 and frame.aov("instance").any()


def test_without_a_camera_the_scenes_own_or_one_that_shows_everything(device):
    cornell = pica.scenes.cornell()
    own, given = (render(device, cornell, 1, camera).color for camera in (None, cornell.cameras()[0]))
    np.testing.assert_array_equal(own, given)
    scene = scene_of(placed(box(2, lambert()), move(100, 50, 0)))
    ids = render(device, scene).aov("instance")
    inside = ids[1:-1, 1:-1]
    assert inside.any() and not ids[0].any() and not ids[-1].any() and not ids[:, 0].any() and not ids[:, -1].any()


@pytest.mark.parametrize("size", [(0, 10), (10, -1), (20000, 5)])
def test_impossible_sizes_are_one_line(device, size):
    with pytest.raises(PicaError, match=f"picture size {size[0]}x{size[1]}") as raised:
        pica.Renderer(scene_of(), size=size, device=device)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("size", [(1, 1), (3, 1), (1, 5), (17, 9)])
def test_odd_sizes(device, size):
    for picture in (render(device, still_life(), 2, CAMERA, size), trace(device, still_life(), 2, CAMERA, size)):
        assert picture.color.shape == (size[1], size[0], 3) and np.isfinite(picture.color).all()


def test_unknown_device_is_one_line():
    with pytest.raises(DeviceError, match="no device named 'abacus'") as raised:
        pica.Renderer(scene_of(), size=SIZE, device="abacus")
    assert "\n" not in str(raised.value)


def test_device_by_name(device):
    renderer = pica.Renderer(scene_of(environment=uniform(1)), size=(8, 8), device=device.name[:6].lower())
    assert renderer.device_name == device.name
    assert isinstance(renderer.device, Device)
    np.testing.assert_allclose(renderer.render(1).color, 1)


@pytest.mark.parametrize("frames", [0, -3])
def test_no_frames_are_refused(renderer, frames):
    with pytest.raises(PicaError, match=rf"^render: frames: {frames} is not from 1 to "):
        renderer.render(frames, camera=CAMERA)


def test_progress_is_told(renderer):
    told = []
    renderer.render(3, camera=CAMERA, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_unknown_aov_is_named(renderer):
    with pytest.raises(PicaError, match=r"'depths'.*depth, position, normal"):
        renderer.render(1, camera=CAMERA).aov("depths")


def test_two_scenes_side_by_side_on_one_device(device):
    """Their blocks, profilers and noise do not get in each other's way."""
    first, second = (
        pica.Renderer(still_life(), size=SIZE, device=device),
        pica.Renderer(pica.scenes.cornell(), device=device),
    )
    mixed = []
    for _ in range(3):
        mixed.append(first.render(1, camera=CAMERA).color)
        second.render(1)
    np.testing.assert_array_equal(mixed[-1], render(device, still_life(), 3, CAMERA, values=WHOLE).color)


def test_frames_are_saved_whole(renderer, tmp_path):
    frame = renderer.render(1, camera=CAMERA)
    frame.save(tmp_path / "picture.exr")
    frame.save(tmp_path / "picture.png")
    from pica.images.pictures import read_exr, read_image

    channels = read_exr(tmp_path / "picture.exr")
    np.testing.assert_array_equal(channels["G"], frame.color[..., 1])
    np.testing.assert_array_equal(channels["normal.Y"], frame.aov("normal")[..., 1])
    np.testing.assert_array_equal(read_image(tmp_path / "picture.png", "picture")[..., :3], frame.display)


def test_host_time_of_a_frame_is_small(device):
    """Recording is microseconds a pass: far from what the pictures cost, whatever the machine is busy with."""
    # A tracer on the host would wait for the passes before it.
    renderer = pica.Renderer(
        still_life(), size=SIZE, settings=settings(RAYS | {"rays.tracer": "device"}), device=device
    )
    best = np.inf
    for _ in range(30):
        renderer.advance(CAMERA)
        best = min(best, renderer.host_seconds)
    assert best < 0.02
    renderer.device.handle.wait_for_idle()


def test_no_textures_or_buffers_are_made_after_the_first_frames(renderer):
    """No allocation after the first frame."""
    renderer.render(2, camera=CAMERA)
    before = renderer.device.memory
    start = time.perf_counter()
    for _ in range(10):
        renderer.advance(CAMERA)
    assert renderer.device.memory == before, f"after {time.perf_counter() - start:.1f} s"


def test_settings_reach_the_renderer(device):
    renderer = pica.Renderer(still_life(), size=SIZE, settings=settings({"shadows.mode": "off"}), device=device)
    assert renderer.settings.shadows.mode == "off" and renderer._stages.shadows is None
    assert not any("shadow" in name for name in renderer.render(1, camera=CAMERA).timings)
