"""Open Image Denoise as the last step of path traced and of hybrid pictures."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

import pica
from pica.denoising import denoiser, open_image_denoise
from pica.errors import PicaError
from pica.quality import compare
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, orthographic, placed, scene_of, shining, uniform

SIZE = (64, 48)
KINDS = [pica.Renderer, pica.PathTracer]
needs_wheel = pytest.mark.skipif(
    not open_image_denoise.is_installed(), reason='Open Image Denoise is not installed: pip install "pica[denoise]"'
)


@pytest.fixture
def given(monkeypatch):
    """Instead of denoising, pictures stay as they are, and this holds what was given to be denoised last."""
    given = SimpleNamespace()

    def keep(color, albedo, normal, fast):
        vars(given).update(color=color, albedo=albedo, normal=normal, fast=fast)
        return color

    monkeypatch.setattr(denoiser, "denoised", keep)
    monkeypatch.setattr(denoiser, "check_installed", lambda: None)
    return given


def room():
    """A ball on a board of two colours under a sky, where light takes many samples."""
    floor = placed([plane(4, 4, lambert(0.7, 0.3, 0.2))])
    ball = placed(sphere(0.5, lambert(0.2, 0.5, 0.7)), move(0, 0.5, 0))
    return scene_of(
        floor,
        ball,
        shining(DirectionalLight(illuminance=2.0, angular_diameter=0.3), rotate("x", -60)),
        environment=uniform(0.5, 0.6, 0.8),
    )


CAMERA = Camera.look_at((0.4, 1.5, 3.0), (0, 0.4, 0), vertical_fov=np.radians(40))


@needs_wheel
@pytest.mark.parametrize("fast", [False, True])
def test_noise_goes_and_edges_stay(fast):
    random = np.random.default_rng(1)
    albedo = np.where(np.indices((64, 64)).sum(0)[..., None] // 8 % 2, (0.8, 0.6, 0.4), (0.1, 0.2, 0.3)).astype("f4")
    normal = np.broadcast_to(np.float32((0, 0, 1)), albedo.shape).copy()
    truth = 20 * albedo
    noisy = (truth * random.exponential(1.0, (*albedo.shape[:2], 1))).astype("f4")
    clean = open_image_denoise.denoised(noisy, albedo, normal, fast)
    assert clean.shape == noisy.shape and clean.dtype == np.float32
    assert np.abs(clean - truth).mean() < 0.25 * np.abs(noisy - truth).mean()
    assert np.abs(clean.mean((0, 1)) / truth.mean((0, 1)) - 1).max() < 0.1, "more than 1, as radiance is"


@needs_wheel
@pytest.mark.parametrize("size", [(1, 1), (3, 200), (17, 5)])
def test_sizes(size):
    grey = np.full((*size, 3), 0.5, np.float32)
    up = np.broadcast_to(np.float32((0, 1, 0)), grey.shape)
    clean = open_image_denoise.denoised(grey, grey, up)
    assert clean.shape == grey.shape
    assert clean.mean() == pytest.approx(0.5, rel=0.05)


def test_where_it_is_not_installed(monkeypatch):
    monkeypatch.setattr(open_image_denoise, "find_spec", lambda _: None)
    picture = np.zeros((4, 4, 3), np.float32)
    with pytest.raises(PicaError, match=r'^denoise: .* not installed; `pip install "pica\[denoise\]"` installs it$'):
        open_image_denoise.denoised(picture, picture, picture)


@pytest.mark.parametrize("error", [ImportError("libfoo.so: no such file\nmore"), RuntimeError("out of memory")])
def test_where_it_is_broken(monkeypatch, error):
    def fail(*_, **__):
        raise error

    broken = SimpleNamespace(Device=fail, DeviceType=SimpleNamespace(CPU=1))
    monkeypatch.setattr(open_image_denoise, "find_spec", lambda _: "found")
    monkeypatch.setitem(sys.modules, "mitsuba_oidn", broken)
    open_image_denoise._device.cache_clear()
    picture = np.zeros((4, 4, 3), np.float32)
    with pytest.raises(
        PicaError, match=r"^denoise: Open Image Denoise cannot be used here \((libfoo.*file|out of mem.*)\)$"
    ):
        open_image_denoise.denoised(picture, picture, picture)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_rendered_without_it(device, monkeypatch, kind):
    monkeypatch.setattr(open_image_denoise, "find_spec", lambda _: None)
    told = []
    renderer = kind(room(), size=(8, 8), device=device)
    with pytest.raises(PicaError, match="not installed"):
        renderer.render(2, camera=CAMERA, progress=lambda *done: told.append(done), denoise=True)
    assert not told
    assert renderer.render(1, camera=CAMERA).color.any()


@needs_wheel
@pytest.mark.parametrize(("kind", "values"), [(pica.Renderer, {"shadows.denoiser": "off"}), (pica.PathTracer, {})])
def test_pictures_come_closer_to_what_they_should_be(device, kind, values):
    """The hybrid renderer's shadows stay as noisy as they come; it is compared with its own picture of many frames."""
    settings = pica.Settings().with_values(values)
    renderer = kind(room(), size=SIZE, settings=settings, device=device)
    truth = renderer.render(256, camera=CAMERA).color
    renderer = kind(room(), size=SIZE, settings=settings.with_values({"seed": "5"}), device=device)
    frames = 1 if kind is pica.Renderer else 2
    noisy = renderer.render(frames, camera=CAMERA)
    if kind is pica.Renderer:
        renderer.reset()
    clean = renderer.render(frames, camera=CAMERA, denoise=True)
    before, after = (compare(truth, frame.color) for frame in (noisy, clean))
    assert after.relmse < (0.9 if kind is pica.Renderer else 0.5) * before.relmse
    assert clean.color.mean() == pytest.approx(truth.mean(), rel=0.05)
    # What is shown was made of the denoised picture.
    rough = [np.abs(np.diff(frame.display.astype(int), axis=1)).mean() for frame in (noisy, clean)]
    assert rough[1] < 0.97 * rough[0]


