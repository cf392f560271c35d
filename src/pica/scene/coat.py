"""Clear coats over a material: lacquer, varnish, wax, ice."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.checked_field import CheckedField
from pica.scene.light import COLOR, Color
from pica.scene.values import UnfitError, flag, items, number

if TYPE_CHECKING:
    from pica.scene.material import Material

MAX_COATS = 3
"""With the base they make a stack of four layers; table_rows.slang: MATERIAL_COATS."""
_SHARE = number(0, 1)
_NOT_NEGATIVE = number(0)
_CLEAR: Color = (0.0, 0.0, 0.0)


@checked_names(SceneError)
@dataclass(frozen=True)
class Coat:
    """A dielectric layer that transmits light to the layers below (docs/guide/materials.md, "Coats").

    Raises SceneError for values out of range: 0 to 1 unless stated otherwise.
    """

    strength: CheckedField[float] = CheckedField(_SHARE, 1.0)
    """Fraction of the surface that it covers."""
    roughness: CheckedField[float] = CheckedField(_SHARE, 0.0)
    """Of its upper side; GGX's alpha is roughness squared."""
    ior: CheckedField[float] = CheckedField(number(1), 1.5)
    """Index of refraction, 1 or more."""
    absorption: CheckedField[Color] = CheckedField(COLOR, _CLEAR)
    """Extinction coefficient per metre, 0 or more."""
    thickness: CheckedField[float] = CheckedField(_NOT_NEGATIVE, 0.0)
    """Metres, 0 or more; only absorption depends on it."""
    air_below: CheckedField[bool] = CheckedField(flag, False)
    """True: the layer below reflects as if it lay in air, as glTF has it. False: by both indices of refraction, so that
    nothing is reflected between two that are the same."""

    @property
    def transmittance(self) -> Color:
        """Transmittance of one perpendicular pass (Beer, Lambert)."""
        red, green, blue = (math.exp(-absorbed * self.thickness) for absorbed in self.absorption)
        return red, green, blue


_COATS = items(Coat)


def coats(values: Any) -> tuple[Coat, ...]:
    """Checks `Material.coats`."""
    layers = tuple(_COATS(values))
    if len(layers) > MAX_COATS:
        raise UnfitError(f"{len(layers)} coats are more than {MAX_COATS}")
    return layers


def baked(material: "Material") -> Sequence[Coat]:
    """The coats to evaluate: those without effect are omitted, and equal neighbours are merged."""
    layers: list[Coat] = []
    # A textured top coat keeps its position.
    varies = material.coat_texture is not None
    textured = varies or material.coat_roughness_texture is not None
    for place, coat in enumerate(material.coats):
        if coat.strength == 0 and not (place == 0 and textured):
            continue
        above = None if not layers or (len(layers) == 1 and varies) else layers[-1]
        if above is not None and _are_one(above, coat):
            layers[-1] = _joined(above, coat)
        else:
            layers.append(coat)
    return layers


def _are_one(above: Coat, below: Coat) -> bool:
    return above.ior == below.ior and above.strength == below.strength == 1 and not above.air_below


def _joined(above: Coat, below: Coat) -> Coat:
    """No reflection at the interface of both."""
    red, green, blue = (
        a * above.thickness + b * below.thickness for a, b in zip(above.absorption, below.absorption, strict=True)
    )
    return replace(above, absorption=(red, green, blue), thickness=1.0, air_below=below.air_below)
