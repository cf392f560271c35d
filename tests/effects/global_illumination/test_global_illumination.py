"""Diffuse global illumination against many paths, and how it follows what changes."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.quality.effects import MeasuredEffect
from pica.scene.light import RectangleLight
from pica.scenes.placing import move
from tests.building import settings

SIZE = (96, 64)
ON = {"global_illumination.mode": "path_traced"}


def reflected(frame):
    return frame.aov("indirect")


def direct_and_indirect(device, scene, frames, values=ON):
    renderer = pica.Renderer(scene, SIZE, settings(values), device)
    return renderer, renderer.render(frames)


@pytest.mark.parametrize("name", ["cornell", "court", "rooms"])
def test_a_still_picture_is_that_of_many_paths(device, name):
    """Light of a lamp made of triangles, of a sun, and of a lamp in another room."""
    renderer = pica.Renderer(getattr(pica.scenes, name)(), SIZE, settings(ON), device)
    camera = renderer.scene.default_camera(1.5)
    camera = replace(camera, transform=move(0.013, 0.007, 0) @ camera.transform)  # no pixel's centre is on an edge
    for _ in range(96):
        renderer.advance(camera, jittered=False)
    measured = MeasuredEffect(renderer, "global_illumination")
    found, expected = measured.result()["indirect"], measured.reference(512)["indirect"]
    there = np.isfinite(expected)
    assert found[there].mean() == pytest.approx(expected[there].mean(), rel=0.02)
    white = np.percentile(expected[there], 95)
    error = np.clip(found[there] / white, 0, 1) - np.clip(expected[there] / white, 0, 1)
    assert -10 * np.log10(np.mean(error**2)) > 25  # dB


def test_a_closed_door_keeps_the_light_out(device):
    scene = pica.scenes.rooms(door=0.0)
    _, dark = direct_and_indirect(device, scene, 16)
    beside = pica.Camera.look_at((-1.2, 1.5, 1.8), (-2.4, 1.0, -1.2), fov=75)
    lit = pica.Renderer(scene, SIZE, settings(ON), device).render(16, beside)
    assert lit.color.mean() > 0.1
    assert dark.color.mean() < 0.01 * lit.color.mean()


def test_bounces_are_counted(device):
    """Each more is brighter than the one before, and by less."""
    means = []
    for bounces in range(1, 4):
        values = {**ON, "global_illumination.bounces": str(bounces)}
        means.append(reflected(direct_and_indirect(device, pica.scenes.cornell(), 12, values)[1]).mean())
    steps = np.diff(means)
    assert steps[0] > 0.15 * means[0] and 0 < steps[1] < 0.8 * steps[0]


def test_light_that_changes_is_followed(device):
    """80 % of a step in 20 frames, 95 % in 60, and no more than a tenth too much."""
    scene = pica.scenes.rooms()
    lamp = next(node for node in scene.nodes() if node.light)
    renderer, before = direct_and_indirect(device, scene, 48)
    lamp.light = RectangleLight(radiance=60.0, width=0.8, height=0.8)
    after = [reflected(renderer.render(1)).mean() for _ in range(60)]
    share = (np.array(after) / reflected(before).mean() - 1) / 2
    assert share[19] > 0.8 and share[59] == pytest.approx(1, abs=0.05) and share.max() < 1.1


def test_the_first_frame_has_its_light(device):
    _, first = direct_and_indirect(device, pica.scenes.cornell(), 1)
    _, later = direct_and_indirect(device, pica.scenes.cornell(), 48)
    assert reflected(first).mean() == pytest.approx(reflected(later).mean(), rel=0.05)
    # And what its filter leaves is no noise to speak of: neighbours are alike where the light is.
    inside = np.s_[20:44, 30:66]
    assert np.abs(reflected(first) - reflected(later))[inside].mean() < 0.25 * reflected(later)[inside].mean()
