"""The exposure over time."""

import math
from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import move, rotate
from tests.building import CAMERA, lambert, placed, scene_of, settings, sky, still_life, uniform

SPEEDS = {"post.adaptation_up": "1", "post.adaptation_down": "4", "post.tone_map": "linear"}


@pytest.fixture(scope="module")
def renderer(device):
    scene = scene_of(placed(plane(0.01, 0.01, lambert())), environment=uniform(1, 1, 1))
    return pica.Renderer(scene, size=(24, 16), settings=settings(SPEEDS), device=device)


def stops(renderer, brightness, **values):
    """Of the exposure, from a picture of even brightness below white."""
    renderer.scene.environment = uniform(brightness, brightness, brightness)
    frame = renderer.render(values.pop("frames", 1), camera=values.pop("camera", CAMERA), **values)
    encoded = frame.display[0, 0, 0] / 255
    assert 0.02 < encoded < 0.99
    return math.log2(((encoded + 0.055) / 1.055) ** 2.4 / brightness)


GREY = math.log2(0.18)
BIN = 40 / 128  # stops of the histogram


def test_it_follows_at_its_speeds(renderer):
    dark = stops(renderer, 0.25, cut=True)
    light = stops(renderer, 1.0, cut=True)
    assert light == pytest.approx(GREY, abs=BIN) and dark == pytest.approx(GREY + 2, abs=BIN)
    assert stops(renderer, 0.25, seconds=0.5) == pytest.approx(light + 0.5, abs=0.05)
    assert stops(renderer, 0.25, seconds=0.5) == pytest.approx(light + 1, abs=0.05)
    assert stops(renderer, 0.25, seconds=3.0) == pytest.approx(dark, abs=0.05)
    assert stops(renderer, 1.0, seconds=0.25) == pytest.approx(dark - 1, abs=0.05)
    assert stops(renderer, 1.0, seconds=1.0) == pytest.approx(light, abs=0.05)


def test_frames_of_one_picture_take_no_time(renderer):
    light = stops(renderer, 1.0, cut=True)
    assert stops(renderer, 0.25, seconds=0.5, frames=4) == pytest.approx(light + 0.5, abs=0.05)


@pytest.mark.parametrize("values", [{}, {"seconds": 0.1, "cut": True}])
def test_it_is_at_once_without_times_and_after_a_reset(renderer, values):
    stops(renderer, 1.0, cut=True)
    assert stops(renderer, 0.25, **values) == pytest.approx(GREY + 2, abs=BIN)


@pytest.mark.parametrize("seconds", [-1, float("nan"), "1"])
def test_wrong_times_are_refused(renderer, seconds):
    with pytest.raises(pica.PicaError, match="render: seconds: "):
        renderer.render(1, camera=CAMERA, seconds=seconds)


def test_it_is_at_once_by_default(renderer):
    renderer.configure(settings({"post.tone_map": "linear"}))
    stops(renderer, 1.0, cut=True)
    assert stops(renderer, 0.25, seconds=0.1) == pytest.approx(GREY + 2, abs=BIN)
    renderer.configure(settings(SPEEDS))


def test_a_cut_that_is_found_adapts_at_once(device):
    """From a bright wall to a dark one behind the camera."""

    def unlit(brightness):
        return pica.Material(base_color=(brightness, brightness, brightness, 1.0), unlit=True)

    scene = scene_of(
        placed(plane(9, 9, unlit(0.8)), move(0, 0, -2) @ rotate("x", 90)),
        placed(plane(9, 9, unlit(0.1)), move(0, 0, 2) @ rotate("x", -90)),
    )
    renderer = pica.Renderer(scene, size=(24, 16), settings=settings(SPEEDS), device=device)
    ahead, back = (pica.Camera.look_at((0, 0, 0), (0, 0, z)) for z in (-1, 1))
    first = renderer.render(1, camera=ahead, seconds=0.1).display.mean()
    second = renderer.render(1, camera=back, seconds=0.1).display.mean()
    assert first == pytest.approx(second, abs=12)


def test_the_light_is_the_same_while_it_adapts(device):
    """Antialiasing and global illumination are guided by the exposure. When light gets 16 times as bright, an exposure
    that is 4 stops off shows the same radiance as one that follows, but for noise."""

    def brightened(seed, seconds):
        scene = scene_of(*list(still_life().nodes())[:3], environment=sky())
        values = {"post.adaptation_up": 1, "post.adaptation_down": 1, "seed": seed}
        renderer = pica.Renderer(scene, size=(64, 48), settings=pica.Settings().with_values(values), device=device)
        scene.environment = replace(scene.environment, strength=1 / 16)
        renderer.render(2, camera=CAMERA)
        scene.environment = replace(scene.environment, strength=1.0)
        pictures = [renderer.render(1, camera=CAMERA, seconds=seconds) for _ in range(6)]
        return np.mean([picture.color for picture in pictures[2:]], 0), pictures[-1].display.mean()

    (follows, shown), (stays, overexposed), (other, _) = (brightened(0, None), brightened(0, 0.0), brightened(1, None))
    assert overexposed > shown + 50
    assert stays.mean() == pytest.approx(follows.mean(), rel=0.012)  # .9 to 1.1 % less by seed
    noise = np.abs(other - follows).mean()
    assert np.abs(stays - follows).mean() < 1.2 * noise
