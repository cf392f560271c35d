"""Estimates of the amount of light in a scene, for choices and warnings, without tracing."""

import numpy as np
from numpy.typing import NDArray

from pica.scene.light import DirectionalLight, Light, PointLight, SpotLight
from pica.scene.material import Image, Material
from pica.scene.material_registry import STANDARD
from pica.scene.mesh import Mesh
from pica.scene.model import Scene


def average_emission(material: Material) -> float:
    """Mean emitted luminance of the material, nits; for estimates only."""
    # Unlit surfaces show their base colour instead (standard_material.slang).
    if material.unlit and material.type == STANDARD:
        return 0.0
    luminance = np.dot(material.emission, (0.2126, 0.7152, 0.0722))
    texture = material.emissive_texture
    if texture is not None and luminance > 0:
        exponent = 1.0 if texture.image.encoding == "linear" else 2.2
        pixels = (_quarter(texture.image) / 255.0) ** exponent
        luminance *= float(np.mean(pixels @ (0.2126, 0.7152, 0.0722)))
    return float(luminance)


def _quarter(image: Image) -> NDArray[np.uint8]:
    """(height, width, 3) about a quarter of the image's rows and columns."""
    if image.blocks is not None:
        return image.blocks.pixels(min(2, len(image.blocks.levels) - 1))[..., :3]
    return image.pixels[::4, ::4, :3]


def has_lights(scene: Scene) -> bool:
    """Whether there is a light with power; emissive materials and the environment do not count."""
    return any(node.light is not None and _gives_light(node.light) for node in scene.nodes())


def emitted_illuminance(scene: Scene) -> float:
    """Mean illuminance by emissive materials in lux, if all their light reached the bounding box of the scene."""
    powers: dict[Mesh, float] = {}
    total = 0.0
    for node in scene.nodes():
        if node.mesh is None:
            continue
        if node.mesh not in powers:
            powers[node.mesh] = _power(node.mesh)
        if powers[node.mesh] > 0:
            linear = node.instance_transforms()[:, :3, :3]
            total += powers[node.mesh] * float((linear**2).sum()) / 3  # areas grow by the mean square of the scales
    if total == 0:
        return 0.0
    low, high = scene.bounds()
    width, height, depth = high - low
    return total / max(2 * float(width * height + height * depth + depth * width), 1e-30)


def _power(mesh: Mesh) -> float:
    """Luminous flux of a mesh in lumen, untransformed."""
    power = 0.0
    for section in mesh.sections:
        emission = average_emission(section.material)
        if emission > 0:
            corners = section.positions[section.indices].astype(np.float64)
            sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            area = float(np.linalg.norm(sides, axis=1).sum()) / 2
            power += np.pi * emission * area * (2 if section.material.double_sided else 1)
    return power


def _gives_light(light: Light) -> bool:
    if isinstance(light, DirectionalLight):
        strength = light.illuminance
    elif isinstance(light, PointLight | SpotLight):
        strength = light.intensity
    else:
        strength = light.radiance
    return strength * max(light.color) > 0
