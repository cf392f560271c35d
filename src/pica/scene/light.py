"""Lights. Directed ones emit along their node's -Z, as in KHR_lights_punctual.

Photometric units are glTF's. Colours are linear Rec. 709 and multiply the unit. Values that are not finite or negative,
and zero sizes of area lights, are a SceneError with the field's name.
"""

import math
from dataclasses import dataclass
from typing import Literal

from pica.errors import SceneError, shown
from pica.names import checked_names
from pica.scene.channels import ALL_CHANNELS, checked_channels
from pica.scene.checked_field import CheckedField, described
from pica.scene.values import BRIGHTEST, LARGEST, angle, choice, number, optional, positive, text, vector

Color = tuple[float, float, float]
ShadowDenoiser = Literal["svgf", "anisotropic", "off"]
WHITE: Color = (1.0, 1.0, 1.0)
COLOR = vector(3, 0)
"""Checks a colour."""
_STRENGTH = number(0)
WIDEST = math.sqrt(LARGEST / (4 * math.pi))
"""Metres: the largest sphere whose area shaders can represent."""
_LENGTH = number(0, WIDEST)
_SIZE = positive(WIDEST)
_CONE = angle(0, math.pi / 2)
_RANGE = optional(positive())


@dataclass(frozen=True, kw_only=True)
class _AnyLight:
    """Fields of all lights."""

    lighting_channels: CheckedField[frozenset[int]] = CheckedField(checked_channels, ALL_CHANNELS)
    """Of 0 to 5: the light reaches the nodes in one of them, and only these occlude it."""
    shadow_denoiser: CheckedField[ShadowDenoiser | None] = CheckedField(
        optional(choice("svgf", "anisotropic", "off")), None
    )
    """The filter of this light's soft shadow in real time; None: that of the setting shadows.denoiser."""

    def __post_init__(self) -> None:
        for name in ("illuminance", "intensity", "radiance"):
            strength = getattr(self, name, 0.0)
            if not max(getattr(self, "color", WHITE)) * strength <= BRIGHTEST:
                fault = f"{shown(strength)} times the colour is more than {BRIGHTEST:g}"
                raise SceneError(f"{described(self)}: {name}: {fault}")


@checked_names(SceneError)
@dataclass(frozen=True)
class DirectionalLight(_AnyLight):
    """A light at infinite distance, with parallel rays, such as the sun."""

    color: CheckedField[Color] = CheckedField(COLOR, WHITE)
    illuminance: CheckedField[float] = CheckedField(_STRENGTH, 1.0)
    """Lux on a surface that faces the light."""
    angular_diameter: CheckedField[float] = CheckedField(angle(0, math.pi), 0.0)
    """Angular diameter in radians; 0 gives hard shadows. The sun has 0.0093."""
    name: CheckedField[str] = CheckedField(text, "")


@checked_names(SceneError)
@dataclass(frozen=True)
class PointLight(_AnyLight):
    """A light that emits equally in all directions, from a sphere of the given radius."""

    color: CheckedField[Color] = CheckedField(COLOR, WHITE)
    intensity: CheckedField[float] = CheckedField(_STRENGTH, 1.0)
    """Candela."""
    radius: CheckedField[float] = CheckedField(_LENGTH, 0.0)
    """Metres; 0 gives hard shadows."""
    range: CheckedField[float | None] = CheckedField(_RANGE, None)
    """Metres after which the light has faded to nothing; None: never (KHR_lights_punctual, "range")."""
    name: CheckedField[str] = CheckedField(text, "")


@checked_names(SceneError)
@dataclass(frozen=True)
class SpotLight(_AnyLight):
    """A point light limited to a cone."""

    color: CheckedField[Color] = CheckedField(COLOR, WHITE)
    intensity: CheckedField[float] = CheckedField(_STRENGTH, 1.0)
    """Candela, in the centre of the cone."""
    inner_cone_angle: CheckedField[float] = CheckedField(_CONE, 0.0)
    """Radians from the axis at which the light starts to fade."""
    outer_cone_angle: CheckedField[float] = CheckedField(_CONE, math.pi / 4)
    """Radians from the axis at which nothing is left."""
    radius: CheckedField[float] = CheckedField(_LENGTH, 0.0)
    """Metres; 0 gives hard shadows."""
    range: CheckedField[float | None] = CheckedField(_RANGE, None)
    """As PointLight.range."""
    name: CheckedField[str] = CheckedField(text, "")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.inner_cone_angle < self.outer_cone_angle:
            fault = f"{self.inner_cone_angle:g} is not less than outer_cone_angle, {self.outer_cone_angle:g}"
            raise SceneError(f"{described(self)}: inner_cone_angle: {fault}")


@checked_names(SceneError)
@dataclass(frozen=True)
class RectangleLight(_AnyLight):
    """A rectangle in its node's XY plane that emits from its -Z side."""

    color: CheckedField[Color] = CheckedField(COLOR, WHITE)
    radiance: CheckedField[float] = CheckedField(_STRENGTH, 1.0)
    """Nits (candela per square metre)."""
    width: CheckedField[float] = CheckedField(_SIZE, 1.0)
    """Metres along X."""
    height: CheckedField[float] = CheckedField(_SIZE, 1.0)
    """Metres along Y."""
    name: CheckedField[str] = CheckedField(text, "")


@checked_names(SceneError)
@dataclass(frozen=True)
class DiskLight(_AnyLight):
    """A disk in its node's XY plane that emits from its -Z side."""

    color: CheckedField[Color] = CheckedField(COLOR, WHITE)
    radiance: CheckedField[float] = CheckedField(_STRENGTH, 1.0)
    """Nits."""
    radius: CheckedField[float] = CheckedField(_SIZE, 0.5)
    """Metres."""
    name: CheckedField[str] = CheckedField(text, "")


@checked_names(SceneError)
@dataclass(frozen=True)
class SphereLight(_AnyLight):
    """A sphere around its node's origin that emits outwards."""

    color: CheckedField[Color] = CheckedField(COLOR, WHITE)
    radiance: CheckedField[float] = CheckedField(_STRENGTH, 1.0)
    """Nits."""
    radius: CheckedField[float] = CheckedField(_SIZE, 0.5)
    """Metres."""
    name: CheckedField[str] = CheckedField(text, "")


@checked_names(SceneError)
@dataclass(frozen=True)
class TubeLight(_AnyLight):
    """A tube along its node's X axis with round ends, a capsule, that emits outwards."""

    color: CheckedField[Color] = CheckedField(COLOR, WHITE)
    radiance: CheckedField[float] = CheckedField(_STRENGTH, 1.0)
    """Nits."""
    length: CheckedField[float] = CheckedField(_LENGTH, 1.0)
    """Metres between the middles of the two round ends; 0 makes a sphere."""
    radius: CheckedField[float] = CheckedField(_SIZE, 0.05)
    """Metres."""
    name: CheckedField[str] = CheckedField(text, "")


Light = DirectionalLight | PointLight | SpotLight | RectangleLight | DiskLight | SphereLight | TubeLight
"""The type of a node's light."""


def extent(light: Light) -> float:
    """Metres: the largest of an area light's sizes; 0 for other lights, which nodes do not scale."""
    match light:
        case RectangleLight():
            return max(light.width, light.height)
        case TubeLight():
            return max(light.length, light.radius)
        case DiskLight() | SphereLight():
            return light.radius
        case _:
            return 0.0
