"""Shadow rays go on through what lets light through, and take its colour."""

import math

import numpy as np
import pytest

import pica
from pica.quality.effects import compare_effect
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, RectangleLight, SphereLight
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from pica.tracing import embree
from tests.building import lambert, orthographic, placed, render, scene_of, settings, shining, trace, uniform

PIPELINE = {"rays.scheduler": "pipeline"}
WAYS = [
    pytest.param(PIPELINE, id="pipeline"),
    pytest.param({"rays.scheduler": "buffers", "rays.tracer": "device"}, id="buffers"),
    pytest.param(
        {"rays.scheduler": "buffers", "rays.tracer": "embree"},
        id="embree",
        marks=pytest.mark.skipif(embree.missing() is not None, reason="Embree cannot trace"),
    ),
]
COLORS = [(0.9, 0.5, 0.3), (0.4, 0.9, 0.8), (0.7, 0.7, 0.95)]
TILTS = [0, 25, 50]
DOWN = rotate("x", -90)
ABOVE = orthographic((0, 0.2, 0), (0, 0, 0), 0.3)
"""Sees the floor alone, from below what is at half a metre and higher."""


def glass(color=(1.0, 1.0, 1.0), **more) -> Material:
    return Material(**{"base_color": (*color, 1.0), "metallic": 0.0, "transmission": 1.0, **more})


def sun(angular_diameter: float = 0.0):
    return shining(DirectionalLight(illuminance=2.0, angular_diameter=angular_diameter), DOWN)


def floor():
    return placed(plane(6, 6, lambert(0.6)))


def schlick(cosine: float, f0: float = 0.04) -> float:
    return f0 + (1 - f0) * (1 - cosine) ** 5


def arriving(device, node, values, diameter=0.0, tracer=render) -> np.ndarray:
    """(height, width, 3) of the light on the floor that is left with something in the way."""
    nodes = node if isinstance(node, list) else [node]
    more = {"max_depth": 2} if tracer is trace else {}
    with_it, without = (
        tracer(device, scene_of(floor(), sun(diameter), *inside), 3, ABOVE, (12, 12), values=values, **more).color
        for inside in (nodes, [])
    )
    assert without.min() > 0.1
    return with_it / without


@pytest.mark.parametrize("tracer", [render, trace], ids=["hybrid", "path tracer"])
@pytest.mark.parametrize("diameter", [0.0, 0.02], ids=["sharp", "filtered"])
@pytest.mark.parametrize("values", WAYS)
def test_three_panes_give_the_product_of_their_colours_and_interfaces(device, values, diameter, tracer):
    panes, expected = [], np.ones(3)
    for index, (color, tilt) in enumerate(zip(COLORS, TILTS, strict=True)):
        side = 180 * (index % 2)  # a pane is the same from both sides
        pane = plane(3, 3, glass(color, transmission=0.9, roughness=0.0))
        panes.append(placed(pane, move(0, 1.4 + 1.5 * index, 0) @ rotate("x", tilt + side)))
        expected *= 0.9 * np.array(color) * (1 - schlick(math.cos(math.radians(tilt)))) ** 2
    found = arriving(device, panes, values, diameter, tracer)
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), rtol=0.01)


@pytest.mark.parametrize("tracer", [render, trace], ids=["hybrid", "path tracer"])
def test_light_leaves_a_slab_at_the_angle_of_its_arrival(device, tracer):
    """And loses what the slab absorbs on the refracted way through it."""
    color, absorption = np.array((0.9, 0.7, 0.5)), np.array((0.5, 2.0, 4.0))
    for tilt in (0, 35, 60):
        material = glass(color, thin_walled=False, absorption=tuple(absorption))
        slab = placed(box((3, 0.2, 3), material), move(0, 2, 0) @ rotate("x", tilt))
        cosine, inside = math.cos(math.radians(tilt)), math.asin(math.sin(math.radians(tilt)) / 1.5)
        expected = color**2 * (1 - schlick(cosine)) ** 2 * np.exp(-absorption * 0.2 / math.cos(inside))
        found = arriving(device, slab, PIPELINE, tracer=tracer)
        np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("tilt", "absorption"), [(0, (0.5, 2.0, 4.0)), (60, (0.5, 2.0, 4.0))])
