"""Thin bright things with the camera going round them: nothing of them stays on the sky or the floor behind them."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.orbit import orbited
from pica.scenes.basic_meshes import plane, torus
from pica.scenes.placing import aim, move, rotate
from pica.scenes.sky import gradient_sky
from tests.building import placed, scene_of


def ring(*behind):
    pink = Material("pink", base_color=(0.9, 0.3, 0.8, 1.0))
    scene = scene_of(placed(torus(1.0, 0.03, pink, segments=64), rotate("x", 90)), *behind)
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


def floor():
    """Its points move at different speeds in the picture, other than a sky's."""
    return placed(plane(60, 60, Material("floor", base_color=(0.2, 0.25, 0.35, 1.0), unlit=True)), move(0, -3, 0))


@pytest.mark.parametrize("upscale", ["1", "1.5"])
@pytest.mark.parametrize(
    ("behind", "height", "size", "degrees"),
    [((), 0.6, (120, 68), 1.5), ((), 0.6, (120, 68), -1.5), ((floor(),), 3, (240, 136), 3)],
    ids=["sky", "sky, the other way", "floor"],
)
def test_no_copies_of_a_thin_ring_are_left_on_what_is_behind(device, behind, height, size, degrees, upscale):
    """`degrees`: of the camera, a frame; `height`: of the camera, in metres."""
    settings = pica.Settings().with_values({"antialiasing.upscale": upscale})
    scene, start = ring(*behind), Camera.look_at((0, height, 4), (0, 0, 0))
    with (
        pica.Renderer(scene, size=size, settings=settings, device=device) as renderer,
        pica.Renderer(scene, size=size, settings=settings, device=device) as fresh,
    ):
        for frame in range(12):
            camera = orbited(start, np.zeros(3), np.radians(40 + degrees * frame))
            moving = renderer.render(1, camera=camera).color
        still = fresh.render(16, camera=camera, aovs=["instance"])
    clear = ~dilated(still.aov("instance") == 1, 3)
    off = np.abs(moving - still.color).max(axis=-1) > 0.05 * still.color.mean()
    assert (off & clear).sum() <= 0.002 * clear.sum()
    assert moving[~clear].mean() > 1.5 * moving[clear].mean(), "the ring itself is there"
