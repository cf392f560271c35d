"""A picture that is nearly black says why, once for each renderer, and others say nothing."""

import warnings

import numpy as np
import pytest

import pica
from pica.scene.light import PointLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move
from tests.building import CAMERA, lambert, placed, scene_of, settings, shining, uniform

SIZE = (64, 32)
NOTHING_SHINES = "nothing in the scene gives light; add a light or an environment"
FRONT = pica.Camera.look_at((0, 0, 4), (0, 0, 0))


def said(renderer, camera=FRONT, times=1):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(times):
            renderer.render(2, camera=camera).display  # noqa: B018
    return [str(warning.message) for warning in caught]


@pytest.mark.parametrize("kind", [pica.Renderer, pica.PathTracer])
def test_without_light(device, kind):
    renderer = kind(scene_of(placed(box(1, lambert()))), size=SIZE, settings=settings(), device=device)
    (message,) = said(renderer, times=3)
    assert message.startswith(f"the picture is nearly black: {NOTHING_SHINES}")


def test_with_lights_of_no_strength(device):
    scene = scene_of(placed(box(1, lambert())), shining(PointLight(intensity=0)), environment=uniform(0, 0, 0))
    (message,) = said(pica.Renderer(scene, size=SIZE, settings=settings(), device=device))
    assert NOTHING_SHINES in message


def test_where_no_light_reaches(device):
    wall = placed(plane(20, 20, lambert()), move(0, -1, 0))
    scene = scene_of(wall, shining(PointLight(intensity=100), move(0, -3, 0)))
    (message,) = said(
        pica.Renderer(scene, size=SIZE, settings=settings(), device=device), pica.Camera.look_at((0, 2, 4), (0, -1, 0))
    )
    assert "hardly any light reaches what is seen" in message


def test_exposed_by_hand(device):
    scene = scene_of(placed(box(1, lambert())), environment=uniform(0.01, 0.01, 0.01))
    by_hand = {"post.auto_exposure": False, "post.exposure": -5, "visibility.background": "transparent"}
    renderer = pica.Renderer(scene, size=SIZE, settings=settings().with_values(by_hand), device=device)
    (message,) = said(renderer)
    assert "post.exposure=-5 makes 32 nits white, and what is seen has 0.00" in message
    tried = float(message.split("try post.exposure=")[1].split(",")[0])
    renderer.configure(settings().with_values({**by_hand, "post.exposure": tried}))
    assert renderer.render(2, camera=FRONT).display[16, 32].mean() > 100


def test_a_camera_that_looks_away(device):
    renderer = pica.Renderer(
        scene_of(placed(box(1, lambert())), shining(PointLight())), size=SIZE, settings=settings(), device=device
    )
    (message,) = said(renderer, pica.Camera.look_at((0, 0, 4), (0, 0, 8)))
    assert "the camera sees hardly any surface" in message


def test_a_camera_inside_of_something(device):
    case, other = placed(box(0.01, lambert(double_sided=True))), placed(box(1, lambert()), move(50, 0, 0))
    scene = scene_of(case, other, shining(PointLight(), move(50, 3, 0)))
    camera = pica.Camera.look_at((0, 0, 0), (0, 0, -1), near=1e-4)
    (message,) = said(pica.Renderer(scene, size=SIZE, settings=settings(), device=device), camera)
    assert "as if it stood inside of something" in message


@pytest.mark.parametrize("background", [None, "bright"])
def test_what_is_lit_says_nothing_however_small(device, background):
    speck = placed(box(0.3, lambert()))
    sky = uniform(1, 1, 1) if background else None
    scene = scene_of(speck, shining(PointLight(intensity=0.001), move(0, 0, 2)), environment=sky)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(), device=device)
    assert said(renderer) == []
    assert background or renderer.render(1, camera=FRONT).display.mean() < 2


def test_what_glows_alone_says_nothing(device):
    glowing = Material(emission=(0.001, 0.001, 0.001))
    assert said(pica.Renderer(scene_of(placed(box(1, glowing))), size=SIZE, settings=settings(), device=device)) == []


def test_radiance_alone_says_so_too(device, tmp_path):
    renderer = pica.Renderer(scene_of(placed(box(1, lambert()))), size=SIZE, settings=settings(), device=device)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isfinite(renderer.render(1, camera=CAMERA).aov("depth")).any()
    with pytest.warns(UserWarning, match=NOTHING_SHINES):
        renderer.render(1, camera=CAMERA).save(tmp_path / "black.exr", aovs=[])


def test_of_a_scene_without_anything_that_is_gone_when_the_picture_is_looked_at(device):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        pica.Renderer(pica.Scene(), size=SIZE, settings=settings(), device=device).render(1).display  # noqa: B018
    assert ["the camera sees hardly any surface" in str(warning.message) for warning in caught] == [True]