def test_light_through_a_slab_comes_near_that_of_refracted_paths(device, tilt, absorption):
    solid = glass(roughness=0.0, thin_walled=False, absorption=absorption)
    slab = placed(box((6, 0.2, 6), solid), move(0, 2, 0) @ rotate("x", tilt))
    lit = scene_of(floor(), slab, sun(0.3))
    straight, refracted = (
        trace(device, lit, 4096, ABOVE, (12, 12), values={"shadows.transparent": way}).color.mean((0, 1))
        for way in ("true", "false")
    )
    np.testing.assert_allclose(straight, refracted, rtol=0.1)


@pytest.mark.parametrize("values", WAYS)
def test_light_through_glass_is_coloured_in_mirrors_too(device, values):
    """At hits of other rays, shadow rays return to the glass that they have passed. The wall is behind the camera."""
    color = np.array((0.9, 0.5, 0.3))
    mirror = Material(base_color=(1, 1, 1, 1), metallic=1.0, roughness=0.0)
    wall = placed(box((3, 3, 0.1), lambert(0.6)), move(0, 0, 2.05))
    light = shining(DirectionalLight(illuminance=2.0), aim((0, 2, -2), (0, 0, 0)))
    stage = wall, light, placed(box((0.4, 0.4, 0.01), mirror), move(0, 0, -1))
    pane = placed(box((1.5, 0.6, 0.01), glass(color, thin_walled=False)), move(0, 0.5, 1.5))
    values = {"reflections.mode": "ray_traced", **values}
    camera = orthographic((0, 0, 0), (0, 0, -1), 0.1)
    bare, behind = (render(device, scene_of(*stage, *more), 4, camera, (8, 8), values).color for more in ([], [pane]))
    assert bare.min() > 0.1
    expected = color**2 * (1 - schlick(math.sqrt(0.5))) ** 2
    np.testing.assert_allclose(behind / bare, np.broadcast_to(expected, bare.shape), rtol=0.02)


def test_light_reaches_what_lies_under_water_at_any_angle(device):
    """As much as refracted paths bring, although the straight ray leaves beyond the critical angle."""
    water = glass(roughness=0.0, thin_walled=False, ior=1.33, absorption=(1.0, 0.3, 0.1))
    away = 12 * np.array((math.sqrt(0.75), 0.5, 0))
    lamp = shining(RectangleLight(radiance=50, width=3, height=3), aim(away, (0, 0, 0)))
    bottom = placed(plane(60, 60, lambert(0.5)), move(0, -0.3, 0))
    scene = scene_of(bottom, placed(box((40, 0.3, 40), water), move(0, -0.151, 0)), lamp)
    straight, refracted = (
        trace(device, scene, 1536, Camera.look_at((0, 3, 0.01), (0, -1, 0), vertical_fov=0.4), (16, 9), values=each)
        for each in ({}, {"shadows.transparent": "false"})
    )
    means = [picture.color.mean((0, 1)) for picture in (straight, refracted)]
    np.testing.assert_allclose(means[0], means[1], rtol=0.03)


def test_metal_and_other_opaque_things_behind_glass_hide_the_light(device):
    pane = placed(plane(3, 3, glass()), move(0, 1, 0))
    assert np.all(arriving(device, [pane, placed(plane(3, 3, lambert()), move(0, 2, 0))], PIPELINE) == 0)
    assert np.all(arriving(device, placed(plane(3, 3, glass(metallic=1.0)), move(0, 1, 0)), PIPELINE) == 0)


def test_a_texture_says_where_light_comes_through(device):
    pixels = np.full((1, 2, 4), 255, np.uint8)
    pixels[0, 0, 0] = 0
    halves = Texture(Image(pixels), Sampler(linear=False))
    material = glass(specular=0.0, transmission=0.5, transmission_texture=halves)
    found = arriving(device, placed(plane(3, 3, material), move(0, 1, 0)), PIPELINE)
    columns = np.sort(found.mean((0, 2)))
    # Jitter blurs the two columns at the edge.
    np.testing.assert_allclose(columns[[*range(5), *range(7, 12)]], [0] * 5 + [0.5] * 5, atol=1e-3)


