"""Bloom: light is scattered, none is made or lost."""

import numpy as np
import pytest

import pica
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import placed, scene_of, settings, uniform

pytestmark = pytest.mark.filterwarnings("ignore:.*nearly black")
VIEW = pica.Camera(np.eye(4))


def plain(brightness: float) -> pica.Material:
    return pica.Material(base_color=(brightness, brightness / 2, brightness / 4, 1.0), unlit=True)


def bloomed(device, size, fraction, ball=0.02, wall=0.0):
    """A bright ball in the middle, with and without bloom: (height, width, 3) both."""
    behind = placed(plane(20, 20, plain(wall)), move(0, 0, -3) @ rotate("x", 90))
    scene = scene_of(placed(sphere(ball, plain(1.0)), move(0, 0, -2)), behind, environment=uniform(wall))
    changed = settings({"post.bloom": str(fraction)})
    renderer = pica.Renderer(scene, size=size, settings=changed, device=device)
    renderer.debug = True
    frame = renderer.render(1, camera=VIEW)
    return frame.color, frame.aov("debug.post.bloom")


@pytest.mark.parametrize("size", [(128, 128), (101, 75)])
def test_the_sum_of_the_light_stays(device, size):
    color, shown = bloomed(device, size, 0.1)
    assert color.sum() > 0
    np.testing.assert_allclose(shown.sum((0, 1)), color.sum((0, 1)), rtol=0.01)


def test_the_fraction_leaves_the_bright_spot_and_falls_off_around_it(device):
    color, shown = bloomed(device, (128, 128), 0.1)
    spot = color[..., 0] > 0
    kept = shown[spot].sum() / color.sum()
    assert 0.9 <= kept < 0.96
    middle = shown[64:, 64, 0][4:60]
    assert (np.diff(middle) <= 0).all() and middle[-1] > 0
    np.testing.assert_allclose(shown[::-1, :, 0].sum(1), shown[..., 0].sum(1), rtol=0.05, atol=1e-4)  # symmetric


def test_an_even_picture_stays_as_it_is(device):
    color, shown = bloomed(device, (40, 30), 0.5, ball=1e-4, wall=0.3)
    np.testing.assert_allclose(shown, color, atol=2e-4)


def test_a_spot_that_moves_does_not_pulsate(device):
    """By less than a pixel a frame: all that the taps add up to is the same wherever it is."""
    sums, peaks = [], []
    for shift in np.linspace(0, 2, 5):
        size = (64, 64)
        half = np.tan(VIEW.vertical_fov / 2) * 2 / size[1] * 2
        scene = scene_of(placed(sphere(0.1, plain(1.0)), move(shift * half, 0, -2)), environment=uniform(0))
        renderer = pica.Renderer(scene, size=size, settings=settings({"post.bloom": "1"}), device=device)
        renderer.debug = True
        frame = renderer.render(1, camera=VIEW)
        sums.append(frame.aov("debug.post.bloom").sum() / frame.color.sum())
        peaks.append(frame.aov("debug.post.bloom").max() / frame.color.sum())
    assert np.ptp(sums) < 0.01 and np.ptp(peaks) / np.mean(peaks) < 0.1


def test_no_pass_without_it(device):
    renderer = pica.Renderer(
        scene_of(placed(sphere(0.1, plain(1.0)))), size=(16, 16), settings=settings(), device=device
    )
    renderer.render(1, camera=VIEW)
    assert [node.name for node in renderer.graph.passes if node.effect == "post"] == [
        "histogram",
        "exposure",
        "tone_map",
    ]
