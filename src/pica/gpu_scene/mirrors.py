"""Which materials may mirror sharply, so that reflections need a ray for each pixel."""

import numpy as np

from pica.color import luminance
from pica.scene.coat import baked
from pica.scene.material import Material
from pica.scene.material_registry import STANDARD

_SHARP, _MIRRORING = 0.1, 0.2
"""Roughness and reflectance; as light_sampling/reflection_ray_weight.slang."""


def may_mirror(material: Material) -> bool:
    """Whether any point of a material may have a lobe as sharp and a reflectance as high as `mirrorsSharply` demands.

    Textures multiply roughness and metalness, and types other than the standard one may change all.
    """
    if material.type != STANDARD:
        return True
    textured = material.metallic_roughness_texture is not None
    coats = baked(material)
    rough = textured or material.roughness <= _SHARP
    sharp = rough or material.coat_roughness_texture is not None or any(coat.roughness <= _SHARP for coat in coats)
    dielectric = material.specular * ((material.ior - 1) / (material.ior + 1)) ** 2 if material.ior > 0 else 1.0
    metallic = float(luminance(np.array(material.base_color[:3]))) if material.metallic > 0 else 0.0
    return sharp and max(metallic, dielectric) >= _MIRRORING
