"""OmniPBR, the MDL material of most files from NVIDIA Omniverse and Isaac Sim, by its documented parameters
(https://docs.omniverse.nvidia.com/materials-and-rendering/latest/templates/OmniPBR.html)."""

import math
from typing import Any

from pica.scene.usd.shading import Network
from pica.scene.usd.surface import Map, Surface, Transform

NAMES = ("OmniPBR", "OmniPBR_Opacity", "OmniPBR_ClearCoat", "OmniPBR_ClearCoat_Opacity")
"""Of the materials in MDL files. Their clear coats are left out."""


def read_omni_pbr(network: Network) -> Surface:
    """The surface of an OmniPBR; its defaults are the documented ones."""
    number, color = network.number, network.plain_color
    transform = _transform(network)

    def texture(name: str, output: str = "rgb") -> Map | None:
        return network.file_map(name, output, transform)

    tint = color("diffuse_tint", (1.0, 1.0, 1.0))
    brightness = number("albedo_brightness", 1.0)
    factor = tuple(each * brightness for each in tint)
    base = texture("diffuse_texture")
    plain = color("diffuse_color_constant", (0.2, 0.2, 0.2))
    packed = texture("ORM_texture") if number("enable_ORM_texture", 0.0) else None
    maps = {"reflectionroughness_texture": "g", "metallic_texture": "b"}
    rough, metal = (
        texture(name) if packed is None else packed._replace(output=channel) for name, channel in maps.items()
    )
    normal, bump = texture("normalmap_texture"), number("bump_factor", 1.0)
    emission: Any = (0.0, 0.0, 0.0)
    if number("enable_emission", 0.0):
        strength = number("emissive_intensity", 40.0)
        emission = tuple(each * strength for each in color("emissive_color", (1.0, 0.1, 0.1)))
    opacity: Any = 1.0
    if number("enable_opacity", 0.0):
        mask = texture("opacity_texture", "r") if number("enable_opacity_texture", 0.0) else None
        opacity = number("opacity_constant", 1.0) if mask is None else mask
    return Surface(
        base_color=_times(plain, factor) if base is None else base._replace(scale=(*factor, 1.0)),
        metallic=_mixed(number("metallic_constant", 0.0), metal, number("metallic_texture_influence", 0.0)),
        roughness=_mixed(
            number("reflection_roughness_constant", 0.5), rough, number("reflection_roughness_texture_influence", 0.0)
        ),
        emission=emission,
        opacity=opacity,
        cutoff=number("opacity_threshold", 0.0),
        normal=None if normal is None else normal._replace(scale=(2 * bump,) * 4, bias=(-1.0,) * 4),
        occlusion=packed._replace(output="r") if packed else texture("ao_texture", "r"),
        specular=min(2 * number("specular_level", 0.5), 1.0),
    )


def _times(color: Any, factor: Any) -> Any:
    return tuple(a * b for a, b in zip(color, factor, strict=True))


def _mixed(constant: float, texture: Map | None, influence: float) -> float | Map:
    """The constant, and as much of the texture as its influence says."""
    if texture is None or influence <= 0:
        return constant
    return texture._replace(scale=(influence,) * 4, bias=((1 - influence) * constant,) * 4)


def _transform(network: Network) -> Transform | None:
    """Of texture coordinates."""
    scale, shift = network.pair("texture_scale", (1.0, 1.0)), network.pair("texture_translate", (0.0, 0.0))
    angle = math.radians(network.number("texture_rotate", 0.0))
    c, s = math.cos(angle), math.sin(angle)
    transform = (c * scale[0], -s * scale[1], shift[0], s * scale[0], c * scale[1], shift[1])
    return None if transform == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0) else transform
