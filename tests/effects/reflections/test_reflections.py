"""Reflections against the path tracer, each light path counted once, and what their filters leave."""

import numpy as np
import pytest

import pica
from pica.quality.effects import compare_effect
from pica.scene.camera import Camera
from pica.scene.light import PointLight, RectangleLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, turn
from tests.building import lambert, placed, scene_of, settings, shining, sky, trace, uniform

SIZE = (64, 48)
UNFILTERED = {
    "reflections.mode": "ray_traced",
    "reflections.filter": "false",
    "lighting.filter": "false",
    "lighting.area_lights": "sampled",
    "shadows.denoiser": "off",
}
VIEW = Camera.look_at((0, 1.2, 3.4), (0, 0.6, 0), fov=50)


def metal(roughness, *color):
    return Material(base_color=(*(color or (0.9, 0.8, 0.7)), 1), metallic=1.0, roughness=roughness)


def furnace():
    """White metals and dielectrics under the same light from everywhere."""
    glossy = Material(base_color=(1, 1, 1, 1), metallic=0.0, roughness=0.3)
    balls = [placed(sphere(0.4, material), move(x, 0.5, 0)) for x, material in ((-0.9, metal(0.2, 1, 1, 1)), (0, glossy))]
    return scene_of(*balls, placed(plane(3, 3, metal(0.6, 1, 1, 1))), environment=uniform(1, 1, 1)), VIEW


def glossy_room():
    """An open room of glossy walls with a lamp, a bulb and a sky through its roof."""
    wall, floor = Material(base_color=(0.7, 0.6, 0.5, 1), roughness=0.4), metal(0.3)
    bulb = lambert(0.2, emission=(6.0, 5.0, 3.0))
    return (
        scene_of(
            placed(plane(4, 4, floor)),
            placed(plane(4, 3, wall), move(0, 1.5, -2) @ turn("x", 90)),
            placed(plane(3, 4, wall), move(-2, 1.5, 0) @ turn("z", -90)),
            placed(sphere(0.4, metal(0.15)), move(0.4, 0.4, -0.4)),
            placed(sphere(0.2, bulb), move(-0.9, 0.5, 0.2)),
            shining(RectangleLight(radiance=8.0, width=0.8, height=0.5), move(0.8, 2.2, 0.5) @ turn("x", -90)),
            shining(PointLight(intensity=3.0), move(-1, 1.6, -1)),
            environment=sky(),
        ),
        VIEW,
    )


SCENES = {"furnace": furnace, "cornell": lambda: (pica.scenes.cornell(), None), "glossy room": glossy_room}


@pytest.mark.parametrize("name", SCENES)
def test_every_path_counts_once(device, name):
    """What each owner brings adds up to what the path tracer finds along the same paths (docs/light-paths.md)."""
    scene, camera = SCENES[name]()
    renderer = pica.Renderer(scene, SIZE, settings(UNFILTERED), device)
    frame = renderer.render(128, camera)
    expected = pica.PathTracer(scene, SIZE, 3, settings(), device, indirect_diffuse=False).render(256, camera).color
    assert frame.color.mean() == pytest.approx(expected.mean(), rel=0.01)
    share = frame.aov("reflections").mean() / expected.mean()  # of one frame
    assert share > 0.2 or name == "cornell", "reflections are a part worth counting"