@pytest.mark.parametrize("kind", KINDS)
def test_fast_where_asked_for(device, given, kind):
    renderer = kind(room(), size=(8, 8), device=device)
    for denoise in (True, "fast", np.True_):
        renderer.render(1, camera=CAMERA, denoise=denoise)
        assert given.fast == (denoise == "fast")


@pytest.mark.parametrize("kind", KINDS)
def test_features_of_surfaces_and_of_what_is_beyond(device, given, kind):
    """Colours and normals of the pixels; half of each where an edge goes through the middle of a pixel."""
    left = placed(plane(1, 9, lambert(0.2, 0.4, 0.6)), move(-0.5, 0, 0))
    camera = orthographic((0, 4, 0), (0, 0, 0), 1.0)
    kind(scene_of(left, environment=uniform(3.0, 1.0, 1.0)), size=(9, 9), device=device).render(
        64, camera=camera, denoise=True
    )
    assert given.albedo.shape == given.normal.shape == given.color.shape == (9, 9, 3)
    np.testing.assert_allclose(given.albedo[:, :4], np.broadcast_to((0.2, 0.4, 0.6), (9, 4, 3)), atol=1e-4)
    np.testing.assert_allclose(given.normal[:, :4], np.broadcast_to((0, 1, 0), (9, 4, 3)), atol=1e-3)
    np.testing.assert_allclose(given.albedo[:, 5:], np.broadcast_to((0.75, 0.25, 0.25), (9, 4, 3)), atol=1e-4)
    assert not given.normal[:, 5:].any()
    np.testing.assert_allclose(given.normal[:, 4].mean(0), (0, 0.5, 0), atol=0.05)


@pytest.mark.parametrize(("roughness", "followed"), [(0.0, True), (0.09, True), (0.2, False)])
def test_path_traced_mirrors_have_the_features_of_what_they_show(device, given, roughness, followed):
    mirror = Material(base_color=(0.5, 0.9, 0.9, 1), metallic=1.0, roughness=roughness)
    wall = placed(plane(90, 90, lambert(0.8, 0.8, 0.2)), move(0, 30, 0) @ rotate("x", 180))
    scene = scene_of(placed(plane(9, 9, mirror)), wall, environment=uniform(1.0))
    tracer = pica.PathTracer(scene, size=(8, 8), device=device)
    tracer.render(16, camera=orthographic((0, 4, 0), (0, 0, 0), 1.0), denoise=True)
    albedo, normal = ((0.4, 0.72, 0.18), (0, -1, 0)) if followed else ((0.5, 0.9, 0.9), (0, 1, 0))
    np.testing.assert_allclose(given.albedo.mean((0, 1)), albedo, atol=0.02)
    np.testing.assert_allclose(given.normal.mean((0, 1)), normal, atol=0.02)


def test_mirrors_where_paths_end_have_their_own_features(device, given):
    mirror = Material(base_color=(0.5, 0.9, 0.9, 1), metallic=1.0, roughness=0.0)
    scene = scene_of(placed(plane(9, 9, mirror)), environment=uniform(1.0))
    tracer = pica.PathTracer(scene, size=(8, 8), max_depth=1, device=device)
    tracer.render(2, camera=orthographic((0, 4, 0), (0, 0, 0), 1.0), denoise=True)
    np.testing.assert_allclose(given.albedo, np.broadcast_to((0.5, 0.9, 0.9), (8, 8, 3)), atol=1e-4)


def test_light_has_features_of_a_colour_below_1(device, given):
    lamp = lambert(0.0, emission=(900.0, 300.0, 0.0))
    tracer = pica.PathTracer(scene_of(placed(plane(9, 9, lamp))), size=(8, 8), device=device)
    tracer.render(1, camera=orthographic((0, 4, 0), (0, 0, 0), 1.0), denoise=True)
    np.testing.assert_allclose(given.albedo, np.broadcast_to((0.999, 0.333, 0), (8, 8, 3)), atol=2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_denoised_is_the_picture_itself_and_nothing_else_changes(device, given, kind):
    plain = kind(room(), size=SIZE, device=device)
    first, second = plain.render(2, camera=CAMERA), plain.render(2, camera=CAMERA)
    renderer = kind(room(), size=SIZE, device=device)
    frame = renderer.render(2, camera=CAMERA, denoise=True)
    for one, other in ((frame, first), (renderer.render(2, camera=CAMERA), second)):
        np.testing.assert_array_equal(one.color, other.color)
        np.testing.assert_array_equal(one.display, other.display)
    np.testing.assert_array_equal(given.color, first.color)
    assert frame.aov_names == first.aov_names
    memory = device.memory
    renderer.render(1, camera=CAMERA, denoise=True)
    assert device.memory == memory, "what denoising needs goes with the picture"


def test_upscaled_pictures_have_features_of_their_own_size(device, given):
    settings = pica.Settings().with_values({"antialiasing.upscale": "2"})
    renderer = pica.Renderer(room(), size=(31, 24), settings=settings, device=device)
    frame = renderer.render(8, camera=CAMERA, denoise=True)
    assert given.albedo.shape == frame.color.shape == (24, 31, 3)
    seen = frame.aov("instance") > 0
    assert np.median(np.abs(given.albedo - frame.aov("albedo"))[seen]) < 0.01
