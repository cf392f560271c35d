"""Scenes in which nothing mirrors sharply keep a quarter of the reflection rays."""

import numpy as np
import pytest

import pica
from pica.gpu_scene.mirrors import may_mirror
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scene.material import Image, Material, Texture
from pica.scenes.basic_meshes import sphere
from tests.building import placed, scene_of, settings, uniform

MAP = Texture(Image(np.full((1, 1, 4), 128, np.uint8)))


@pytest.mark.parametrize(
    ("material", "may"),
    [
        (Material(metallic=1.0, roughness=0.05), True),
        (Material(metallic=1.0, roughness=0.3), False),
        (Material(metallic=1.0, roughness=1.0, metallic_roughness_texture=MAP), True),
        (Material(metallic=0.0, roughness=0.05), False),
        (Material(base_color=(0.01, 0.01, 0.01, 1), metallic=1.0, roughness=0.05), False),
        (Material(metallic=1.0, roughness=0.5, coats=(Coat(strength=1.0, roughness=0.0),)), True),
    ],
)
def test_what_may_mirror_sharply(material, may):
    assert may_mirror(material) == may


@pytest.mark.device
def test_rays_follow_an_edited_material(device):
    material = Material(metallic=1.0, roughness=0.5)
    scene = scene_of(placed(sphere(1.0, material)), environment=uniform(1, 1, 1))
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=np.radians(50))
    chosen = settings({"reflections.mode": "ray_traced"})
    with pica.Renderer(scene, size=(32, 18), settings=chosen, device=device) as renderer:
        rough = renderer.count_rays(camera)["reflection_rays"]
        material.roughness = 0.05
        sharp = renderer.count_rays(camera)["reflection_rays"]
        material.roughness = 0.5
        again = renderer.count_rays(camera)["reflection_rays"]
    assert 0 < 3 * max(rough, again) < sharp < 5 * min(rough, again)  # of 2x2 pixels another one each frame
