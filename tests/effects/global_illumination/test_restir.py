"""Paths reused over frames and between neighbours: as bright as plain ones, with less noise, and soon forgotten."""

import numpy as np
import pytest

import pica
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from tests.building import lambert, placed, scene_of, settings

SIZE = (64, 36)
RESTIR = {"global_illumination.mode": "restir", "global_illumination.bounces": "2"}
UNFILTERED = RESTIR | {"debug.filters": "false"}
PLAIN = UNFILTERED | {"global_illumination.mode": "path_traced"}
RAW = "debug.global_illumination.raw"


def closed_box():
    """Grey walls that shine, seen from within."""
    inside = pica.Camera.look_at((0.9, 0.3, 1.2), (-1, -0.2, -1), vertical_fov=np.radians(75))
    return scene_of(placed(box((4, 3, 5), lambert(0.5, emission=(1.0, 1.0, 1.0), double_sided=True)))), inside


def renderer_of(device, scene, values):
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    renderer.debug = True
    return renderer


def lights(renderer, frames, camera=None):
    """(frames, height, width, 3) indirect light in each."""
    return np.array([renderer.render(1, camera=camera).aov("diffuse_indirect") for _ in range(frames)])


def test_a_closed_box_is_as_bright_as_its_series_says(device):
    """Light of one reflection more each, of walls that reflect half: 1/4 + 1/8."""
    scene, camera = closed_box()
    found = lights(renderer_of(device, scene, UNFILTERED), 64, camera)
    assert found.mean() == pytest.approx(0.375, rel=0.01)


def test_light_through_a_door_is_that_of_plain_paths(device):
    """Many ends of neighbours' paths are out of a pixel's sight there: without the rays that tell it is 2.7 % off. Both
    modes trace the same paths."""
    found, expected = (
        lights(renderer_of(device, pica.scenes.rooms(), values), 128).mean() for values in (UNFILTERED, PLAIN)
    )
    assert found == pytest.approx(expected, rel=0.015)


def test_paths_follow_what_moves_with_both_their_ends(device):
    """Steps of a quarter of a metre of all that there is."""

    def found(values):
        scene = pica.scenes.court()
        renderer = renderer_of(device, scene, values)
        camera = scene.default_camera(16 / 9)
        court = next(node for node in scene.nodes() if node.name == "court")
        total = 0.0
        for frame in range(32):
            court.transform = move(0.25 * (frame % 2), 0, 0.25 * (frame // 2 % 2))
            total += lights(renderer, 1, camera).mean()
        return total

    assert found(UNFILTERED) == pytest.approx(found(PLAIN), rel=0.03)


def test_reuse_cuts_the_variance(device):
    def errors(values):
        renderer = renderer_of(device, pica.scenes.cornell(), values)
        frames = np.array([renderer.render(1).aov(RAW).mean(-1) for _ in range(48)])[8:]
        return ((frames - frames.mean(0)) ** 2).mean()

    found, expected = errors(UNFILTERED), errors(PLAIN)
    assert found < expected / 2, found / expected


@pytest.mark.parametrize(("values", "frames", "left"), [(UNFILTERED, 1, 1e-6), (RESTIR, 12, 0.15)])
def test_the_glow_of_a_lamp_that_goes_out_goes_with_it(device, values, frames, left):
    """Paths forget it at once, the history after them in a few frames."""
    scene = pica.scenes.rooms()
    renderer = renderer_of(device, scene, values)
    lit = lights(renderer, 24)[-1].mean()
    lamp = next(node for node in scene.nodes() if node.light)
    scene.remove(lamp)
    assert lit > 0.01 and lights(renderer, frames)[-1].mean() < left * lit


def test_a_closing_door_is_followed(device):
    """No light changes by itself, but paths are kept for two frames."""
    scene = pica.scenes.rooms()
    renderer = renderer_of(device, scene, UNFILTERED)
    lit = lights(renderer, 6)[-3:].mean()
    closed = {node.name: node.transform for node in pica.scenes.rooms(door=0.0).nodes()}
    for node in scene.nodes():
        node.transform = closed[node.name]
    assert lights(renderer, 12)[-1].mean() < 0.02 * lit


def test_after_a_cut_all_are_numbers(device):
    """With enough bounces that a new renderer, whose radiance cache is empty, has the same light."""
    values = RESTIR | {"global_illumination.bounces": "8"}
    renderer = renderer_of(device, pica.scenes.court(), values)
    lights(renderer, 3)
    elsewhere = pica.Camera.look_at((-2, 3, -3), (2, 0, 3), vertical_fov=np.radians(80))
    after = lights(renderer, 8, elsewhere)
    fresh = lights(renderer_of(device, pica.scenes.court(), values), 8, elsewhere)
    assert np.isfinite(after).all() and after.mean() == pytest.approx(fresh.mean(), rel=0.1)


def test_what_moves_leaves_no_trail(device):
    """Nor the light that it sent where it was."""
    scene = pica.scenes.court()
    renderer = renderer_of(device, scene, UNFILTERED)
    ball = next(node for node in scene.nodes() if node.name == "ball 3")
    number = [node.name for node in scene.nodes()].index("ball 3") + 1
    was = renderer.render(3).aov("instance") == number
    ball.transform = move(0, 1.5, 0) @ ball.transform
    after = lights(renderer, 24)[4:].mean(0)
    fresh = lights(renderer_of(device, scene, PLAIN), 24)[4:].mean(0)
    assert was.sum() > 40
    assert after[was].mean() == pytest.approx(fresh[was].mean(), rel=0.15)
