"""Scene.background: a colour or a picture that the camera sees in place of the environment, and that gives no light."""

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.environment import Environment
from pica.scene.material import Material
from pica.scene.model import Scene
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move
from tests.building import lambert, orthographic, placed, render, scene_of, settings, trace, uniform
from tests.effects.transparency.test_transparency import glass

GREEN = (0.0, 2.0, 0.5)
WHITE = (1.0, 1.0, 1.0)
ABOVE = orthographic((0, 3, 0), (0, 0, 0), 2)
"""2 m high and wide."""


def seen_by(tracer, device, *nodes, background=GREEN, values=None):
    """Its right half shows nothing but the background."""
    scene = scene_of(*nodes, environment=uniform(*WHITE))
    scene.background = background
    more = () if values is None else (values,)
    return tracer(device, scene, 64, ABOVE, (16, 16), *more).color


def left(picture):
    return picture[4:12, 1:7]


BOTH = pytest.mark.parametrize("tracer", [render, trace], ids=["hybrid", "path tracer"])


@BOTH
def test_pixels_without_a_surface_have_the_colour_and_surfaces_none_of_its_light(device, tracer):
    board = placed(plane(1, 2, lambert(0.5)), move(-0.5, 0, 0))
    picture = seen_by(tracer, device, board)
    np.testing.assert_allclose(picture[:, 9:], np.broadcast_to(GREEN, (16, 7, 3)), rtol=1e-3)
    np.testing.assert_allclose(left(picture).mean((0, 1)), (0.5, 0.5, 0.5), rtol=0.01)


@BOTH
def test_mirrors_show_the_environment(device, tracer):
    mirror = placed(plane(1, 2, Material(metallic=1.0, roughness=0.0)), move(-0.5, 0, 0))
    values = {"reflections.mode": "ray_traced"} if tracer is render else None
    picture = seen_by(tracer, device, mirror, values=values)
    np.testing.assert_allclose(left(picture).mean((0, 1)), WHITE, rtol=0.02)
    np.testing.assert_allclose(picture[:, 9:], np.broadcast_to(GREEN, (16, 7, 3)), rtol=1e-3)


def through_a_slab(tracer, device, values=None):
    slab = placed(box((1, 0.2, 2), glass()), move(-0.5, 0, 0))
    return left(seen_by(tracer, device, slab, values=values)).mean((0, 1))


@BOTH
def test_glass_shows_the_colour_behind_it_and_reflects_the_environment(device, tracer):
    """What is reflected inside a solid goes on to the background; the outside reflects 4 %."""
    expected = 0.04 + 0.96 * np.array(GREEN)
    np.testing.assert_allclose(through_a_slab(tracer, device), expected, rtol=0.01, atol=0.005)


def test_glass_without_rays_shows_the_colour_too(device):
    values = {"transparency.mode": "screen_space"}
    np.testing.assert_allclose(through_a_slab(render, device, values), 0.04 + 0.96 * np.array(GREEN), rtol=0.01)


def test_another_colour_is_in_the_next_frame(device):
    scene = scene_of(environment=uniform(*WHITE))
    with pica.Renderer(scene, size=(8, 8), settings=settings(), device=device) as renderer:
        for background, expected in ((None, WHITE), (GREEN, GREEN), (None, WHITE)):
            scene.background = background
            np.testing.assert_allclose(renderer.render(1, camera=ABOVE).color[4, 4], expected, rtol=1e-3)


@BOTH
def test_another_environment_is_shown_where_it_is_rotated_and_gives_no_light(device, tracer):
    """Its lower half, straight below, and a quarter of its horizon."""
    radiance = np.zeros((8, 16, 3), np.float32)
    radiance[4:] = GREEN
    picture = Environment(radiance, strength=0.5)
    board = placed(plane(1, 2, lambert(0.5)), move(-0.5, 0, 0))
    seen = seen_by(tracer, device, board, background=picture)
    np.testing.assert_allclose(seen[:, 9:], np.broadcast_to(0.5 * np.array(GREEN), (16, 7, 3)), rtol=1e-3)
    np.testing.assert_allclose(left(seen).mean((0, 1)), (0.5, 0.5, 0.5), rtol=0.01)
    quarter = np.zeros((8, 16, 3), np.float32)
    quarter[:, 6:10] = GREEN  # about +X
    ahead = orthographic((0, 0, 0), (0, 0, 1), 2)
    scene = scene_of(environment=uniform(*WHITE))
    for rotation, expected in ((0.0, 0.0), (np.pi / 2, 0.0), (-np.pi / 2, 2.0)):
        scene.background = Environment(quarter, rotation=rotation)
        assert tracer(device, scene, 1, ahead, (8, 8)).color[4, 4, 1] == pytest.approx(expected, abs=1e-3)


def test_a_background_and_its_environment_are_changed_apart(device):
    scene = scene_of(placed(plane(1, 2, lambert(0.5)), move(-0.5, 0, 0)), environment=uniform(*WHITE))
    scene.background = uniform(0.25, 0.25, 0.25)
    with pica.Renderer(scene, size=(16, 16), settings=settings(), device=device) as renderer:
        for light in (1.0, 3.0):
            scene.environment = uniform(light, light, light)
            renderer.reset()
            picture = renderer.render(64, camera=ABOVE).color
            assert left(picture).mean() == pytest.approx(0.5 * light, rel=0.02)
            assert picture[8, 12, 0] == pytest.approx(0.25, rel=1e-3)


def test_a_transparent_background_has_no_colour(device):
    scene = Scene()
    scene.background = GREEN
    frame = render(device, scene, 1, ABOVE, (8, 8), {"visibility.background": "transparent"})
    assert not frame.color.any()


@pytest.mark.parametrize("background", [(1, 1), (1, 1, -0.1), (1, 1, float("nan")), "#ffffff", 1.0, "sky.hdr"])
def test_what_is_no_radiance_is_refused(background):
    with pytest.raises(SceneError, match="background"):
        Scene().background = background
