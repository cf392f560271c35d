"""Lights: KHR_lights_punctual, and area lights in a node's extras (docs/guide/gltf.md)."""

from typing import Any

from pica.scene.channels import ALL_CHANNELS
from pica.scene.gltf_export.container import Asset, differing
from pica.scene.light import WHITE, DirectionalLight, DiskLight, PointLight, RectangleLight, SpotLight, TubeLight
from pica.scene.node import Node

_EXTENSION = "KHR_lights_punctual"
_VISIBILITY = ("visible_to_camera", "visible_to_reflections", "casts_shadows")


def punctual_light(asset: Asset, node: Node, is_animated: bool) -> dict[str, Any] | None:
    """The extension of a node with a light without a size; None for other nodes."""
    light = node.light
    if not isinstance(light, DirectionalLight | PointLight | SpotLight):
        return None
    entry: dict[str, Any] = {"name": light.name or node.name} | differing(color=(light.color, WHITE))
    pica: dict[str, Any] = {"shadow_denoiser": light.shadow_denoiser}
    if isinstance(light, DirectionalLight):
        entry |= {"type": "directional", "intensity": light.illuminance}
        pica |= differing(angular_diameter=(light.angular_diameter, 0.0))
    else:
        entry |= {"type": "point", "intensity": light.intensity, "range": light.range}
        pica |= differing(radius=(light.radius, 0.0))
    if isinstance(light, SpotLight):
        cone = {"innerConeAngle": light.inner_cone_angle, "outerConeAngle": light.outer_cone_angle}
        entry |= {"type": "spot", "spot": cone}
    entry["extras"] = asset.extras({}, pica)
    return {"light": asset.add_once("lights", entry, _EXTENSION, node if is_animated else None)}


def area_light(node: Node) -> dict[str, Any] | None:
    """The light of a node for its extras; None if it has none, or one of KHR_lights_punctual."""
    light = node.light
    if light is None or isinstance(light, DirectionalLight | PointLight | SpotLight):
        return None
    if isinstance(light, RectangleLight):
        sizes: dict[str, Any] = {"type": "rectangle", "width": light.width, "height": light.height}
    elif isinstance(light, TubeLight):
        sizes = {"type": "tube", "length": light.length, "radius": light.radius}
    else:
        sizes = {"type": "disk" if isinstance(light, DiskLight) else "sphere", "radius": light.radius}
    further = differing(
        color=(light.color, WHITE), name=(light.name, node.name), shadow_denoiser=(light.shadow_denoiser, None)
    )
    return sizes | {"radiance": light.radiance} | further


def visibility(node: Node) -> dict[str, Any]:
    """The keys of a node's extras for visibility and lighting channels."""
    values = {name: False for name in _VISIBILITY if not getattr(node, name)}
    own = node.lighting_channels
    channels = {"lighting_channels": (own, ALL_CHANNELS)}
    if node.light is not None:
        channels["light_channels"] = node.light.lighting_channels, own
    return values | {key: sorted(value) for key, value in differing(**channels).items()}
