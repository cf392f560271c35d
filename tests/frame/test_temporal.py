"""Reprojection, seen through the history that shadows keep."""

import math

import numpy as np

import pica
from pica.scene.light import DirectionalLight
from pica.scene.procedural.placing import move, turn
from pica.scene.procedural.primitives import box, plane
from tests.building import lambert, orthographic, placed, scene_of, settings, shining

SIZE = (64, 48)
PIXEL = 2.0 / SIZE[1]
"""Metres, under the camera below."""


def above(x=0.0):
    """Two metres of floor from the lower to the upper edge."""
    return orthographic((x, 4, 0), (x, 0, 0), 2.0)


def floor_and(*nodes):
    sun = DirectionalLight(illuminance=2.0, angular_diameter=math.radians(3))
    return scene_of(placed(plane(20, 20, lambert())), *nodes, shining(sun, turn("x", -80)))


def renderer_of(device, scene):
    renderer = pica.Renderer(scene, SIZE, settings({"shadows.denoiser": "svgf"}), device)
    renderer.debug = True
    return renderer


def history(frame):
    return frame.aov("debug.shadows.history")[..., 0]


def test_history_moves_with_the_camera_and_begins_where_nothing_was_seen(device):
    renderer = renderer_of(device, floor_and())
    renderer.render(5, above())
    seen = history(renderer.render(1, above(6 * PIXEL)))
    assert (seen[:, :58] == 6).all()
    # A pixel next to what was seen takes its neighbour's, as at edges, and trusts it less where the shadow is sharp.
    assert (seen[:, 58] > 1).all() and (seen[:, 58] <= 6).all()
    assert (seen[:, 59:] == 1).all()


def test_what_an_object_uncovers_begins_anew_and_the_object_takes_its_history_along(device):
    thing = placed(box((0.5, 0.2, 0.5), lambert()), move(0, 0.1, 0), "thing")
    renderer = renderer_of(device, floor_and(thing))
    renderer.render(5, above())
    thing.transform = move(8 * PIXEL, 0, 0) @ thing.transform
    seen = history(renderer.render(1, above()))
    # The box covered columns 26 to 37 and covers 34 to 45 now, in the same rows; its sides cannot be seen from here.
    assert (seen[20:28, 27:33] == 1).all(), "uncovered floor"
    assert (seen[20:28, 36:44] == 6).all(), "the box"
    assert (seen[20:28, 50:] == 6).all() and (seen[:10] == 6).all(), "floor that was seen all the time"


def test_another_object_at_the_same_place_has_no_history(device):
    """Same plane, same normal: only the id tells."""
    first, second = (placed(box((0.5, 0.2, 0.5), lambert()), move(x, 0.1, 0)) for x in (0, 5))
    scene = floor_and(first, second)
    renderer = renderer_of(device, scene)
    renderer.render(5, above())
    first.transform, second.transform = second.transform, first.transform
    seen = history(renderer.render(1, above()))
    assert (seen[20:28, 28:36] == 1).all() and (seen[:10] == 6).all()


def test_history_is_bounded_while_something_moves(device):
    thing = placed(box(0.2, lambert()), move(0.7, 0.1, 0.7), "thing")
    renderer = renderer_of(device, floor_and(thing))
    for _ in range(14):
        thing.transform = move(1e-5, 0, 0) @ thing.transform
        seen = history(renderer.render(1, above()))
    assert seen.max() == renderer.settings.shadows.history
    assert np.median(history(renderer.render(6, above()))) == renderer.settings.shadows.history + 6
