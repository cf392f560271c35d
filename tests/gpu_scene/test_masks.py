"""Who sees a node, and lighting channels: rays, raster, both renderers, both tiers, and changes at run time."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.scene.light import DirectionalLight, PointLight, SphereLight
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import move, rotate, stretch
from pica.tracing import embree
from tests.building import (
    BUFFERS,
    EMBREE,
    RASTER,
    RAYS,
    lambert,
    leaves,
    orthographic,
    placed,
    scene_of,
    settings,
    shining,
    trace,
    uniform,
)
from tests.rays import CAMERA, FRONT, SHADOW, SURFACE, RayCaster

WAYS = {
    "raster": RASTER,
    "pipeline": RAYS,
    "buffers": BUFFERS,
    "embree": pytest.param(EMBREE, marks=pytest.mark.skipif(embree.missing() is not None, reason="no Embree")),
}
TRACED = [WAYS[name] for name in ("pipeline", "buffers", "embree")]
SIZE = (32, 16)
ABOVE = orthographic((0, 5, 0), (0, 0, -1e-3), 4.0)
"""Looks down at 8 by 4 metres."""
SUN = DirectionalLight(illuminance=np.pi)
DOWN = rotate("x", -90)


def casters(device, scene):
    """Through the device's pipeline and, where it is installed, through Embree."""
    made = [RayCaster(device, scene)]
    if embree.missing() is None:
        from pica.tracing.embree_tracer import EmbreeTracer

        made.append(RayCaster(device, scene, lambda c: EmbreeTracer(device, c.scene.rt_scene)))
    return made


def floor():
    return placed(plane(8, 4, lambert(0.5)), name="floor")


def board(x: float, height: float = 1.0, material=None):
    return placed(plane(2, 4, material or lambert(0.25)), move(x, height, 0), "board")


def halves(picture) -> tuple[float, float]:
    """Mean of the left and of the right half, the seam and the border left out."""
    middle = picture.color[2:-2, :, 0]
    return float(middle[:, 4:12].mean()), float(middle[:, 20:28].mean())


def hybrid(device, scene, values, frames=1, camera=ABOVE):
    return pica.Renderer(scene, size=SIZE, settings=settings(values), device=device).render(frames, camera=camera)


@pytest.mark.parametrize("opaque", [True, False])
def test_rays_meet_nodes_that_are_visible_to_them(device, opaque):
    """One board each that only camera, surface and shadow rays meet; packets of rays of all kinds of masks."""
    kinds = ("visible_to_camera", "visible_to_reflections", "casts_shadows")
    nodes = []
    for number, name in enumerate(kinds):
        node = placed(plane(1, 1, lambert() if opaque else leaves()), move(2 * number, 0, 0))
        for other in kinds:
            setattr(node, other, other == name)
        nodes.append(node)
    x = np.repeat([0, 2, 4], 11)
    origins = np.stack([x + 0.1, np.ones(33), np.full(33, -0.1)], -1)
    for cast in casters(device, scene_of(*nodes)):
        for number, kind in enumerate((CAMERA, SURFACE, SHADOW)):
            met = cast(origins, (0, -1, 0), kind)["distance"] >= 0
            np.testing.assert_array_equal(met, x == 2 * number)


@pytest.mark.parametrize("opaque", [True, False])
def test_shadow_rays_meet_the_channels_of_their_mask(device, opaque):
    boards = [placed(plane(1, 1, lambert() if opaque else leaves()), move(2 * n, 0, 0)) for n in range(6)]
    for channel, node in enumerate(boards):
        node.lighting_channels = {channel}
    channels, masks = (grid.reshape(-1) for grid in np.meshgrid(np.arange(6), np.arange(64)))
    origins = np.stack([2 * channels + 0.1, np.ones(384), np.full(384, -0.1)], -1)
    for cast in casters(device, scene_of(*boards)):
        met = cast(origins, (0, -1, 0), SHADOW, mask=masks << 2)["distance"] >= 0
        np.testing.assert_array_equal(met, masks >> channels & 1 == 1)
        assert (cast(origins, (0, -1, 0), SURFACE)["distance"] >= 0).all()


def test_masks_change_at_run_time_with_as_little_upload_as_may_be(device):
    still, node = floor(), board(0)
    node.instances = np.stack([move(0, 0, 0), move(0, 0.5, 0)])
    scene = scene_of(still, node)
    for cast in casters(device, scene):
        for seen in (False, True, True):
            node.visible_to_reflections = seen
            cast.update()
            np.testing.assert_allclose(cast([0.1, 5, 0], (0, -1, 0))["distance"], 3.5 if seen else 5, rtol=1e-5)
    node.visible_to_reflections = False
    with device.record() as recording:
        assert cast.scene.update(recording, FRONT)
    assert cast.scene.scene.instance_table._quiet and cast.scene.rt_scene.slots._quiet
    node.visible_to_reflections = False
    with device.record() as recording:
        assert not cast.scene.update(recording, FRONT), "nothing is new"
    assert cast.scene.scene._changes.take().any() is False


