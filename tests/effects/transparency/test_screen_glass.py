"""Transmissive surfaces without rays: by layers that are rasterized, and refract the picture."""

import math

import numpy as np
import pytest

import pica
from pica.quality.picture_errors import compare
from pica.scene.camera import Camera
from pica.scene.material import AlphaMode, Material
from pica.scene.model import Node
from pica.scene.primitives import spheres
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, orthographic, placed, render, scene_of, settings, uniform
from tests.effects.transparency.test_transparency import (
    SMALL_MAPS,
    VIEW,
    directions,
    glass,
    panes,
    prism,
    still_life,
    through_a_prism,
)

SCREEN = {"transparency.mode": "screen_space"}


@pytest.mark.parametrize("roughness", [0.0, 0.5])
def test_a_ball_of_glass_disappears_in_even_light(device, roughness):
    scene = scene_of(placed(sphere(0.5, glass(roughness=roughness), 64)), environment=uniform(1, 1, 1))
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(24))
    picture = render(device, scene, 32, camera, (24, 24), SCREEN).color
    assert picture[8:16, 8:16].mean() == pytest.approx(1, rel=0.02)
    assert picture.mean() == pytest.approx(1, rel=0.02)


def test_a_block_absorbs_by_the_way_through_its_box(device):
    """Without inner reflections."""
    absorption, thickness, reflected = np.array((0.5, 2.0, 6.0)), 0.4, 0.04
    slab = placed(box((4, thickness, 4), glass(absorption=tuple(absorption))), move(0, 1, 0))
    camera = orthographic((0, 3, 0), (0, 0, 0), 0.5)
    picture = render(device, scene_of(slab, environment=uniform(1, 1, 1)), 16, camera, (16, 16), SCREEN).color
    expected = reflected + (1 - reflected) * np.exp(-absorption * thickness)
    np.testing.assert_allclose(picture.mean((0, 1)), expected, rtol=0.01)


def test_blocks_refract_as_snell_says(device):
    block, camera = prism(ior=1.2)
    picture = render(device, scene_of(block, environment=directions()), 8, camera, (8, 8), SCREEN).color
    np.testing.assert_allclose(picture - 1, np.broadcast_to(through_a_prism(1.2), picture.shape), atol=1e-3)


def test_overlapping_panes_may_come_in_any_order(device):
    """And each of them tints what lies behind it: the farthest one shows through the others."""
    pictures = []
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        floor = placed(plane(4, 4, lambert(0.5, 0.4, 0.3)))
        scene = scene_of(floor, *panes(order), environment=uniform(1, 1, 1))
        pictures.append(render(device, scene, 32, VIEW, (32, 20), SCREEN).color)
    for other in pictures[1:]:
        assert compare(pictures[0], other).flip < 0.01
    traced = render(device, scene, 96, VIEW, (32, 20), SMALL_MAPS).color
    np.testing.assert_allclose(pictures[0].mean((0, 1)), traced.mean((0, 1)), rtol=0.08)


def test_what_is_in_front_of_glass_is_not_seen_through_it(device):
    """A post before a ball that bends paths: the ball shows it neither as itself nor beside it."""
    post = placed(box((0.1, 2, 0.1), lambert(0, 0, 0, emission=(50, 0, 0))), move(0, 0, 1))
    ball = placed(sphere(0.5, glass((0.7, 0.7, 0.7), specular=0.0), 48), move(0, 0, -0.5))
    wall = placed(plane(6, 6, lambert(0, 0, 0, emission=(1, 1, 1))), move(0, 0, -2) @ rotate("x", 90))
    camera = Camera.look_at((0, 0, 4), (0, 0, 0), vertical_fov=math.radians(30))
    frame = render(device, scene_of(ball, wall, post), 8, camera, (48, 32), SCREEN | {"shadows.mode": "off"})
    seen = frame.aov("transmission")[..., 0] != 0
    beside = np.ones(48, bool)
    beside[21:27] = False  # but for the post's own pixels
    assert frame.color[:, beside][seen[:, beside]].size > 100
    assert frame.color[:, beside][seen[:, beside]].max() < 2


@pytest.mark.slow
def test_frames_come_near_those_with_rays(device):
    """Spheres, boxes, panes, and primitives that are not triangles."""
    ball = Node(mesh=pica.Mesh([], primitives=[spheres([(-0.9, 0.3, 0.4)], 0.2, glass((0.9, 0.6, 0.5)))]))
    scene = scene_of(*still_life(), ball, environment=uniform(0.25, 0.3, 0.4))
    size = (96, 60)
    frames = {
        mode: render(device, scene, 48, VIEW, size, {"transparency.mode": mode})
        for mode in ("ray_traced", "screen_space", "off")
    }
    traced = frames["ray_traced"].color
    found = {mode: compare(traced, frames[mode].color).flip for mode in ("screen_space", "off")}
    assert found["screen_space"] < 0.3 * found["off"]
    assert frames["screen_space"].color.mean() == pytest.approx(traced.mean(), rel=0.05)


@pytest.mark.parametrize("material", [{"transmission": 1.0}, {"alpha_mode": AlphaMode.BLEND}])
def test_panes_mirror_what_the_picture_shows(device, material):
    """A lying pane, transmissive or blended, shows the box that stands on it as rays do, instead of the bright sky."""
    black = {"base_color": (0, 0, 0, 0.2), "metallic": 0.0, "roughness": 0.0, "thin_walled": True}
    pane = placed(plane(4, 4, Material(**black, **material)), move(0, 0.2, 0))
    red = placed(box((0.8, 1.4, 0.1), lambert(0, emission=(3.0, 0.3, 0.3))), move(0, 0.9, -0.6))
    floor = placed(plane(6, 6, lambert(0)))
    camera = Camera.look_at((0, 0.9, 3), (0, 0.5, 0), vertical_fov=math.radians(40))
    scene = scene_of(pane, red, floor, environment=uniform(0.5, 0.6, 0.7))
    values = {"shadows.mode": "off"}
    frames = {
        mode: render(device, scene, 16, camera, (64, 48), values | {"transparency.mode": mode}).color
        for mode in ("ray_traced", "screen_space")
    }
    mirrored = slice(30, 36), slice(28, 36)  # the foot of the box in the pane
    traced, marched = (frames[mode][mirrored].mean((0, 1)) for mode in ("ray_traced", "screen_space"))
    assert traced[0] > 3 * traced[2], "it is red"
    np.testing.assert_allclose(marched, traced, rtol=0.02)


def test_scenes_without_glass_have_no_pass(device):
    scene = scene_of(placed(plane(4, 4, lambert())), environment=uniform(1, 1, 1))
    with pica.Renderer(
        scene, size=(16, 16), settings=settings(SCREEN | {"translucency.mode": "off"}), device=device
    ) as renderer:
        renderer.render(1, camera=VIEW)
        passes = [entry.name for entry in renderer.graph.passes]
    assert not any("glass" in name for name in passes)
    assert passes.count("presample_lights") == 1, "of the pixels' own light"
