"""Surfaces with grooves that all run one way: brushed metal, hair, vinyl records."""

from dataclasses import dataclass

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.checked_field import CheckedField
from pica.scene.values import number


@checked_names(SceneError)
@dataclass(frozen=True)
class Anisotropy:
    """Highlights stretched along the tangent (KHR_materials_anisotropy; docs/guide/materials.md).

    Raises SceneError for values out of range.
    """

    strength: CheckedField[float] = CheckedField(number(0, 1), 1.0)
    """0 to 1; GGX's alpha along the tangent is interpolated from the base value to 1 by its square."""
    rotation: CheckedField[float] = CheckedField(number(), 0.0)
    """Radians, counter-clockwise from the tangent, which follows the texture coordinates."""
