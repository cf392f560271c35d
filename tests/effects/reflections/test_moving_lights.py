"""Highlights and reflections of what moves follow it."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.light import RectangleLight, SphereLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, shining

SIZE, FRAMES, STEP = (64, 48), 24, 0.05
CAMERA = Camera.look_at((0, 1.2, 4), (0, 0.2, -1), vertical_fov=0.8)
FLOOR_ROWS = slice(28, 46)
"""That show the floor alone."""


def columns_of_moved(device, node, floor, turn, values, frames=1):
    """Light of the floor by column, mean of the last `frames` while `node` goes to the right behind it, and the path
    tracer's of the last place."""
    scene = scene_of(placed(plane(20, 20, floor)), node)
    # Antialiasing has a history of its own.
    given = pica.Settings().with_values({"antialiasing.mode": "accumulate", **values})
    renderer = pica.Renderer(scene, size=SIZE, settings=given, device=device)
    pictures = []
    for number in range(FRAMES):
        node.transform = move(STEP * number - 0.6, 1.2, -2) @ turn
        pictures.append(renderer.render(1, camera=CAMERA, aovs=()).color)
    tracer = pica.PathTracer(scene, size=SIZE, device=device)
    expected = tracer.render(256, camera=CAMERA, aovs=()).color
    return [picture[FLOOR_ROWS].mean(-1).sum(0) for picture in (np.mean(pictures[-frames:], 0), expected)]


def center(columns):
    return (columns * np.arange(len(columns))).sum() / columns.sum()


@pytest.mark.parametrize(
    "light",
    [RectangleLight(radiance=40.0, width=0.2, height=2.0), SphereLight(radiance=40.0, radius=0.2)],
    ids=["strip", "ball"],
)
def test_the_highlight_of_a_light_that_moves_leaves_no_trail(device, light):
    """A strip or a ball over a polished floor, lit by light samples and reflection rays together."""
    strip = shining(light)
    floor = Material(base_color=(0.02, 0.02, 0.02, 1), metallic=0.0, roughness=0.13)
    light, expected = columns_of_moved(device, strip, floor, rotate("y", 180), {"shadows.max_lights": "0"})
    assert center(light) == pytest.approx(center(expected), abs=0.9)
    behind = np.arange(SIZE[0]) < center(expected) - 3
    assert light[behind].sum() < expected[behind].sum() + 0.08 * expected.sum()


def test_a_reflection_follows_what_moves(device):
    """A ball that shines, in a floor that mirrors less than sharply."""
    ball = placed(sphere(0.3, lambert(0, emission=(5.0, 5.0, 5.0))))
    floor = Material(base_color=(0.9, 0.9, 0.9, 1), metallic=1.0, roughness=0.15)
    light, expected = columns_of_moved(device, ball, floor, np.eye(4), {})
    assert center(light) == pytest.approx(center(expected), abs=1.2)


@pytest.mark.parametrize("roughness", [0.13, 0.25])
def test_a_floor_mirrors_thin_lamps_with_all_of_their_light(device, roughness):
    """A neon tube of triangles over a polished floor: few rays of its lobe meet the tube, light samples find it. In so
    few pixels the light of a single frame has a deviation of a sixth."""
    tube = placed(box((2.0, 0.03, 0.03), lambert(0, emission=(30.0, 20.0, 10.0))))
    floor = Material(base_color=(0.02, 0.02, 0.02, 1), metallic=0.0, roughness=roughness)
    light, expected = columns_of_moved(device, tube, floor, np.eye(4), {}, frames=8)
    assert light.sum() == pytest.approx(expected.sum(), rel=0.3)
