"""Reprojection, seen through the history that shadows keep."""

import math

import numpy as np

import pica
from pica.scene.light import DirectionalLight
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import lambert, orthographic, placed, scene_of, settings, shining, uniform

SIZE = (64, 48)
PIXEL = 2.0 / SIZE[1]
"""Metres, under the camera below."""


def above(x=0.0):
    """Two metres of floor from the lower to the upper edge."""
    return orthographic((x, 4, 0), (x, 0, 0), 2.0)


def floor_and(*nodes):
    sun = DirectionalLight(illuminance=2.0, angular_diameter=math.radians(3))
    return scene_of(placed(plane(20, 20, lambert())), *nodes, shining(sun, rotate("x", -80)))


def renderer_of(device, scene):
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({"shadows.denoiser": "svgf"}), device=device)
    renderer.debug = True
    return renderer


def history(frame):
    return frame.aov("debug.shadows.history")[..., 0]


def test_history_moves_with_the_camera_and_begins_where_nothing_was_seen(device):
    renderer = renderer_of(device, floor_and())
    renderer.render(5, camera=above())
    seen = history(renderer.render(1, camera=above(6 * PIXEL)))
    assert (seen[:, :58] == 6).all()
    # A pixel next to what was seen takes its neighbour's, as at edges, and trusts it less where the shadow is sharp.
    assert (seen[:, 58] > 1).all() and (seen[:, 58] <= 6).all()
    assert (seen[:, 59:] == 1).all()


def test_what_an_object_uncovers_begins_anew_and_the_object_takes_its_history_along(device):
    thing = placed(box((0.5, 0.2, 0.5), lambert()), move(0, 0.1, 0), "thing")
    renderer = renderer_of(device, floor_and(thing))
    renderer.render(5, camera=above())
    thing.transform = move(8 * PIXEL, 0, 0) @ thing.transform
    seen = history(renderer.render(1, camera=above()))
    # The box covered columns 26 to 37 and covers 34 to 45 now, in the same rows; its sides cannot be seen from here.
    assert (seen[20:28, 27:33] == 1).all(), "uncovered floor"
    assert (seen[20:28, 36:44] == 6).all(), "the box"
    assert (seen[20:28, 50:] == 6).all() and (seen[:10] == 6).all(), "floor that was seen all the time"


def test_another_object_at_the_same_place_has_no_history(device):
    """Same plane, same normal: only the id tells."""
    first, second = (placed(box((0.5, 0.2, 0.5), lambert()), move(x, 0.1, 0)) for x in (0, 5))
    scene = floor_and(first, second)
    renderer = renderer_of(device, scene)
    renderer.render(5, camera=above())
    first.transform, second.transform = second.transform, first.transform
    seen = history(renderer.render(1, camera=above()))
    assert (seen[20:28, 28:36] == 1).all() and (seen[:10] == 6).all()


def test_only_the_history_of_what_moves_is_bounded(device):
    """A fan must not keep the wall on the other side of the room from converging."""
    thing = placed(box((0.5, 0.2, 0.5), lambert()), move(-0.2, 0.1, 0), "thing")
    renderer = renderer_of(device, floor_and(thing))
    for _ in range(14):
        thing.transform = move(0.5 * PIXEL, 0, 0) @ thing.transform
        seen = history(renderer.render(1, camera=above()))
    # By the end the box covers columns 28 to 39.
    assert seen[20:28, 30:38].max() == renderer.settings.shadows.history
    assert (seen[:10] == 14).all() and (seen[:, 54:] == 14).all()
    assert np.median(history(renderer.render(6, camera=above()))[20:28, 30:38]) == renderer.settings.shadows.history + 6


def test_noisy_light_and_occlusion_keep_the_history_of_what_stands_still(device):
    thing = placed(box((0.5, 0.2, 0.5), lambert()), move(-0.3, 0.1, 0), "thing")
    scene = scene_of(placed(plane(20, 20, lambert())), thing, environment=uniform(0.6, 0.5, 0.4))
    renderer = pica.Renderer(
        scene, size=SIZE, settings=settings({"ambient_occlusion.mode": "ray_traced"}), device=device
    )
    renderer.debug = True
    for _ in range(36):
        thing.transform = move(0.5 * PIXEL, 0, 0) @ thing.transform
        frame = renderer.render(1, camera=above())
    # By the end the box covers columns 37 to 48.
    for name, bound in (("stochastic_light.diffuse", 16), ("ambient_occlusion", 32)):
        seen = frame.aov(f"debug.{name}.history")
        assert seen[20:28, 39:46].max() == bound, name
        # The sky is even, so that nothing tells of change where the box is far.
        assert np.median(seen[:6]) > 35 and np.median(seen[:, :6]) > 35, name


def test_a_light_that_changes_bounds_all_histories(device):
    renderer = renderer_of(device, floor_and())
    sun = next(node for node in renderer.scene.nodes() if node.light)
    for angle in range(14):
        sun.transform = rotate("x", -80 + 0.01 * angle)
        seen = history(renderer.render(1, camera=above()))
    assert seen.max() == renderer.settings.shadows.history
