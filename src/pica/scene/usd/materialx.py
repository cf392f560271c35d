"""MaterialX' standard_surface and open_pbr_surface, as far as glTF's material extensions describe them.

Autodesk Standard Surface 1.0 (https://autodesk.github.io/standard-surface); OpenPBR Surface 1.1
(https://academysoftwarefoundation.github.io/OpenPBR).
"""

import math
from dataclasses import replace
from typing import Any

from pica.scene.usd.shading import Network
from pica.scene.usd.surface import Color, Map, Surface

STANDARD_SURFACE, OPEN_PBR = "ND_standard_surface_surfaceshader", "ND_open_pbr_surface_surfaceshader"
_WHITE: Color = (1.0, 1.0, 1.0)


def read_standard_surface(network: Network) -> Surface:
    """The surface of a standard_surface; its defaults are the specification's."""
    number, color = network.number, network.plain_color
    depth = number("transmission_depth", 0.0)
    surface = Surface(
        base_color=_scaled(network.color("base_color", (0.8, 0.8, 0.8)), number("base", 0.8)),
        metallic=network.value("metalness", 0.0),
        roughness=network.value("specular_roughness", 0.2),
        emission=_scaled(network.color("emission_color", _WHITE), number("emission", 0.0)),
        opacity=_mean(network.color("opacity", _WHITE)),
        normal=_map(network.value("normal", None, lambda given: None)),
        ior=number("specular_IOR", 1.5),
        specular=min(number("specular", 1.0), 1.0),
        specular_color=color("specular_color", _WHITE),
        transmission=number("transmission", 0.0),
        thin_walled=bool(number("thin_walled", 0.0)),
        coat=network.value("coat", 0.0),
        coat_roughness=network.value("coat_roughness", 0.1),
        sheen_color=_times(color("sheen_color", _WHITE), number("sheen", 0.0)),
        sheen_roughness=number("sheen_roughness", 0.3),
        film_weight=1.0 if number("thin_film_thickness", 0.0) > 0 else 0.0,
        film_ior=number("thin_film_IOR", 1.5),
        film_thickness=number("thin_film_thickness", 0.0),
        anisotropy=number("specular_anisotropy", 0.0),
        anisotropy_rotation=2 * math.pi * number("specular_rotation", 0.0),
    )
    return _transmissive(surface, color("transmission_color", _WHITE), depth, number("transmission_dispersion", 0.0))


def read_open_pbr(network: Network) -> Surface:
    """The surface of an open_pbr_surface; its defaults are the specification's."""
    number, color = network.number, network.plain_color
    surface = Surface(
        base_color=_scaled(network.color("base_color", (0.8, 0.8, 0.8)), number("base_weight", 1.0)),
        metallic=network.value("base_metalness", 0.0),
        roughness=network.value("specular_roughness", 0.3),
        emission=_scaled(network.color("emission_color", _WHITE), number("emission_luminance", 0.0)),
        opacity=network.value("geometry_opacity", 1.0),
        normal=_map(network.value("geometry_normal", None, lambda given: None)),
        ior=number("specular_ior", 1.5),
        specular=min(number("specular_weight", 1.0), 1.0),
        specular_color=color("specular_color", _WHITE),
        transmission=number("transmission_weight", 0.0),
        thin_walled=bool(number("geometry_thin_walled", 0.0)),
        coat=network.value("coat_weight", 0.0),
        coat_roughness=network.value("coat_roughness", 0.0),
        sheen_color=_times(color("fuzz_color", _WHITE), number("fuzz_weight", 0.0)),
        sheen_roughness=number("fuzz_roughness", 0.5),
        film_weight=number("thin_film_weight", 0.0),
        film_ior=number("thin_film_ior", 1.4),
        film_thickness=1000 * number("thin_film_thickness", 0.5),  # micrometres
        anisotropy=number("specular_roughness_anisotropy", 0.0),
    )
    scale, abbe = number("transmission_dispersion_scale", 0.0), number("transmission_dispersion_abbe_number", 20.0)
    dispersion = abbe / scale if scale > 0 else 0.0
    return _transmissive(surface, color("transmission_color", _WHITE), number("transmission_depth", 0.0), dispersion)


def _transmissive(surface: Surface, color: Color, depth: float, abbe: float) -> Surface:
    """With the medium of a transmissive surface: its colour is that after `depth` metres, or that of the surface."""
    if surface.transmission <= 0:
        return replace(surface, thin_walled=True)
    if depth > 0:
        red, green, blue = (-math.log(min(max(each, 1e-6), 1.0)) / depth for each in color)
        absorption, tint = (red, green, blue), _WHITE
    else:
        absorption, tint = (0.0, 0.0, 0.0), color
    return replace(
        surface,
        base_color=tint if surface.transmission >= 1 else surface.base_color,
        absorption=absorption,
        dispersion=20 / abbe if abbe > 0 else 0.0,
    )


def _scaled(color: Any, factor: float) -> Any:
    """A colour or a map times a factor."""
    if isinstance(color, Map):
        red, green, blue, alpha = color.scale
        return color._replace(scale=(red * factor, green * factor, blue * factor, alpha))
    return _times(color, factor)


def _times(color: Color, factor: float) -> Color:
    return color[0] * factor, color[1] * factor, color[2] * factor


def _mean(opacity: Any) -> Any:
    """One number of a colour."""
    return opacity._replace(output="r") if isinstance(opacity, Map) else sum(opacity) / 3


def _map(value: Any) -> Map | None:
    return value if isinstance(value, Map) else None
