"""Renderers and path tracers that are given what they cannot use say so in one line, and go on where they were."""

import numpy as np
import pytest

import pica
from pica.errors import DeviceError, PicaError, SceneError, SettingsError
from pica.scene.light import PointLight
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from pica.settings import ShadowsSettings
from tests.building import CAMERA, lambert, placed, scene_of, shining
from tests.wrong_values import VALUES, fault_of

pytestmark = pytest.mark.device  # what is left out is the default, and so the device is opened first

KINDS = [pica.Renderer, pica.PathTracer]
TAKEN = {"settings": {"None"}, "device": {"None", "empty text"}, "max_depth": {"None", "true", "one"}}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("name", "error"),
    [("scene", SceneError), ("size", PicaError), ("settings", SettingsError), ("device", DeviceError)],
)
def test_what_none_can_be_made_with(kind, name, error):
    for label, value in VALUES.items():
        if label in TAKEN.get(name, ()):
            continue
        fault = fault_of(kind, **{"scene": scene_of(), "size": (8, 8), name: value})
        assert name in fault, (label, fault)
        with pytest.raises(error):
            kind(**{"scene": scene_of(), "size": (8, 8), name: value})


@pytest.mark.parametrize(
    ("size", "fault"),
    [
        (None, "picture size None: must be two whole numbers, width and height"),
        ((64,), "picture size (64,): must be two whole numbers, width and height"),
        ((64, 64, 64), "picture size (64, 64, 64): must be two whole numbers, width and height"),
        (64, "picture size 64: must be two whole numbers, width and height"),
        ((64.0, 32.0), "picture size (64.0, 32.0): must be two whole numbers, width and height"),
        ((np.nan, 64), "picture size (nan, 64): must be two whole numbers, width and height"),
        ((np.float64(64), 64), "picture size (64.0, 64): must be two whole numbers, width and height"),
        ("64x64", "picture size '64x64': must be two whole numbers, width and height"),
        ((10**30, 1), f"picture size {10**30}x1: width and height must be 1 to 16384 pixels"),
        ((np.int64(0), np.uint8(7)), "picture size 0x7: width and height must be 1 to 16384 pixels"),
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_sizes_in_words(kind, size, fault):
    with pytest.raises(PicaError) as caught:
        kind(scene_of(), size=size)
    assert str(caught.value) == fault


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_in_words(kind):
    name = kind.__name__
    for arguments, fault in (
        ({"scene": None}, f"{name}: scene: None is not a Scene"),
        ({"scene": "model.glb"}, f"{name}: scene: 'model.glb' is not a Scene"),
        ({"settings": {}}, f"{name}: settings: {{}} is not a Settings"),
        ({"settings": ShadowsSettings()}, f"{name}: settings: a ShadowsSettings is not a Settings"),
        ({"device": 3}, f"{name}: device: 3 is not a Device or str"),
    ):
        assert fault_of(kind, **{"scene": scene_of(), **arguments}) == fault


@pytest.mark.parametrize("depth", [value for label, value in VALUES.items() if label not in TAKEN["max_depth"]])
def test_depths_that_no_path_has(depth):
    with pytest.raises(SettingsError, match=r"^max_depth .*: must be 1 or more, or None for no limit$"):
        pica.PathTracer(scene_of(), size=(8, 8), max_depth=depth)


@pytest.mark.parametrize("kind", KINDS)
def test_denoise_is_yes_or_no(device, kind):
    renderer = kind(scene_of(), size=(8, 8), device=device)
    for label, value in VALUES.items():
        if label != "true":
            assert fault_of(renderer.render, 1, camera=CAMERA, denoise=value).endswith(
                " is not True, False or 'fast'"
            ), label


def test_settings_of_a_wrong_kind():
    settings = pica.Settings()
    for label, value in VALUES.items():
        for call in (settings.with_values, pica.Settings.preset):
            taken = call == settings.with_values and value == {} if isinstance(value, dict) else False
            assert taken or "se" in fault_of(call, value), label
        for name in ("seed", "shadows", "post.exposure", "shadows.mode", "shadows.transparent"):
            fault = fault_of(settings.with_values, {name: value})
            assert not fault or name in fault, fault
        if label not in ("lines", "text", "empty text", "dict"):
            with pytest.raises((SettingsError, TypeError)):
                settings.with_values({value: 1})


@pytest.fixture(scope="module", params=KINDS, ids=lambda kind: kind.__name__)
def renderer(request, device):
    scene = scene_of(placed(box(1, lambert())), shining(PointLight(), move(1, 2, 2)))
    return request.param(scene, size=(8, 8), device=device)


def test_what_none_can_render(renderer):
    before = renderer.render(1, camera=CAMERA).color
    for label, value in VALUES.items():
        if label != "one":
            assert "render: " in fault_of(renderer.render, value, camera=CAMERA), label
        if value is not None:
            assert "render: camera: " in fault_of(renderer.render, 1, camera=value), label
            if label not in ("class", "function"):
                assert "render: progress: " in fault_of(renderer.render, 1, camera=CAMERA, progress=value), label
        if isinstance(renderer, pica.Renderer):
            assert "render: camera: " in fault_of(renderer.advance, value)
            assert "picture size" in fault_of(renderer.resize, value)
            assert "configure: settings: " in fault_of(renderer.configure, value)
    if isinstance(renderer, pica.Renderer):
        renderer.reset()
    np.testing.assert_array_equal(renderer.render(1, camera=CAMERA).color, before)


def test_cameras_keep_a_matrix_of_their_own():
    matrix = CAMERA.transform.copy()
    camera = pica.Camera(matrix)
    matrix[0, 3] = np.nan
    assert np.isfinite(camera.transform).all()
    with pytest.raises(ValueError, match="read-only"):
        camera.transform[0, 3] = 1


@pytest.mark.parametrize("name", ["size", "settings", "scene", "device"])
def test_what_they_were_made_with_cannot_be_assigned(renderer, name):
    before = getattr(renderer, name)
    with pytest.raises(PicaError, match=rf"^{type(renderer).__name__}\.{name} cannot be assigned; \w.*$"):
        setattr(renderer, name, before)
    assert getattr(renderer, name) is before