@pytest.mark.parametrize("values", WAYS.values(), ids=WAYS)
def test_the_camera_does_not_see_hidden_nodes(device, values):
    hidden, below = board(-2), floor()
    hidden.visible_to_camera = False
    scene = scene_of(below, hidden, board(2), shining(SUN, DOWN))
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    names = renderer.render(1, camera=ABOVE).aov("instance")[8]
    assert set(names[4:12]) == {1} and set(names[21:27]) == {3}
    left, right = halves(renderer.render(1, camera=ABOVE))
    assert left == 0 and right == pytest.approx(0.25, rel=1e-2), "what is not seen throws its shadow all the same"
    hidden.visible_to_camera, hidden.casts_shadows = True, False
    left, right = halves(renderer.render(1, camera=ABOVE))
    assert left == pytest.approx(0.25, rel=1e-2)
    hidden.visible_to_camera = False
    left, right = halves(renderer.render(1, camera=ABOVE))
    assert left == pytest.approx(0.5, rel=1e-2)


def lit_halves(device, scene, values):
    return halves(hybrid(device, scene, values)), halves(trace(device, scene, 1, ABOVE, SIZE, 2, values))


@pytest.mark.parametrize("values", TRACED, ids=["pipeline", "buffers", "embree"])
def test_lights_reach_and_are_hidden_by_their_channels(device, values):
    """Two floors; suns of channel 0, 1 and of both; a board of channel 1 over the left floor."""
    for channels, expected in (({0}, (0.5, 0)), ({1}, (0, 0.5)), ({0, 1}, (0, 0.5)), ({2, 5}, (0, 0)), ((), (0, 0))):
        left, right = (placed(plane(4, 4, lambert(0.5)), move(x, 0, 0)) for x in (-2, 2))
        left.lighting_channels, right.lighting_channels = {0, 1}, {1}
        over = board(-2)
        over.visible_to_camera, over.lighting_channels = False, {1}
        scene = scene_of(left, right, over, shining(replace(SUN, lighting_channels=channels), DOWN))
        for found in lit_halves(device, scene, values):
            assert found == pytest.approx(expected, rel=1e-2), channels


@pytest.mark.parametrize("lights", [1, 3])
def test_a_light_that_is_set_anew_lights_as_it_does_in_a_new_scene(device, lights):
    """Also where several lights share a slot, of which some reach nothing."""

    def lamps(channels):
        point = PointLight(intensity=20.0, lighting_channels=channels)
        return [shining(point, move(0.5 * number, 3, 0)) for number in range(lights)]

    values = {**RAYS, "shadows.max_lights": "1"}

    def ground():
        node = floor()
        node.lighting_channels = {2}
        return node

    nodes = lamps({2})
    renderer = pica.Renderer(scene_of(ground(), *nodes), size=SIZE, settings=settings(values), device=device)
    first = renderer.render(4, camera=ABOVE)
    nodes[0].light = replace(nodes[0].light, lighting_channels={3})
    darker = renderer.render(4, camera=ABOVE)
    assert darker.color.mean() < 0.95 * first.color.mean() and (darker.color.mean() > 0) == (lights > 1)
    renderer.reset()
    changed = renderer.render(4, camera=ABOVE)
    others = lamps({2})
    others[0].light = replace(others[0].light, lighting_channels={3})
    new = pica.Renderer(scene_of(ground(), *others), size=SIZE, settings=settings(values), device=device)
    np.testing.assert_array_equal(changed.color, new.render(4, camera=ABOVE).color)
    nodes[0].light = None
    assert renderer.render(1, camera=ABOVE).color.mean() == 0 or lights > 1
    nodes[0].light = PointLight(intensity=20.0)
    assert renderer.render(1, camera=ABOVE).color.mean() > 0


def test_a_light_without_a_mesh_comes_at_run_time(device):
    scene = scene_of(floor())
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(RAYS), device=device)
    assert renderer.render(1, camera=ABOVE).color.max() == 0
    scene.add(shining(SUN, DOWN))
    assert renderer.render(1, camera=ABOVE).color.mean() == pytest.approx(0.5, rel=1e-2)


