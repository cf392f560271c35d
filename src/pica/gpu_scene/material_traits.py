"""Properties of materials that frames are declared for: which rows of the table have them."""

from collections.abc import Callable, Mapping
from typing import Literal

from pica.gpu_scene.mirrors import may_mirror
from pica.scene.material import AlphaMode, Material

Trait = Literal["transmissive", "rough_transmissive", "blended", "translucent", "sheet", "mirror"]

ROUGH = 0.2
"""Roughness of transmissive surfaces from which on what lies behind is blurred; as transparency_rays.slang."""
_TRAITS: Mapping[Trait, Callable[[Material], bool]] = {
    "transmissive": lambda material: material.transmission > 0,
    # Textures multiply roughness.
    "rough_transmissive": lambda material: material.transmission > 0 and material.roughness >= ROUGH,
    "blended": lambda material: material.alpha_mode is AlphaMode.BLEND,
    "translucent": Material.passes_diffusely,
    "sheet": lambda material: material.passes_diffusely() and material.thin_walled,
    "mirror": may_mirror,
}


class MaterialTraits:
    """The rows of materials in use, by trait."""

    def __init__(self) -> None:
        self._rows: dict[Trait, set[int]] = {trait: set() for trait in _TRAITS}

    def note(self, row: int, material: Material) -> None:
        """A row has been packed."""
        for trait, has in _TRAITS.items():
            (self._rows[trait].add if has(material) else self._rows[trait].discard)(row)

    def forget(self, row: int) -> None:
        """A row is given back."""
        for rows in self._rows.values():
            rows.discard(row)

    def any(self, trait: Trait) -> bool:
        """Whether any material in use has it."""
        return bool(self._rows[trait])
