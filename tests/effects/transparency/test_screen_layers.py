"""Blended surfaces without rays: the nearest ones of each pixel, sorted, and those behind them by chance."""

import itertools

import numpy as np
import pytest

import pica
from pica.quality.picture_errors import compare
from pica.scene.light import DirectionalLight, PointLight
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import aim, move
from tests.building import converged, lambert, placed, render, scene_of, settings, shining, uniform
from tests.effects.transparency.test_layers import ABOVE, VIEW, in_two_orders, still_life, veil
from tests.effects.transparency.test_transparency import glass
from tests.effects.transparency.trails import trail_of

SCREEN = {"transparency.mode": "screen_space", "visibility.primary": "raster"}
BACKGROUND = np.array((0.4, 0.5, 0.6))
COLORS = np.array([(0.9, 0.1, 0.2), (0.2, 0.8, 0.1), (0.1, 0.3, 0.9), (0.8, 0.8, 0.1)])
ALPHAS = 0.5, 0.25, 0.7, 0.4


def stack(order, distance=0.1):
    """Unlit layers, one over the other in this order from the bottom, and what is seen from above."""
    expected, nodes = BACKGROUND, []
    for place, which in enumerate(order):
        color, alpha = COLORS[which % 4], ALPHAS[which % 4]
        expected = alpha * color + (1 - alpha) * expected
        nodes.append(placed(plane(4, 4, veil(tuple(color), alpha, unlit=True)), move(0, distance * place, 0)))
    return nodes, expected


def test_four_layers_cover_each_other_without_noise_in_every_order(device):
    """One frame, against Porter and Duff's `over`; the scene lists them by colour, whatever their place."""
    for order in itertools.islice(itertools.permutations(range(4)), 0, None, 5):
        nodes, expected = stack(order)
        listed = [nodes[order.index(which)] for which in range(4)]
        picture = render(device, scene_of(*listed, environment=uniform(*BACKGROUND)), 1, ABOVE, (8, 8), SCREEN).color
        np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=2e-3)


def test_layers_behind_four_others_are_met_by_chance(device):
    """Their mean is right, and the four nearest ones bound the noise of a frame."""
    nodes, expected = stack(range(8))
    scene = scene_of(*nodes, environment=uniform(*BACKGROUND))
    one, many = (render(device, scene, count, ABOVE, (16, 16), SCREEN).color for count in (1, 64))
    np.testing.assert_allclose(many.mean((0, 1)), expected, rtol=0.01)
    passing = np.prod([1 - alpha for alpha in ALPHAS])
    assert 0 < np.abs(one - expected).max() <= passing * 1.01


def test_layers_before_and_behind_glass(device):
    """A clear pane that mirrors nothing between two layers."""
    (low, pane, high), _ = stack((0, 1, 2))
    pane.mesh = pica.Mesh([plane(4, 4, glass(thin_walled=True, roughness=0.0, specular=0.0))])
    expected = BACKGROUND
    for which in (0, 2):
        expected = ALPHAS[which] * COLORS[which] + (1 - ALPHAS[which]) * expected
    scene = scene_of(low, pane, high, environment=uniform(*BACKGROUND))
    picture = render(device, scene, 1, ABOVE, (8, 8), SCREEN).color
    np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=5e-3)


@pytest.mark.slow
def test_frames_come_near_the_path_tracer_and_have_less_noise(device):
    scene = scene_of(*still_life(), environment=uniform(0.25, 0.3, 0.4))
    size = (96, 60)
    expected = converged(device, scene, 512, VIEW, size)
    errors = {}
    for mode in ("screen_space", "off"):
        values = pica.Settings.preset("raster").with_values({"transparency.mode": mode})
        with pica.Renderer(scene, size=size, settings=values, device=device) as renderer:
            errors[mode] = [compare(expected, renderer.render(count, camera=VIEW).color).flip for count in (2, 46)]
    assert max(errors["screen_space"]) < 0.18
    assert all(sorted_ < 0.85 * chance for sorted_, chance in zip(*errors.values(), strict=True))


def test_lit_layers_may_be_listed_in_any_order(device):
    assert compare(*in_two_orders(device, 64, SCREEN | {"shadows.mode": "off"})).flip < 0.01


def test_a_layer_that_moves_leaves_no_trail(device):
    assert trail_of(device, veil((0.9, 0.3, 0.2), 0.7), pica.Settings.preset("raster")) < 0.002


def test_scenes_without_blended_surfaces_have_no_pass(device):
    scene = scene_of(placed(sphere(0.5, glass())), environment=uniform(1, 1, 1))
    with pica.Renderer(scene, size=(16, 16), settings=settings(SCREEN), device=device) as renderer:
        renderer.render(1, camera=VIEW)
        names = [entry.name for entry in renderer.graph.passes]
    assert names.count("screen_glass") == names.count("raster_glass") == 4
    assert "screen_layers" not in names


LIGHTS = {
    "sun": shining(DirectionalLight(illuminance=3.0, angular_diameter=0.05), aim((1.0, 1.5, 0), (0, 0, 0))),
    "bulb": shining(PointLight(intensity=9.0, radius=0.1), move(1.6, 2.9, 0)),
}
"""Each from the same side."""


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("alpha", [1.0, 0.5])
def test_layers_lie_in_the_shadows_of_maps(device, light, alpha):
    """A ball and a veil like it, out of the picture, between the light and a veil that is seen from above."""
    seen = placed(plane(2, 2, veil((0.8, 0.7, 0.6), 0.6)), move(0, 0.5, 0))
    blocker = placed(sphere(0.12, lambert() if alpha == 1 else veil((0, 0, 0), alpha), 48), move(0.55, 1.3, 0))
    lamp = shining(LIGHTS[light].light, LIGHTS[light].transform)
    scene = scene_of(seen, blocker, placed(plane(4, 4, lambert(0))), lamp)
    values = SCREEN | {"shadows.method": "maps"}
    picture = in_blocks(render(device, scene, 32, ABOVE, (24, 24), values).color[..., 1])
    expected = in_blocks(converged(device, scene, 256, ABOVE, (24, 24), max_depth=2)[..., 1])
    assert expected.min() < (0.5 if alpha == 1 else 0.8) * expected.max(), "the shadow is in the picture"
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.03)
    assert np.abs(picture - expected).mean() < 0.12 * expected.mean()


def in_blocks(picture):
    """Means of 4x4 pixels: single ones of the reference are noise."""
    return picture.reshape(6, 4, 6, 4).mean((1, 3))
