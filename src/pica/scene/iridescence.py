"""Thin films on a surface: soap, oil, anodized metal, beetles' wings."""

from dataclasses import dataclass

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.checked_field import CheckedField
from pica.scene.values import number

_SHARE = number(0, 1)
_NANOMETRES = number(0, 1e5)


@checked_names(SceneError)
@dataclass(frozen=True)
class Iridescence:
    """A thin film, whose interference colour depends on its thickness and the angle
    (KHR_materials_iridescence; docs/guide/materials.md, "Iridescence").

    Raises SceneError for values out of range.
    """

    strength: CheckedField[float] = CheckedField(_SHARE, 1.0)
    """Fraction of the surface that it covers, 0 to 1."""
    ior: CheckedField[float] = CheckedField(number(1), 1.3)
    """Index of refraction, 1 or more."""
    thickness_minimum: CheckedField[float] = CheckedField(_NANOMETRES, 100.0)
    """Nanometres, 0 to 100,000, where `Material.iridescence_thickness_texture` is 0; may be the larger one."""
    thickness_maximum: CheckedField[float] = CheckedField(_NANOMETRES, 400.0)
    """Nanometres, 0 to 100,000, where the texture is 1 or absent."""
