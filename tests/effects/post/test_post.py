"""Exposure and tone mapping of whole pictures."""

import numpy as np
import pytest

import pica
from pica.scenes.basic_meshes import plane
from tests.building import CAMERA, lambert, placed, scene_of, settings, uniform

SIZE = (24, 16)


def shown(device, brightness, **values):
    scene = scene_of(placed(plane(0.01, 0.01, lambert())), environment=uniform(brightness, brightness, brightness))
    renderer = pica.Renderer(
        scene, size=SIZE, settings=settings({f"post.{k}": str(v) for k, v in values.items()}), device=device
    )
    return renderer.render(2, camera=CAMERA).display


@pytest.mark.parametrize("brightness", [1e-3, 1.0, 1e4])
def test_auto_exposure_brings_any_light_to_middle_grey(device, brightness):
    # Middle grey is 0.18 (Reinhard et al. 2002), 118 in sRGB; the tone mapper leaves it but for a few steps.
    np.testing.assert_allclose(shown(device, brightness), 118, atol=8)


def test_a_stop_more_is_twice_the_light(device):
    light, twice = (shown(device, b, auto_exposure="false") for b in (0.1, 0.2))
    np.testing.assert_allclose(shown(device, 0.1, auto_exposure="false", exposure=1), twice, atol=1)
    assert (twice > light + 10).all()


def test_another_size(device):
    scene = scene_of(placed(plane(0.01, 0.01, lambert())), environment=uniform(1, 1, 1))
    renderer = pica.Renderer(scene, size=SIZE, device=device)
    first = renderer.render(1, camera=CAMERA).display
    renderer.resize((40, 10))
    second = renderer.render(1, camera=CAMERA).display
    assert first.shape == (16, 24, 3) and second.shape == (10, 40, 3)
    assert abs(int(first[0, 0, 0]) - int(second[0, 0, 0])) <= 1
