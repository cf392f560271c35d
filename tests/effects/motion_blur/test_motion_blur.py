"""Motion blur, against the mean of path traced pictures of moments within the exposure."""

import math

import numpy as np
import pytest

import pica
from pica.color import srgb_encode
from pica.quality.metrics import flip
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import checkered, placed, scene_of, settings, uniform

SIZE = (160, 90)
MOMENTS = 32
AT = pica.Camera.look_at((0, 0, 4), (0, 0, 0), vertical_fov=math.radians(40))


def plain(red, green, blue, **more) -> pica.Material:
    return pica.Material(base_color=(red, green, blue, 1.0), unlit=True, **more)


def scene() -> pica.Scene:
    """A box in front of a board, with another one before it."""
    board = pica.Texture(checkered(cells=16))
    return scene_of(
        placed(box(0.8, plain(0.9, 0.3, 0.1, base_color_texture=board)), move(0, 0, 0), "box"),
        placed(box(0.5, plain(0.1, 0.2, 0.8)), move(0.8, -0.4, 1), "still"),
        placed(plane(12, 12, plain(0.5, 0.5, 0.5, base_color_texture=board)), move(0, 0, -3) @ rotate("x", 90)),
        environment=uniform(0.2),
    )


def moved(scene, time):
    """The box goes right, by 9 pixels a frame."""
    next(node for node in scene.nodes() if node.name == "box").transform = move(0.3 * time, 0, 0)
    return AT


def turned(_, time):
    """The camera turns, by about 8 pixels a frame."""
    angle = 0.06 * time
    ahead = (math.sin(angle), 0, 4 - math.cos(angle))
    return pica.Camera.look_at((0, 0, 4), ahead, vertical_fov=AT.vertical_fov)


def orbited(scene, time):
    """The camera and the box go in opposite directions."""
    moved(scene, -time)
    return pica.Camera.look_at((0.2 * time, 0, 4), (0, 0, 0), vertical_fov=AT.vertical_fov)


@pytest.fixture(scope="module")
def tracer(device):
    return pica.PathTracer(scene(), size=SIZE, max_depth=1, device=device)


def exposure(tracer, motion, shutter):
    """The mean over the exposure around the time of 1 frame."""
    total = 0
    for moment in (np.arange(MOMENTS) + 0.5) / MOMENTS - 0.5:
        camera = motion(tracer.scene, 1 + moment * shutter)
        total = total + tracer.render(4, camera=camera, aovs=()).color
    return total / MOMENTS


@pytest.fixture(scope="module")
def renderers(device):
    return {
        shutter: pica.Renderer(scene(), size=SIZE, settings=settings({"post.shutter": str(shutter)}), device=device)
        for shutter in (0.0, 1.0)
    }


def film(renderer, motion, frames=8):
    """The second picture of a film."""
    renderer.reset()
    renderer.render(frames, camera=motion(renderer.scene, 0.0), aovs=())
    return renderer.render(frames, camera=motion(renderer.scene, 1.0), aovs=()).color


def distance(expected, found):
    return flip(*(srgb_encode(np.clip(picture, 0, 1)) for picture in (expected, found)))[0]


@pytest.mark.parametrize("motion", [moved, turned, orbited])
def test_the_picture_is_the_mean_over_the_exposure(tracer, renderers, motion):
    expected = exposure(tracer, motion, 1.0)
    blurred, sharp = (film(renderers[shutter], motion) for shutter in (1.0, 0.0))
    assert distance(expected, blurred) < 0.06
    assert distance(expected, blurred) < 0.75 * distance(expected, sharp)
    assert blurred.mean() == pytest.approx(expected.mean(), rel=0.02)


def test_what_stands_still_stays_as_it_is(renderers):
    blurred, sharp = (film(renderers[shutter], lambda *_: AT) for shutter in (1.0, 0.0))
    np.testing.assert_array_equal(blurred, sharp)


def test_it_ends_with_the_motion(renderers):
    film(renderers[1.0], moved)
    again = renderers[1.0].render(8, camera=AT, aovs=()).color
    film(renderers[0.0], moved)
    np.testing.assert_array_equal(again, renderers[0.0].render(8, camera=AT, aovs=()).color)


def test_the_first_picture_and_one_after_a_cut_are_sharp(renderers):
    pictures = []
    for renderer in renderers.values():
        film(renderer, moved)
        away = pica.Camera.look_at((0, 2, -2), (3, 2, -2.1), vertical_fov=AT.vertical_fov)
        pictures.append(renderer.render(2, camera=away, aovs=()).color)
    np.testing.assert_array_equal(*pictures)
