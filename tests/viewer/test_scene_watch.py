"""What is noticed of a scene's changes."""

import numpy as np
import pytest

import pica
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from pica.viewer.scene_watch import SceneWatch
from tests.building import lambert, placed, scene_of, uniform


def textured() -> pica.Material:
    return pica.Material(base_color_texture=pica.Texture.from_array(np.ones((2, 2)), encoding="srgb"))


@pytest.fixture
def scene() -> pica.Scene:
    return scene_of(placed(box(1, textured()), name="cube"), pica.Node("lamp", light=pica.PointLight()))


def _other_material(scene):
    scene.roots[0].mesh.sections[0].material = lambert(0.1)


def _other_pixels(scene):
    scene.roots[0].mesh.sections[0].material.base_color_texture.image.pixels = np.zeros((1, 1, 4), np.uint8)


CHANGES = {
    "place": lambda scene: setattr(scene.roots[0], "transform", move(1, 0, 0)),
    "light": lambda scene: setattr(scene.roots[1], "light", pica.PointLight(intensity=2.0)),
    "environment": lambda scene: setattr(scene, "environment", uniform(1, 1, 1)),
    "node": lambda scene: scene.add(pica.Node("more")),
    "mesh": lambda scene: setattr(scene.roots[0], "mesh", pica.Mesh([box(2, lambert())])),
    "material": _other_material,
    "colour": lambda scene: setattr(scene.roots[0].mesh.sections[0].material, "roughness", 0.1),
    "pixels": _other_pixels,
}


@pytest.mark.parametrize("change", CHANGES)
def test_every_change_is_noticed_once(scene, change):
    watch = SceneWatch(scene)
    assert not watch.take()
    CHANGES[change](scene)
    assert watch.take() and not watch.take()


def test_what_comes_later_is_watched_too(scene):
    watch = SceneWatch(scene)
    scene.add(placed(box(1, lambert()), name="late")).mesh.sections[0].material = textured()
    scene.roots[0].mesh.sections[0].material = late = textured()
    assert watch.take()
    late.base_color_texture.image.pixels = np.zeros((1, 1, 4), np.uint8)
    assert watch.take()
    scene.roots[2].mesh.sections[0].material.roughness = 0.3
    assert watch.take()
