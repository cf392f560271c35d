"""Lights: KHR_lights_punctual, and area lights from a node's extras (docs/gltf.md)."""

import math
from dataclasses import replace
from typing import Any

from pica.errors import SceneError
from pica.scene.channels import ALL_CHANNELS, CHANNEL_COUNT
from pica.scene.gltf.checks import choice, extension, flag, listing, mapping, number, numbers, shown, text, whole
from pica.scene.gltf.container import Document
from pica.scene.light import (
    WHITE,
    DirectionalLight,
    DiskLight,
    Light,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
)

_DIRECTIONAL, _POINT, _SPOT = "directional", "point", "spot"
_PUNCTUAL = {kind: kind for kind in (_DIRECTIONAL, _POINT, _SPOT)}
_AREA: dict[str, tuple[type[Light], tuple[str, ...]]] = {
    "rectangle": (RectangleLight, ("width", "height")),
    "disk": (DiskLight, ("radius",)),
    "sphere": (SphereLight, ("radius",)),
}


def read_light(document: Document, node: Any, where: str) -> Light | None:
    """The light that a node carries. Raises SceneError for values that are not as documented, or two lights."""
    reference = extension(node, "KHR_lights_punctual", where)
    pica = _pica_extras(node.extras, where)
    area = mapping(pica.get("light"), f"{where}.extras.pica.light") if "light" in pica else None
    if reference is None:
        if area is None:
            return None
        light = _area_light(area, text(node.name), f"{where}.extras.pica.light")
        return replace(light, lighting_channels=_channels(pica, where))
    if area is not None:
        raise SceneError(f"{where}: has two lights, in KHR_lights_punctual and in its extras")
    return _punctual_light(document, reference.get("light"), pica, text(node.name), where)


def read_visibility(node: Any, where: str) -> dict[str, Any]:
    """Who sees a node's mesh, and its lighting channels, as arguments of Node. Raises SceneError."""
    pica = _pica_extras(node.extras, where)
    seen = ("visible_to_camera", "visible_to_reflections", "casts_shadows")
    flags = {name: flag(pica.get(name), f"{where}.extras.pica.{name}", default=True) for name in seen}
    return {**flags, "lighting_channels": _channels(pica, where)}


def _channels(pica: dict[str, Any], where: str) -> frozenset[int]:
    if pica.get("lighting_channels") is None:
        return ALL_CHANNELS
    where = f"{where}: lighting_channels"
    return frozenset(
        whole(channel, where, 0, CHANNEL_COUNT - 1) for channel in listing(pica["lighting_channels"], where)
    )


def _punctual_light(document: Document, index: object, node_extras: dict[str, Any], name: str, where: str) -> Light:
    root = extension(document.gltf, "KHR_lights_punctual", "the file") or {}
    lights = listing(root.get("lights"), "KHR_lights_punctual.lights")
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(lights):
        raise SceneError(f"{where}: KHR_lights_punctual.lights[{shown(index)}] does not exist ({len(lights)} given)")
    where = f"KHR_lights_punctual.lights[{index}]"
    light = mapping(lights[index], where)
    kind = choice(light.get("type"), f"{where}.type", _PUNCTUAL)
    pica = _pica_extras(light.get("extras"), where) | node_extras
    channels = _channels(pica, where)
    color = numbers(light.get("color"), 3, f"{where}.color", low=0, default=WHITE)
    strength = number(light.get("intensity"), f"{where}.intensity", low=0, default=1.0)
    name = text(light.get("name")) or name
    if kind == _DIRECTIONAL:
        angle = number(pica.get("angular_diameter"), f"{where}: angular_diameter", 0, math.pi, 0.0)
        return DirectionalLight(color, strength, angle, name, lighting_channels=channels)
    radius = number(pica.get("radius"), f"{where}: radius", low=0, default=0.0)
    reach = None if light.get("range") is None else number(light["range"], f"{where}.range", low=0)
    if reach == 0:
        raise SceneError(f"{where}.range: must be more than 0")
    if kind == _POINT:
        return PointLight(color, strength, radius, reach, name, lighting_channels=channels)
    spot = mapping(light.get("spot"), f"{where}.spot")
    outer = number(spot.get("outerConeAngle"), f"{where}.spot.outerConeAngle", 0, math.pi / 2, math.pi / 4)
    inner = number(spot.get("innerConeAngle"), f"{where}.spot.innerConeAngle", 0, math.pi / 2, 0.0)
    if not inner < outer:
        raise SceneError(f"{where}.spot: innerConeAngle {inner} is not less than outerConeAngle {outer}")
    return SpotLight(color, strength, inner, outer, radius, reach, name, lighting_channels=channels)


def _area_light(light: dict[str, Any], name: str, where: str) -> Light:
    kind, sizes = choice(light.get("type"), f"{where}.type", _AREA)
    unknown = light.keys() - {"type", "color", "radiance", *sizes}
    if unknown:
        raise SceneError(f"{where}: {shown(min(unknown))} is not a key of a {light['type']} light")
    values: dict[str, Any] = {
        size: number(light[size], f"{where}.{size}", low=0) for size in sizes if light.get(size) is not None
    }
    if 0 in values.values():
        raise SceneError(f"{where}: a size of 0 gives no light")
    return kind(
        color=numbers(light.get("color"), 3, f"{where}.color", low=0, default=WHITE),
        radiance=number(light.get("radiance"), f"{where}.radiance", low=0, default=1.0),
        name=name,
        **values,
    )


def _pica_extras(extras: object, where: str) -> dict[str, Any]:
    """The part of an object's extras that is meant for pica; extras of any other form belong to somebody else."""
    return mapping(extras.get("pica"), f"{where}.extras.pica") if isinstance(extras, dict) else {}
