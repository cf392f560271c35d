"""Thin bright things before a sky, with the camera going round them: nothing of them stays where they were."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.orbit import orbited
from pica.scenes.basic_meshes import torus
from pica.scenes.placing import aim, rotate
from pica.scenes.sky import gradient_sky
from tests.building import placed, scene_of

SIZE = (120, 68)
DEGREES_A_FRAME = 1.5


def ring():
    pink = Material("pink", base_color=(0.9, 0.3, 0.8, 1.0))
    scene = scene_of(placed(torus(1.0, 0.03, pink, segments=64), rotate("x", 90)))
    sun = scene.add(pica.Node(light=pica.DirectionalLight(illuminance=40.0)))
    sun.transform = aim((3, 5, 2), (0, 0, 0))
    scene.environment = gradient_sky((0.15, 0.25, 0.5), (0.4, 0.45, 0.5), (0.2, 0.2, 0.2))
    return scene


def dilated(mask, pixels):
    for _ in range(pixels):
        padded = np.pad(mask, 1)
        height, width = mask.shape
        mask = np.any([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)
    return mask


@pytest.mark.parametrize("upscale", ["1", "1.5"])
def test_no_copies_of_a_thin_ring_are_left_on_the_sky(device, upscale):
    settings = pica.Settings().with_values({"antialiasing.upscale": upscale})
    scene, start = ring(), Camera.look_at((0, 0.6, 4), (0, 0, 0))
    with (
        pica.Renderer(scene, size=SIZE, settings=settings, device=device) as renderer,
        pica.Renderer(scene, size=SIZE, settings=settings, device=device) as fresh,
    ):
        for frame in range(12):
            camera = orbited(start, np.zeros(3), np.radians(40 + DEGREES_A_FRAME * frame))
            moving = renderer.render(1, camera=camera).color
        still = fresh.render(16, camera=camera, aovs=["instance"])
    sky = ~dilated(still.aov("instance") > 0, 3)
    off = np.abs(moving - still.color).max(axis=-1) > 0.05 * still.color.mean()
    assert (off & sky).sum() <= 0.002 * sky.sum()
    assert moving[~sky].mean() > 1.5 * moving[sky].mean(), "the ring itself is there"
