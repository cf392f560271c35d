"""UsdPreviewSurface (https://openusd.org/release/spec_usdpreviewsurface.html)."""

from typing import Any

from pica.scene.usd.shading import Network
from pica.scene.usd.surface import Map, Surface

IDS = ("UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader")


def read_preview_surface(network: Network) -> Surface:
    """The surface of a UsdPreviewSurface."""
    surface = Surface(
        base_color=network.color("diffuseColor", (0.18, 0.18, 0.18)),
        metallic=network.value("metallic", 0.0),
        roughness=network.value("roughness", 0.5),
        emission=network.color("emissiveColor", (0.0, 0.0, 0.0)),
        opacity=network.value("opacity", 1.0),
        cutoff=network.number("opacityThreshold", 0.0),
        normal=_map(network.value("normal", None, lambda given: None)),
        occlusion=_map(network.value("occlusion", 1.0)),
        ior=network.number("ior", 1.5),
        coat=network.value("clearcoat", 0.0),
        coat_roughness=network.value("clearcoatRoughness", 0.01),
    )
    if network.number("useSpecularWorkflow", 0.0):
        surface.specular_workflow = network.plain_color("specularColor", (0.0, 0.0, 0.0))
    surface.takes_colors = network.vertex_colors
    return surface


def _map(value: Any) -> Map | None:
    return value if isinstance(value, Map) else None
