"""Surfaces with fibres: velvet, felt, woven cloth, dust."""

from dataclasses import dataclass

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.checked_field import CheckedField
from pica.scene.light import WHITE, Color
from pica.scene.values import number, vector


@checked_names(SceneError)
@dataclass(frozen=True)
class Sheen:
    """Light scattered by fibres, strongest at grazing angles of view or light
    (KHR_materials_sheen; docs/guide/materials.md, "Sheen").

    Raises SceneError for values out of range.
    """

    color: CheckedField[Color] = CheckedField(vector(3, 0, 1), WHITE)
    """Linear Rec. 709, 0 to 1."""
    roughness: CheckedField[float] = CheckedField(number(0, 1), 0.5)
    """0 to 1, below 0.07 as that: how much the fibres' directions vary; the lower, the narrower the seam of light."""
