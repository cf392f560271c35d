"""cluster_visibility.slang: lights that are hidden from a tile are rarely sampled there, and light stays what it is."""

import numpy as np
import pytest

import pica
from pica.light_sampling.light_sampler import _TILE
from pica.scene.light import PointLight
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import move, rotate
from tests.building import lambert, orthographic, placed, render, scene_of, settings, shining

SIZE = 64, 48
ABOVE = orthographic((0, 4, 0), (0, 0, 0), 3.0)
LEARNT = 24
"""Frames after which the counts are full."""


def hidden_lights():
    """A floor below a weak lamp; eight strong ones are behind a screen at its right edge."""
    lamp = shining(PointLight(intensity=1.0), move(-0.5, 1.0, 0))
    strong = [shining(PointLight(intensity=9.0), move(3.0, 1.0, z)) for z in np.linspace(-1.5, 1.5, 8)]
    screen = placed(plane(8, 8, lambert(0.0)), move(2.2, 1.0, 0) @ rotate("z", 90), "screen")
    return scene_of(placed(plane(4, 4, lambert(0.8))), screen, lamp, *strong)


def renderer_of(device, scene):
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({"shadows.max_lights": "0"}), device=device)
    renderer.debug = True
    return renderer


def frame(renderer, camera=ABOVE):
    """Which part of the samples is visible, and the mean light that they bring, without filters."""
    raw = "debug.stochastic_light.diffuse.raw"
    picture = renderer.render(1, camera=camera, aovs=("shadows", raw))
    return picture.aov("shadows")[..., -1].mean(), picture.aov(raw).mean()


def learn(renderer):
    for _ in range(LEARNT):
        renderer.advance(ABOVE)


def test_hidden_lights_are_rarely_sampled(device):
    with renderer_of(device, hidden_lights()) as renderer:
        first, _ = frame(renderer)
        learn(renderer)
        assert first < 0.2 and np.mean([frame(renderer)[0] for _ in range(8)]) > 0.5
        renderer.reset()
        assert frame(renderer)[0] == pytest.approx(first, abs=0.05)


def test_the_mean_is_that_of_samples_that_know_nothing(device):
    known, unknown = (
        render(device, hidden_lights(), 128, ABOVE, SIZE, {"shadows.max_lights": "0", "debug.filters": filters})
        for filters in ("true", "false")
    )
    assert known.color.mean() == pytest.approx(unknown.color.mean(), rel=0.01)


def test_what_a_tile_knows_moves_with_its_surfaces(device):
    """By a tile in a frame: the left column of tiles has come into sight."""
    with renderer_of(device, hidden_lights()) as renderer:
        learn(renderer)
        step = _TILE * 3.0 / SIZE[1]
        moved, _ = frame(renderer, orthographic((-step, 4, 0), (-step, 0, 0), 3.0))
        assert moved > 0.45


def test_the_light_of_what_comes_into_sight_is_right_at_once(device):
    """Whatever earlier samples have told: noisier for some frames, but neither darker nor brighter in their mean."""
    scene = hidden_lights()
    screen = next(node for node in scene.nodes() if node.name == "screen")
    with renderer_of(device, scene) as renderer:
        learn(renderer)
        _, hidden = frame(renderer)
        screen.transform = move(0, -9, 0)
        lit = [frame(renderer)[1] for _ in range(40)]
        assert np.mean(lit[:8]) == pytest.approx(np.mean(lit[32:]), rel=0.03) and lit[0] > 4 * hidden
