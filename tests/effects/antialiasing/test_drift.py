"""The history of what moves stays in its place: a picture in motion is not displaced."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.orbit import orbited
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from tests.building import placed, scene_of
from tests.effects.antialiasing.test_antialiasing import unlit

SIZE = (120, 68)
START = Camera.look_at((0, 1.5, 4), (0, 0, 0))


@pytest.fixture(scope="module")
def renderer(device):
    """Flat bars on a floor that slopes away from the camera: points move the slower, the farther they are."""
    bars = [placed(box((0.25, 0.002, 5), unlit(1, 1, 1)), move(x, 0, 0)) for x in np.arange(-2, 2.1, 0.5)]
    scene = scene_of(placed(box((30, 0.001, 30), unlit(0.2, 0.2, 0.2))), *bars)
    with pica.Renderer(scene, size=SIZE, settings=pica.Settings.preset("raster"), device=device) as renderer:
        yield renderer


@pytest.mark.parametrize("degrees", [2, -2])
def test_a_floor_stays_in_its_place_when_the_camera_goes_round_it(renderer, degrees):
    """By how many pixels, from a fit of the difference to the slopes of the picture at rest."""
    renderer.reset()
    still = renderer.render(64, camera=START).color.mean(axis=-1)
    moving = np.zeros_like(still)
    for first in range(-12, -4):
        renderer.reset()
        for frame in range(first, 1):
            picture = renderer.render(1, camera=orbited(START, np.zeros(3), np.radians(degrees * frame)))
        moving += picture.color.mean(axis=-1) / 8
    slopes = np.stack(np.gradient(still)[::-1])[:, 24:-4, 24:-24].reshape(2, -1)
    difference = (moving - still)[24:-4, 24:-24].ravel()
    shift = np.linalg.lstsq(slopes.T, difference, rcond=None)[0]
    assert np.abs(shift).max() < 0.05, shift