def invisible_pane():
    """Takes no light and does not show, but rays must find the way through."""
    pane = placed(plane(4, 4, glass(specular=0.0)), move(0, 0.6, 0) @ rotate("x", 10))
    pane.visible_to_camera = False
    return pane


def glossy_stage(*more):
    glow = lambert(0.0, emission=(6.0, 4.0, 2.0), double_sided=True)
    shiny = Material(base_color=(0.8, 0.8, 0.8, 1), metallic=0.5, roughness=0.4)
    return scene_of(
        placed(plane(2, 2, shiny)),
        placed(plane(0.6, 0.6, glow), move(0.5, 1.4, -0.4)),
        shining(SphereLight(radiance=8.0, radius=0.25), move(-0.5, 1.5, -0.5)),
        *more,
        environment=uniform(0.3, 0.4, 0.5),
    )


@pytest.mark.parametrize("tracer", [render, trace], ids=["hybrid", "path tracer"])
def test_what_takes_no_light_changes_nothing(device, tracer):
    """Whatever strategy looks for a light: emissive triangles, the environment and lights with a size."""
    camera = Camera.look_at((0, 0.5, 1.2), (0, 0, 0), vertical_fov=math.radians(40))
    more = {"max_depth": 2} if tracer is trace else {}
    pictures = [
        tracer(device, glossy_stage(*panes), 96, camera, (24, 16), values=PIPELINE, **more).color
        for panes in ([], [invisible_pane()])
    ]
    seen = [picture.reshape(4, 4, 4, 6, 3).mean((1, 3)) for picture in pictures]
    np.testing.assert_allclose(seen[1], seen[0], rtol=0.06)
    np.testing.assert_allclose(pictures[1].mean((0, 1)), pictures[0].mean((0, 1)), rtol=0.015)


def test_filtered_shadows_of_glass_come_near_the_truth(device):
    ball = placed(sphere(0.3, glass((0.9, 0.4, 0.3), thin_walled=False)), move(0, 0.5, 0))
    pane = placed(plane(0.8, 0.8, glass((0.3, 0.8, 0.4))), move(-0.5, 0.8, 0.1) @ rotate("x", 30))
    light = shining(DirectionalLight(illuminance=2.0, angular_diameter=0.1), aim((0.6, 2, 0.5), (0, 0, 0)))
    scene = scene_of(floor(), ball, pane, light)
    view = Camera.look_at((0.3, 2.0, 2.4), (0, 0.2, 0), vertical_fov=math.radians(40))
    for denoiser in ("svgf", "anisotropic"):
        chosen = settings({"shadows.denoiser": denoiser, **PIPELINE})
        errors = compare_effect(
            pica.Renderer(scene, size=(72, 48), settings=chosen, device=device), "shadows", "still", 10, 48, view
        )
        assert errors.psnr[-1] > 28, f"{denoiser}: {errors.psnr[-1]:.1f} dB"


def test_transparent_shadows_come_and_go_with_the_glass_and_the_setting(device):
    scene = scene_of(floor(), sun())
    renderer = pica.Renderer(scene, size=(8, 8), settings=settings(PIPELINE), device=device)
    bare = renderer.render(1, camera=ABOVE).color
    pane = scene.add(placed(plane(3, 3, glass((0.5, 1, 1))), move(0, 1, 0)))
    coloured = renderer.render(1, camera=ABOVE).color
    np.testing.assert_allclose(coloured / bare, np.broadcast_to(0.96**2 * np.array([0.5, 1, 1]), bare.shape), rtol=0.01)
    off = {"shadows.transparent": "false", **PIPELINE}
    assert np.all(render(device, scene, 1, ABOVE, (8, 8), off).color == 0)
    assert np.all(trace(device, scene, 1, ABOVE, (8, 8), 2, off).color == 0)
    scene.remove(pane)
    np.testing.assert_array_equal(renderer.render(1, camera=ABOVE).color, bare)
