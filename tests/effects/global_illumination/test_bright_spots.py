"""A dark room whose light all comes from a small spot on its floor, thousands of times as bright as the walls."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.light import SpotLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, sphere
from pica.scenes.placing import aim, move
from tests.building import converged, lambert, placed, scene_of, shining

SIZE = (96, 54)
CEILING = np.s_[2:11, 24:72]
CAMERA = Camera.look_at((0.4, 1.2, 3.5), (-0.1, 1.6, -3), vertical_fov=np.radians(65))


def closed_room(floor, rock):
    return scene_of(
        placed(box((8, 0.2, 8), floor), move(0, -0.1, 0)),
        placed(box((8, 0.2, 8), rock), move(0, 3.1, 0)),
        placed(box((8, 3, 0.2), rock), move(0, 1.5, -4.1)),
        placed(box((8, 3, 0.2), rock), move(0, 1.5, 4.1)),
        placed(box((0.2, 3, 8), rock), move(-4.1, 1.5, 0)),
        placed(box((0.2, 3, 8), rock), move(4.1, 1.5, 0)),
    )


def room(floor):
    scene = closed_room(floor, lambert(0.3, 0.25, 0.2))
    spot = SpotLight(intensity=2500.0, radius=0.3, inner_cone_angle=0.1, outer_cone_angle=0.14)
    scene.add(shining(spot)).transform = aim((1.2, 2.8, -1.5), (0.2, 0, -0.7))
    return scene


FLOORS = {
    "diffuse": lambert(0.12, 0.1, 0.09),
    "glossy": Material(base_color=(0.12, 0.1, 0.09, 1.0), metallic=0.0, roughness=0.3),
    "polished": Material(base_color=(0.3, 0.25, 0.2, 1.0), metallic=0.0, roughness=0.15),
}


def ceiling_of(device, scene, values):
    """After 16 frames and after 128, of noise in which single rays carry most of the light."""
    settings = pica.Settings().with_values(values)
    with pica.Renderer(scene, size=SIZE, settings=settings, device=device) as renderer:
        return [renderer.render(frames, camera=CAMERA).color[CEILING].mean() for frames in (16, 112)]


@pytest.mark.parametrize(("floor", "tolerance"), [("diffuse", 0.12), ("glossy", 0.25), ("polished", 0.3)])
def test_a_spot_lights_a_room(device, floor, tolerance):
    """The radiance cache held at most 256 times display white: the ceiling had .05 of its light. With its diffuse
    light alone it had half above the floors whose highlight lights it. Larger pictures have finer cells, and are
    nearer to the path tracer. Limits on single rays took more than half of the first frames' light."""
    scene = room(FLOORS[floor])
    expected = converged(device, scene, 512, CAMERA, SIZE)[CEILING].mean()
    first, found = ceiling_of(device, scene, {})
    assert first > 0.6 * expected
    assert found == pytest.approx(expected, rel=tolerance)


def test_filters_conserve_rare_bright_rays(device):
    """Of one bounce. Filters that weighted each ray by its own noise lost 14 % of the light."""
    scene = room(FLOORS["diffuse"])
    with pica.PathTracer(scene, size=SIZE, max_depth=3, device=device) as tracer:
        expected = tracer.render(512, camera=CAMERA).color[CEILING].mean()
    _, found = ceiling_of(device, scene, {"global_illumination.bounces": "1"})
    assert found == pytest.approx(expected, rel=0.08)


@pytest.mark.parametrize("seed", [1, 3])
def test_one_ray_leaves_no_spot_in_the_first_frames(device, seed):
    """A candle of six centimetres below its flame: a ray that finds it brings 100,000 times what others bring.
    It was a spot of 17 to 23 times the light around."""
    stone, wax = lambert(0.5, 0.45, 0.4), lambert(0.9)
    flame = Material(base_color=(0, 0, 0, 1), metallic=0.0, emission=(3000.0, 3000.0, 3000.0))
    scene = closed_room(stone, stone)
    scene.add(placed(box((0.06, 1.0, 0.06), wax), move(0, 0.5, -1)))
    scene.add(placed(sphere(0.01, flame, 12), move(0, 1.02, -1)))
    settings = pica.Settings().with_values({"seed": seed})
    with pica.Renderer(scene, size=(160, 90), settings=settings, device=device) as renderer:
        renderer.render(3, camera=CAMERA)
        seen = renderer.render(5, camera=CAMERA)
    x, _, z = np.moveaxis(seen.aov("position"), -1, 0)
    light = seen.aov("diffuse_indirect").mean(-1)[np.hypot(x, z + 1) > 0.5]
    assert light.max() < 6 * np.median(light)
