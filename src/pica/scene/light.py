"""Lights. Each shines along its node's -Z (those that have a direction), as in KHR_lights_punctual.

Photometric units are glTF's. Colours are linear Rec. 709 and multiply the unit.
"""

from dataclasses import dataclass
from typing import Literal

from pica.scene.channels import ALL_CHANNELS, checked_channels

Color = tuple[float, float, float]
WHITE: Color = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class _AnyLight:
    lighting_channels: frozenset[int] = ALL_CHANNELS
    """Of 0 to 5: the light reaches the nodes that are in one of them, and only these hide it."""

    shadow_denoiser: Literal["svgf", "anisotropic", "off"] | None = None
    """The filter of this light's soft shadow in real time; None: as the setting shadows.denoiser says."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "lighting_channels", checked_channels(self.lighting_channels))


@dataclass(frozen=True)
class DirectionalLight(_AnyLight):
    """A light so far away that its rays are parallel, such as the sun."""

    color: Color = WHITE
    illuminance: float = 1.0
    """Lux on a surface that faces the light."""
    angular_diameter: float = 0.0
    """Radians across the light's disk as seen from the scene; 0 gives hard shadows. The sun has 0.0093."""
    name: str = ""


@dataclass(frozen=True)
class PointLight(_AnyLight):
    """A light that shines equally in all directions, from a sphere of the given radius."""

    color: Color = WHITE
    intensity: float = 1.0
    """Candela."""
    radius: float = 0.0
    """Metres; 0 gives hard shadows."""
    range: float | None = None
    """Metres after which the light has faded to nothing; None: never (KHR_lights_punctual, "range")."""
    name: str = ""


@dataclass(frozen=True)
class SpotLight(_AnyLight):
    """A point light limited to a cone."""

    color: Color = WHITE
    intensity: float = 1.0
    """Candela, in the centre of the cone."""
    inner_cone_angle: float = 0.0
    """Radians from the axis at which the light starts to fade."""
    outer_cone_angle: float = 0.7853981633974483
    """Radians from the axis at which nothing is left."""
    radius: float = 0.0
    """Metres; 0 gives hard shadows."""
    range: float | None = None
    """As PointLight.range."""
    name: str = ""


@dataclass(frozen=True)
class RectangleLight(_AnyLight):
    """A rectangle in its node's XY plane that shines from its -Z side."""

    color: Color = WHITE
    radiance: float = 1.0
    """Nits (candela per square metre)."""
    width: float = 1.0
    """Metres along X."""
    height: float = 1.0
    """Metres along Y."""
    name: str = ""


@dataclass(frozen=True)
class DiskLight(_AnyLight):
    """A disk in its node's XY plane that shines from its -Z side."""

    color: Color = WHITE
    radiance: float = 1.0
    """Nits."""
    radius: float = 0.5
    """Metres."""
    name: str = ""


@dataclass(frozen=True)
class SphereLight(_AnyLight):
    """A sphere around its node's origin that shines outwards."""

    color: Color = WHITE
    radiance: float = 1.0
    """Nits."""
    radius: float = 0.5
    """Metres."""
    name: str = ""


Light = DirectionalLight | PointLight | SpotLight | RectangleLight | DiskLight | SphereLight
