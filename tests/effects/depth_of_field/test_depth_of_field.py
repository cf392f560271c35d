"""Depth of field, of the path tracer against geometry, and of the renderer against the path tracer."""

import math
from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.color import srgb_encode
from pica.quality.metrics import flip
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import placed, scene_of, settings, uniform
from tests.effects.depth_of_field.scene import FOCUS, camera, plain, row

SIZE = (160, 90)


@pytest.fixture(scope="module")
def tracer(device):
    return pica.PathTracer(row(), size=SIZE, max_depth=1, device=device)


@pytest.fixture(scope="module")
def renderer(device):
    return pica.Renderer(row(), size=SIZE, settings=settings(), device=device)


def exposed(picture):
    return srgb_encode(np.clip(picture * 12, 0, 1))


@pytest.mark.parametrize(("f_number", "focus"), [(0.3, FOCUS), (0.6, FOCUS), (0.4, 2.2), (0.4, 7.5)])
def test_the_renderer_shows_what_the_path_tracer_shows(tracer, renderer, f_number, focus):
    """Focus on each ball in turn: no sharp edge leaks into what is behind it, no halo."""
    view = camera(f_number, focus)
    expected = tracer.render(128, camera=view).color
    found, sharp = (renderer.render(16, camera=one).color for one in (view, replace(view, f_number=None)))
    assert flip(exposed(expected), exposed(found))[0] <= 0.06
    assert flip(exposed(expected), exposed(sharp))[0] > 0.08
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01)


def test_what_is_in_focus_is_sharp(renderer):
    view = camera(0.4)
    found, sharp = (renderer.render(1, camera=one, cut=True) for one in (view, replace(view, f_number=None)))
    middle = sharp.aov("instance") == 2  # up to 2 % away from the focus, but for the middle
    for axis, pixels in ((0, 4), (0, -4), (1, 4), (1, -4)):
        middle = middle & np.roll(middle, pixels, axis)
    assert middle.sum() > 50
    error = np.abs(exposed(found.color[middle]) - exposed(sharp.color[middle]))
    assert error.max() < 0.03


@pytest.mark.parametrize(("ball", "wall"), [(0.9, 0.02), (0.02, 0.9)])
def test_an_edge_in_focus_does_not_leak(device, ball, wall):
    """A ball in focus before a wall that is far behind: neither shines into the other."""
    scene = scene_of(
        placed(sphere(0.5, plain(ball, ball, ball)), move(0, 0, -4)),
        placed(plane(60, 60, plain(wall, wall, wall)), move(0, 0, -12) @ rotate("x", 90)),
    )
    view = pica.Camera(np.eye(4), f_number=0.2, focus_distance=4.0, sensor_height=0.1)
    size = (96, 96)
    traced = pica.PathTracer(scene, size=size, max_depth=1, device=device).render(256, camera=view)
    found = pica.Renderer(scene, size=size, settings=settings(), device=device).render(16, camera=view)
    rows, columns = np.mgrid[:96, :96] + 0.5 - 48
    radius = np.hypot(rows, columns)
    edge = math.sqrt((traced.aov("instance") == 1).sum() / math.pi)
    for low, high, most in ((-6, -2, 0.002), (1, 2.5, 0.025), (2.5, 6, 0.004)):
        ring = (radius > edge + low) & (radius < edge + high)
        difference = found.color[ring] - traced.color[ring]
        assert np.abs(difference).mean() < most, (low, high)


