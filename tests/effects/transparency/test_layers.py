"""Layers of blended surfaces: their alpha is no noise, and their light is that of the path tracer."""

import itertools
import math

import numpy as np
import pytest

import pica
from pica.quality.picture_errors import compare
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.material import AlphaMode, Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import (
    assert_schedulers_agree,
    lambert,
    leaves,
    orthographic,
    placed,
    render,
    scene_of,
    settings,
    shining,
    uniform,
)
from tests.effects.transparency.at_rest_and_in_motion import errors
from tests.effects.transparency.trails import trail_of

WAYS = pytest.mark.parametrize("primary", ["raster", "rays"])
VIEW = Camera.look_at((0.5, 1.0, 2.6), (0, 0.35, 0), vertical_fov=math.radians(35))
ABOVE = orthographic((0, 3, 0), (0, 0, 0), 0.5)


def veil(color, alpha: float, **more) -> Material:
    values = {"metallic": 0.0, "roughness": 1.0, "alpha_mode": AlphaMode.BLEND, "double_sided": True}
    return Material(base_color=(*color, alpha), **{**values, **more})


@WAYS
def test_layers_cover_each_other_without_noise(device, primary):
    """One frame of unlit layers, in every order, against Porter and Duff's `over`."""
    layers = [((0.9, 0.1, 0.2), 0.5), ((0.2, 0.8, 0.1), 0.25), ((0.1, 0.3, 0.9), 0.7)]
    background = np.array((0.4, 0.5, 0.6))
    for order in itertools.permutations(range(3)):
        expected = background
        for which in order:
            color, alpha = layers[which]
            expected = alpha * np.array(color) + (1 - alpha) * expected
        nodes = [
            placed(plane(4, 4, veil(*layers[which], unlit=True)), move(0, 0.3 * order.index(which), 0))
            for which in range(3)
        ]
        scene = scene_of(*nodes, environment=uniform(*background))
        picture = render(device, scene, 1, ABOVE, (8, 8), {"visibility.primary": primary}).color
        np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=2e-3)


def in_two_orders(device, frames, values):
    """Pictures of three lit veils that are listed in another order."""
    pictures = []
    for order in ((0, 1, 2), (2, 0, 1)):
        veils = [
            placed(plane(1.2, 0.9, veil(color, 0.4)), move(0.1 * row, 0.5, 0.3 * row) @ rotate("x", 75 + 10 * row))
            for row, color in enumerate(((0.9, 0.5, 0.3), (0.4, 0.9, 0.8), (0.7, 0.7, 0.95)))
        ]
        floor = placed(plane(4, 4, lambert(0.5, 0.4, 0.3)))
        scene = scene_of(floor, *(veils[which] for which in order), environment=uniform(0.5, 0.6, 0.7))
        pictures.append(render(device, scene, frames, VIEW, (32, 20), values).color)
    return pictures


def test_lit_layers_may_be_listed_in_any_order(device):
    pictures = in_two_orders(device, 96, {})
    assert compare(*pictures).flip < 0.03  # noise of shadows
    assert pictures[0].mean() == pytest.approx(pictures[1].mean(), rel=0.005)


def still_life() -> tuple:
    """Veils one behind the other, of which one is a ball, one mirrors, and one has ragged holes; glass between them."""
    clear = Material(metallic=0.0, roughness=0.0, transmission=1.0, thin_walled=False)
    return (
        placed(plane(5, 5, lambert(0.6, 0.55, 0.5))),
        placed(plane(5, 3, lambert(0.3, 0.45, 0.7)), move(0, 1.5, -1.2) @ rotate("x", 90)),
        placed(box((0.3, 0.5, 0.3), lambert(0.8, 0.3, 0.2)), move(0.1, 0.25, -0.6)),
        placed(sphere(0.3, veil((0.9, 0.6, 0.2), 0.5), 48), move(-0.5, 0.36, 0)),
        placed(sphere(0.2, clear, 48), move(0.05, 0.21, 0.2)),
        placed(plane(0.7, 0.7, veil((0.2, 0.3, 0.25), 0.3, roughness=0.0)), move(-0.3, 0.5, 0.6) @ rotate("x", 80)),
        placed(plane(0.5, 0.5, leaves(AlphaMode.BLEND)), move(0.5, 0.4, 0.3) @ rotate("x", 80)),
        placed(plane(0.6, 0.5, veil((0.8, 0.8, 0.8), 0.4)), move(0.4, 0.4, -0.2) @ rotate("x", 85)),
        shining(DirectionalLight(illuminance=1.5, angular_diameter=0.05), aim((-1, 2, 1.5), (0, 0, 0))),
    )


def test_default_frames_come_near_the_path_tracer_at_rest_and_in_motion(device):
    scene = scene_of(*still_life(), environment=uniform(0.25, 0.3, 0.4))
    at_rest, in_motion = errors(device, scene, VIEW, samples=512)
    assert at_rest < 0.06
    assert in_motion < 0.09


@pytest.mark.slow
def test_schedulers_agree(device):
    """A pipeline's camera rays mark the pixels with layers and glass; for other schedulers a raster pass draws them."""
    assert_schedulers_agree(device, lambda: scene_of(*still_life(), environment=uniform(0.25, 0.3, 0.4)))


def test_a_layer_that_moves_leaves_no_trail(device):
    assert trail_of(device, veil((0.9, 0.3, 0.2), 0.7), pica.Settings()) < 0.002


@WAYS
def test_the_gbuffer_has_nearly_opaque_points_alone(device, primary):
    wall = placed(plane(4, 4, lambert(0.5)), move(0, 0, -2) @ rotate("x", 90), "wall")
    faint = placed(plane(1, 1, veil((1, 1, 1), 0.5)), move(-0.6, 0, 0) @ rotate("x", 90), "faint")
    full = placed(plane(1, 1, veil((1, 1, 1), 1.0)), move(0.6, 0, 0) @ rotate("x", 90), "full")
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(20))
    scene = scene_of(wall, faint, full)
    renderer = pica.Renderer(scene, size=(32, 16), settings=settings({"visibility.primary": primary}), device=device)
    ids = renderer.labels(camera=camera, aovs=["instance"]).aov("instance")
    assert set(np.unique(ids)) == {1, 3}
    assert (ids[:, 24:] == 3).any() and not (ids[:, :8] == 3).any()


def test_layers_follow_edits_of_materials(device):
    material = veil((1, 0, 0), 0.5, unlit=True)
    scene = scene_of(placed(plane(4, 4, material)), environment=uniform(0, 0, 1))
    with pica.Renderer(scene, size=(8, 8), settings=settings(), device=device) as renderer:
        for mode, expected in ((AlphaMode.BLEND, 0.5), (AlphaMode.OPAQUE, 1.0), (AlphaMode.BLEND, 0.5)):
            material.alpha_mode = mode
            renderer.reset()
            assert renderer.render(1, camera=ABOVE).color[..., 0].mean() == pytest.approx(expected, rel=0.01)
