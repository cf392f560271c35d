"""Lights of UsdLux (https://openusd.org/release/api/usd_lux_page_front.html): units and formulas are LightAPI's.

An intensity of 1 is 1 nit of emitted luminance, times 2^exposure and the colours.
"""

import math
from typing import Any

import numpy as np
from pxr import Usd, UsdLux

from pica.scene.usd.stage import Stage

_AREA = ("SphereLight", "RectLight", "DiskLight", "CylinderLight")
DOMES = ("DomeLight", "DomeLight_1")
_PUNCTUAL = "KHR_lights_punctual"
_LEFT_OUT = ("GeometryLight", "PortalLight", "PluginLight")
_SMALLEST = 1e-5
"""Radius of a light of no size, in units of the stage."""


class Lights:
    """The lights of a stage; domes are elsewhere."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._asset = stage, stage.conversion.asset

    def get(self, prim: Usd.Prim, scale: float) -> dict[str, Any]:
        """The keys of a light's node, none for other prims; `scale`: metres of a unit at the prim."""
        kind = prim.GetTypeName()
        if kind in _LEFT_OUT or (prim.HasAPI(UsdLux.LightAPI) and kind in ("Mesh", "Volume")):
            self._stage.conversion.warn(f"lights of type {kind} are left out")
            return {}
        if kind not in ("DistantLight", *_AREA):
            return {}
        light = UsdLux.LightAPI(prim)
        color, luminance = light_color(self._stage, light)
        if self._number(light.GetNormalizeAttr(), 0.0):
            luminance /= self._size_factor(prim)
        if self._value(light.GetDiffuseAttr(), 1.0) != 1 or self._value(light.GetSpecularAttr(), 1.0) != 1:
            self._stage.conversion.warn("diffuse and specular of lights are left out")
        if kind == "DistantLight":
            return self._distant(prim, color, luminance)
        shaping = UsdLux.ShapingAPI(prim)
        if self._value(shaping.GetShapingIesFileAttr(), None) or self._number(shaping.GetShapingFocusAttr(), 0.0):
            self._stage.conversion.warn("shaping by a focus or an IES profile is left out")
        angle = self._number(shaping.GetShapingConeAngleAttr(), 90.0)
        if kind == "SphereLight" and (angle < 90 or self._attribute(prim, "treatAsPoint", False)):
            return self._point(prim, color, luminance, angle, scale)
        if angle < 90:
            self._stage.conversion.warn(f"the cone of a {kind} is left out")
        if prim.GetAttribute("inputs:texture:file").HasAuthoredValue():
            self._stage.conversion.warn("textures of rectangle lights are left out")
        return self._node({"light": self._area(prim, kind) | {"color": list(color), "radiance": luminance}})

    def _area(self, prim: Usd.Prim, kind: str) -> dict[str, Any]:
        """Type and sizes."""
        radius = max(self._attribute(prim, "inputs:radius", 0.5), _SMALLEST)
        match kind:
            case "RectLight":
                sizes = {
                    key: max(self._attribute(prim, f"inputs:{key}", 1.0), _SMALLEST) for key in ("width", "height")
                }
                return {"type": "rectangle"} | sizes
            case "CylinderLight":
                return {
                    "type": "tube",
                    "length": max(self._attribute(prim, "inputs:length", 1.0), _SMALLEST),
                    "radius": radius,
                }
        return {"type": "disk" if kind == "DiskLight" else "sphere", "radius": radius}

    def _distant(self, prim: Usd.Prim, color: Any, luminance: float) -> dict[str, Any]:
        """Illuminance of a disk of that luminance: L pi sin^2(angle / 2)."""
        angle = math.radians(min(max(self._attribute(prim, "inputs:angle", 0.53), 0.0), 180.0))
        illuminance = luminance * (math.pi * math.sin(angle / 2) ** 2 if angle else 1.0)
        entry = {"type": "directional", "color": color, "intensity": illuminance}
        return self._punctual(prim, entry, {"angular_diameter": angle})

    def _point(self, prim: Usd.Prim, color: Any, luminance: float, angle: float, scale: float) -> dict[str, Any]:
        """A sphere as a point or spot light: its intensity is L pi r^2, in metres."""
        radius = max(self._attribute(prim, "inputs:radius", 0.5), _SMALLEST) * scale
        entry: dict[str, Any] = {"type": "point", "color": color, "intensity": luminance * math.pi * radius**2}
        if angle < 90:
            softness = self._number(UsdLux.ShapingAPI(prim).GetShapingConeSoftnessAttr(), 0.0)
            outer = math.radians(max(angle, 0.1))
            inner = outer * min(max(1 - softness, 0.0), 0.999)
            entry |= {"type": "spot", "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}
        point = bool(self._attribute(prim, "treatAsPoint", False))
        return self._punctual(prim, entry, {"radius": 0.0 if point else radius})

    def _punctual(self, prim: Usd.Prim, entry: dict[str, Any], extras: dict[str, Any]) -> dict[str, Any]:
        entry |= {"name": prim.GetName(), "extras": self._asset.extras({}, extras)}
        light = self._asset.add_once("lights", entry, _PUNCTUAL)
        return {"extensions": self._asset.extensions(KHR_lights_punctual={"light": light})}

    def _node(self, pica: dict[str, Any]) -> dict[str, Any]:
        return {"extras": self._asset.extras({}, pica)}

    def _size_factor(self, prim: Usd.Prim) -> float:
        """What `normalize` divides by: the area, or the projected solid angle of a distant light."""
        kind, radius = prim.GetTypeName(), max(self._attribute(prim, "inputs:radius", 0.5), _SMALLEST)
        match kind:
            case "DistantLight":
                angle = math.radians(self._attribute(prim, "inputs:angle", 0.53))
                return math.pi * math.sin(angle / 2) ** 2 if angle > 0 else 1.0
            case "RectLight":
                area = self._attribute(prim, "inputs:width", 1.0) * self._attribute(prim, "inputs:height", 1.0)
            case "DiskLight":
                area = math.pi * radius**2
            case "CylinderLight":
                area = 2 * math.pi * radius * self._attribute(prim, "inputs:length", 1.0)
            case _:
                area = 4 * math.pi * radius**2
        world = np.array(self._stage.world(prim))[:3, :3]
        scale = abs(np.linalg.det(world)) ** (1 / 3)
        return max(area * scale**2, 1e-12)

    def _attribute(self, prim: Usd.Prim, name: str, default: Any) -> Any:
        return self._value(prim.GetAttribute(name), default)

    def _value(self, attribute: Usd.Attribute, default: Any) -> Any:
        value = attribute.Get(self._stage.time) if attribute else None
        return default if value is None else value

    def _number(self, attribute: Usd.Attribute, default: float) -> float:
        return float(self._value(attribute, default))


def light_color(stage: Stage, light: UsdLux.LightAPI) -> tuple[list[float], float]:
    """Colour, and luminance in nits before it is normalized."""

    def value(attribute: Usd.Attribute, default: Any) -> Any:
        given = attribute.Get(stage.time) if attribute else None
        return default if given is None else given

    color = np.array(value(light.GetColorAttr(), (1.0, 1.0, 1.0)), float)
    if value(light.GetEnableColorTemperatureAttr(), False):
        kelvin = value(light.GetColorTemperatureAttr(), 6500.0)
        color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    exposure = min(float(value(light.GetExposureAttr(), 0.0)), 100.0)
    luminance = float(value(light.GetIntensityAttr(), 1.0)) * 2**exposure
    return np.maximum(color, 0).tolist(), max(luminance, 0.0)