@pytest.mark.parametrize("beyond", [2.5, 4.0, 12.0])
def test_an_edge_in_front_of_the_focus_spreads_over_what_is_behind(device, beyond):
    """Over what is in front of the focus too, in it, and beyond."""
    scene = scene_of(
        placed(plane(12, 12, plain(0.9, 0.9, 0.9)), move(-6, 0, -2) @ rotate("x", 90)),
        placed(plane(160, 160, plain(0.1, 0.1, 0.1)), move(0, 0, -beyond) @ rotate("x", 90)),
    )
    view = pica.Camera(np.eye(4), f_number=0.5, focus_distance=4.0, sensor_height=0.1)
    size = (96, 96)
    traced = pica.PathTracer(scene, size=size, max_depth=1, device=device).render(256, camera=view)
    found = pica.Renderer(scene, size=size, settings=settings(), device=device).render(16, camera=view)
    expected, profile = (frame.color[..., 0].mean(0)[44:52] for frame in (traced, found))
    assert np.abs(profile - expected).mean() < 0.045
    assert profile[4] > 0.2


@pytest.mark.parametrize("blades", [0, 3, 6])
@pytest.mark.parametrize("distance", [2.0, 8.0])
def test_a_point_of_light_shows_the_aperture(device, blades, distance):
    """A small bright ball in front of the focus and beyond, in both renderers: where, how large, which shape."""
    scene = scene_of(
        placed(sphere(0.004 * distance, plain(1, 1, 1)), move(0, 0, -distance)),
        placed(plane(40, 40, plain(0, 0, 0)), move(0, 0, -distance - 0.02) @ rotate("x", 90)),
    )
    fov, focus, size = math.radians(40), 4.0, (96, 96)
    f_number = 0.25 if distance < focus else 0.125
    lens = {"f_number": f_number, "focus_distance": focus, "sensor_height": 0.1, "aperture_blades": blades}
    view = pica.Camera(np.eye(4), vertical_fov=fov, **lens)
    radius = view.aperture_radius * abs(1 / focus - 1 / distance) * size[1] / (2 * math.tan(fov / 2))
    assert 4 < radius < 20
    traced = pica.PathTracer(scene, size=size, max_depth=1, device=device).render(1024, camera=view).color[..., 0]
    found = pica.Renderer(scene, size=size, settings=settings(), device=device).render(8, camera=view).color[..., 0]
    rows, columns = np.mgrid[: size[1], : size[0]] + 0.5 - size[0] / 2
    # Moments of the regular polygon; a triangle's third about the axis that its corner is not on.
    second = radius**2 * (0.5 if blades == 0 else (2 + math.cos(2 * math.pi / blades)) / 6)
    for light in (traced / traced.sum(), found / found.sum()):
        np.testing.assert_allclose([(light * rows).sum(), (light * columns).sum()], 0, atol=0.5)
        assert (light * (rows**2 + columns**2)).sum() == pytest.approx(second, rel=0.25 if blades == 3 else 0.12)
        third = (light * rows**3).sum() / radius**3
        if blades == 3:  # a corner on top, beyond the focus; upside down in front of it
            assert third * (-1 if distance > focus else 1) == pytest.approx(0.025, abs=0.012)
        else:
            assert abs(third) < 0.024
    assert found.sum() == pytest.approx(traced.sum(), rel=0.1)


def test_alpha_is_blurred_with_the_picture(device):
    scene = scene_of(
        placed(plane(1, 1, plain(0.5, 0.5, 0.5)), move(0, 0, -2) @ rotate("x", 90)), environment=uniform(1)
    )
    view = pica.Camera(np.eye(4), f_number=0.5, focus_distance=6.0, sensor_height=0.1)
    changed = settings({"visibility.background": "transparent"})
    frame = pica.Renderer(scene, size=(64, 64), settings=changed, device=device).render(4, camera=view)
    alpha = frame.aov("alpha")
    assert ((alpha > 0.1) & (alpha < 0.9)).mean() > 0.1
    np.testing.assert_allclose(frame.color, 0.5 * alpha[..., None] * np.ones(3), atol=1e-3)


def test_passes_are_there_only_for_an_aperture(renderer):
    view = camera(0.5)
    renderer.render(1, camera=replace(view, f_number=None))
    assert not any(each.effect == "depth_of_field" for each in renderer.graph.passes)
    renderer.render(1, camera=view)
    assert sum(each.effect == "depth_of_field" for each in renderer.graph.passes) >= 5
