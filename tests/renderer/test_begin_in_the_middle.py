"""A film that is begun in its middle: `Renderer.reset` with a frame's number."""

import numpy as np
import pytest

import pica
from pica.errors import PicaError
from pica.quality.metrics import flip
from pica.scene.orbit import orbited
from tests.building import CAMERA, SIZE, still_life

FRAMES = 2
UNFILTERED = {
    "antialiasing.mode": "accumulate",
    "debug.filters": False,
    "shadows.denoiser": "off",
    "global_illumination.mode": "off",
}


def camera(number):
    return orbited(CAMERA, np.zeros(3), 0.03 * number)


def film(renderer, first, last, begin):
    renderer.reset(frame=begin * FRAMES)
    for number in range(begin, first):
        renderer.render(FRAMES, camera=camera(number), aovs=())
    return [renderer.render(FRAMES, camera=camera(number), aovs=()).display for number in range(first, last)]


def test_without_histories_it_has_the_same_bits(device):
    settings = pica.Settings().with_values(UNFILTERED)
    with pica.Renderer(still_life(), size=SIZE, settings=settings, device=device) as renderer:
        whole = film(renderer, 0, 6, begin=0)
        for number, (picture, again) in enumerate(zip(whole[4:], film(renderer, 4, 6, begin=3), strict=True)):
            assert np.array_equal(picture, again), f"picture {number + 4} differs"
        other = film(renderer, 4, 5, begin=4)[0]
        renderer.reset()
        renumbered = renderer.render(FRAMES, camera=camera(4), aovs=()).display
        assert np.array_equal(other, whole[4]) and not np.array_equal(renumbered, whole[4])


def test_with_histories_it_looks_the_same(device):
    with pica.Renderer(still_life(), size=SIZE, device=device) as renderer:
        whole = film(renderer, 0, 54, begin=0)
        again = film(renderer, 52, 54, begin=4)
        cold = film(renderer, 52, 54, begin=52)
    errors = [flip(*(picture / 255 for picture in pair))[0] for pair in zip(whole[52:], again, strict=True)]
    unprepared = flip(whole[52] / 255, cold[0] / 255)[0]
    assert max(errors) < min(0.01, unprepared / 2), (errors, unprepared)


@pytest.mark.parametrize("number", [-1, 1.5, 2**31])
def test_impossible_numbers(device, number):
    with pica.Renderer(still_life(), size=SIZE, device=device) as renderer, pytest.raises(PicaError, match="frame"):
        renderer.reset(frame=number)
