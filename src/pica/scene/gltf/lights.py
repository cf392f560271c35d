"""Lights: KHR_lights_punctual, and area lights from a node's extras (docs/guide/gltf.md)."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

from pica.errors import shown
from pica.scene.channels import ALL_CHANNELS, CHANNEL_COUNT
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.light import (
    WHITE,
    DirectionalLight,
    DiskLight,
    Light,
    PointLight,
    RectangleLight,
    ShadowDenoiser,
    SphereLight,
    SpotLight,
    TubeLight,
)

_PUNCTUAL_EXTENSION = "KHR_lights_punctual"
_DIRECTIONAL, _POINT, _SPOT = "directional", "point", "spot"
_PUNCTUAL = {kind: kind for kind in (_DIRECTIONAL, _POINT, _SPOT)}
_AREA: dict[str, tuple[Callable[..., Light], tuple[str, ...]]] = {
    "rectangle": (RectangleLight, ("width", "height")),
    "disk": (DiskLight, ("radius",)),
    "sphere": (SphereLight, ("radius",)),
    "tube": (TubeLight, ("length", "radius")),
}
_DENOISERS: dict[str, ShadowDenoiser] = {"svgf": "svgf", "anisotropic": "anisotropic", "off": "off"}
_VISIBILITY = ("visible_to_camera", "visible_to_reflections", "casts_shadows")


class Lights:
    """The lights of a file."""

    def __init__(self, document: Document) -> None:
        self._document = document

    @cached_property
    def _punctual(self) -> list[Element]:
        return self._document.root.extension(_PUNCTUAL_EXTENSION).objects("lights")

    def get(self, node: Element) -> Light | None:
        """The light that a node carries. Raises SceneError for values that are not as documented, or two lights."""
        if "extensions" not in node and "extras" not in node:  # as nearly all of a large scene's nodes
            return None
        pica = node.pica
        if node.has_extension(_PUNCTUAL_EXTENSION):
            if "light" in pica:
                raise node.fault(f"has two lights, in {_PUNCTUAL_EXTENSION} and in its extras")
            return _punctual_light(node.extension(_PUNCTUAL_EXTENSION).reference("light", self._punctual), node)
        if "light" in pica:
            return replace(_area_light(pica.object("light"), node.name), lighting_channels=_light_channels(pica))
        return None


def read_visibility(node: Element) -> dict[str, Any]:
    """The visibility of a node's mesh, and its lighting channels, as arguments of Node. Raises SceneError."""
    if "extras" not in node:
        return {}
    pica = node.pica
    flags = {name: pica.flag(name, default=True) for name in _VISIBILITY}
    return {**flags, "lighting_channels": _channels(pica)}


def _channels(pica: Element, key: str = "lighting_channels") -> frozenset[int]:
    return frozenset(pica.integers(key, 0, CHANNEL_COUNT - 1)) if key in pica else ALL_CHANNELS


def _light_channels(pica: Element) -> frozenset[int]:
    """Those of a node's light, which may differ from those of its mesh."""
    return _channels(pica, "light_channels" if "light_channels" in pica else "lighting_channels")


def _denoiser(pica: Element) -> ShadowDenoiser | None:
    return pica.choice("shadow_denoiser", _DENOISERS) if "shadow_denoiser" in pica else None


def _punctual_light(light: Element, node: Element) -> Light:
    def extra(key: str) -> Element:
        """The extras with a key; the node's come before the light's."""
        return node.pica if key in node.pica else light.pica

    kind = light.choice("type", _PUNCTUAL)
    own = node.pica
    channels = _light_channels(own if "light_channels" in own else extra("lighting_channels"))
    further: dict[str, Any] = {"lighting_channels": channels, "shadow_denoiser": _denoiser(extra("shadow_denoiser"))}
    color = light.numbers("color", 3, low=0, default=WHITE)
    strength = light.number("intensity", low=0, default=1.0)
    name = light.name or node.name
    if kind == _DIRECTIONAL:
        angle = extra("angular_diameter").number("angular_diameter", 0, math.pi, 0.0)
        return light.apply(DirectionalLight, color, strength, angle, name, **further)
    radius = extra("radius").number("radius", low=0, default=0.0)
    reach = light.number("range", low=0) if "range" in light else None
    if reach == 0:
        raise light.fault("must be more than 0", "range")
    if kind == _POINT:
        return light.apply(PointLight, color, strength, radius, reach, name, **further)
    spot = light.object("spot")
    outer = spot.number("outerConeAngle", 0, math.pi / 2, math.pi / 4)
    inner = spot.number("innerConeAngle", 0, math.pi / 2, 0.0)
    if not inner < outer:
        raise spot.fault(f"innerConeAngle {inner} is not less than outerConeAngle {outer}")
    return light.apply(SpotLight, color, strength, inner, outer, radius, reach, name, **further)


def _area_light(light: Element, name: str) -> Light:
    kind, sizes = light.choice("type", _AREA)
    unknown = light.keys() - {"type", "color", "radiance", "name", "shadow_denoiser", *sizes}
    if unknown:
        raise light.fault(f"{shown(min(unknown))} is not a key of a {light.text('type')} light")
    values: dict[str, Any] = {size: light.number(size, low=0) for size in sizes if size in light}
    if 0 in values.values():
        raise light.fault("a size of 0 gives no light")
    return light.apply(
        kind,
        color=light.numbers("color", 3, low=0, default=WHITE),
        radiance=light.number("radiance", low=0, default=1.0),
        name=light.text("name", default=name),
        shadow_denoiser=_denoiser(light),
        **values,
    )