@pytest.mark.parametrize("values", TRACED, ids=["pipeline", "buffers", "embree"])
def test_emission_reaches_the_channels_of_its_node(device, values):
    """In the hybrid's slot and in the path tracer, where it is found by sampling and by hitting."""
    left, right = (placed(plane(4, 4, lambert(0.5)), move(x, 0, 0)) for x in (-2, 2))
    glow = placed(plane(6, 3, lambert(0.0, emission=(2.0, 2.0, 2.0))), move(0, 1, 0) @ rotate("x", 180))
    glow.visible_to_camera = False
    left.lighting_channels, right.lighting_channels, glow.lighting_channels = {0}, {1}, {1, 4}
    scene = scene_of(left, right, glow)
    found = halves(hybrid(device, scene, values, 16)), halves(trace(device, scene, 16, ABOVE, SIZE, 2, values))
    for dark, lit in found:
        assert dark == 0 and lit > 0.4
    assert found[0] == pytest.approx(found[1], rel=0.05)


def test_emission_that_surfaces_do_not_see_lights_nothing(device):
    glow = placed(plane(6, 3, lambert(0.0, emission=(2.0, 2.0, 2.0))), move(0, 1, 0) @ rotate("x", 180))
    glow.visible_to_camera = False
    renderer = pica.Renderer(scene_of(floor(), glow), size=SIZE, settings=settings(RAYS), device=device)
    for seen in (True, False, True):
        glow.visible_to_reflections = seen
        assert (renderer.render(4, camera=ABOVE).color.mean() > 0.1) == seen


def mirror_scene():
    """A rough metal floor under a ball of light and a sky, and boards that hide nothing, all, or one of both."""
    metal = lambert(0.9, metallic=1.0, roughness=0.3)
    ground = placed(plane(8, 4, metal), name="floor")
    no_shadow, unseen, channelled = board(-2.5, 0.6), board(0, 0.6), board(2.5, 0.6)
    for node in (no_shadow, unseen, channelled):
        node.visible_to_camera = False
    no_shadow.casts_shadows = False
    unseen.visible_to_reflections = False
    channelled.lighting_channels = {1}
    lamp = SphereLight(radiance=20.0, radius=0.4, lighting_channels={0})
    return scene_of(
        ground, no_shadow, unseen, channelled, shining(lamp, move(0, 2.5, 0)), environment=uniform(0.5, 0.5, 0.5)
    )


@pytest.mark.parametrize("roughness", [0.3, 1.0])
def test_direct_light_of_the_path_tracer_is_the_hybrids(device, roughness):
    """Where shadow and surface rays meet different things, what is direct light does not depend on how it is found."""
    scene = mirror_scene()
    scene.roots[0].mesh.sections[0].material.roughness = roughness
    ours = hybrid(device, scene, RAYS, 256).color
    reference = trace(device, scene, 256, ABOVE, SIZE, 2).color
    blocks = [picture[..., 0].reshape(2, 8, 4, 8).mean((1, 3)) for picture in (ours, reference)]
    np.testing.assert_allclose(*blocks, rtol=0.03)


def test_a_path_meets_what_reflections_see(device):
    """A glowing wall that only the camera sees brings no light; a red one that it does not see colours the floor."""
    wall = placed(plane(8, 4, lambert(0.9, 0.1, 0.1)), move(0, 1, 0) @ rotate("x", 180))
    wall.visible_to_camera, wall.casts_shadows = False, False
    scene = scene_of(floor(), wall, shining(SUN, DOWN))
    colour = trace(device, scene, 16, ABOVE, SIZE, 4).color.mean((0, 1))
    assert colour[0] > colour[1] + 0.05
    wall.visible_to_reflections = False
    np.testing.assert_allclose(trace(device, scene, 4, ABOVE, SIZE, 4).color.mean((0, 1)), 0.5, rtol=1e-2)


@pytest.mark.parametrize("values", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("double_sided", [False, True])
def test_raster_and_all_rays_cull_the_same_backs(device, values, mirrored, double_sided):
    """Four boards: upright and turned over, by the node or by an instance's own transform."""
    flip = stretch(-1 if mirrored else 1, 1, 1)
    node = placed(plane(1, 1, lambert(0.3, double_sided=double_sided)), flip)
    node.instances = np.stack([move(-3, 0, 0), move(-1, 0, 0) @ rotate("x", 180), move(1, 0, 0) @ stretch(1, 1, -1)])
    upside = placed(
        plane(1, 1, lambert(0.3, double_sided=double_sided)),
        move(-3 if mirrored else 3, 0, 0) @ stretch(1, -1, 1) @ flip,
    )
    picture = hybrid(device, scene_of(node, upside, shining(SUN, DOWN)), values)
    places = [3, 1, -1, -3] if mirrored else [-3, -1, 1, 3]
    columns = [round(4 * (x + 4) - 0.5) for x in places]
    seen = picture.aov("instance")[8][columns] > 0
    # The front is where the normal points, also under transforms that mirror (glTF 2.0, 3.7.4).
    np.testing.assert_array_equal(seen, [True, double_sided, True, double_sided])
