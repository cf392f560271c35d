"""Materials (3.9) and their extensions."""

from typing import Any

import pygltflib

from pica.scene.gltf.checks import choice, extension, mapping, number, numbers, text
from pica.scene.gltf.container import Document
from pica.scene.gltf.textures import Textures
from pica.scene.light import WHITE
from pica.scene.material import AlphaMode, Material

_ALPHA_MODES = {mode.value: mode for mode in AlphaMode}


class Materials:
    """The materials of a file, each made once, when first used."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._textures = Textures(document)
        self._made: dict[int | None, Material] = {}

    def get(self, index: int | None, where: str) -> Material:
        """Material `index`; None gives the default material (3.9.6)."""
        if index is None:
            return self._made.setdefault(None, Material(name="default"))
        entry = self._document.item("materials", index, where)
        if index not in self._made:
            self._made[index] = self._make(entry, f"materials[{index}]")
        return self._made[index]

    def _make(self, entry: Any, where: str) -> Material:
        pbr = entry.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
        base = f"{where}.pbrMetallicRoughness"
        normal, occlusion = entry.normalTexture, entry.occlusionTexture
        strength = extension(entry, "KHR_materials_emissive_strength", where) or {}
        emission = numbers(entry.emissiveFactor, 3, f"{where}.emissiveFactor", low=0, default=(0.0, 0.0, 0.0))
        scale = number(strength.get("emissiveStrength"), f"{where}: emissiveStrength", low=0, default=1.0)
        read = self._textures.get
        return Material(
            name=text(entry.name),
            base_color=numbers(pbr.baseColorFactor, 4, f"{base}.baseColorFactor", 0, 1, (1.0, 1.0, 1.0, 1.0)),
            metallic=number(pbr.metallicFactor, f"{base}.metallicFactor", 0, 1, 1.0),
            roughness=number(pbr.roughnessFactor, f"{base}.roughnessFactor", 0, 1, 1.0),
            emission=(emission[0] * scale, emission[1] * scale, emission[2] * scale),
            base_color_texture=read(pbr.baseColorTexture, f"{base}.baseColorTexture"),
            metallic_roughness_texture=read(pbr.metallicRoughnessTexture, f"{base}.metallicRoughnessTexture"),
            normal_texture=read(normal, f"{where}.normalTexture"),
            normal_scale=1.0 if normal is None else number(normal.scale, f"{where}.normalTexture.scale", default=1.0),
            occlusion_texture=read(occlusion, f"{where}.occlusionTexture"),
            occlusion_strength=1.0
            if occlusion is None
            else number(occlusion.strength, f"{where}.occlusionTexture.strength", 0, 1, 1.0),
            emissive_texture=read(entry.emissiveTexture, f"{where}.emissiveTexture"),
            alpha_mode=choice(entry.alphaMode or "OPAQUE", f"{where}.alphaMode", _ALPHA_MODES),
            alpha_cutoff=number(entry.alphaCutoff, f"{where}.alphaCutoff", low=0, default=0.5),
            double_sided=bool(entry.doubleSided),
            unlit=extension(entry, "KHR_materials_unlit", where) is not None,
            ior=_index_of_refraction(entry, where),
            extras=mapping(entry.extras, f"{where}.extras"),
            **self._specular(entry, where),
            **self._transmission(entry, where),
        )

    def _specular(self, entry: Any, where: str) -> dict[str, Any]:
        values = extension(entry, "KHR_materials_specular", where) or {}
        where = f"{where}.extensions.KHR_materials_specular"
        return {
            "specular": number(values.get("specularFactor"), f"{where}.specularFactor", 0, 1, 1.0),
            "specular_color": numbers(
                values.get("specularColorFactor"), 3, f"{where}.specularColorFactor", low=0, default=WHITE
            ),
            "specular_texture": self._textures.from_json(values.get("specularTexture"), f"{where}.specularTexture"),
            "specular_color_texture": self._textures.from_json(
                values.get("specularColorTexture"), f"{where}.specularColorTexture"
            ),
        }

    def _transmission(self, entry: Any, where: str) -> dict[str, Any]:
        values = extension(entry, "KHR_materials_transmission", where) or {}
        volume = extension(entry, "KHR_materials_volume", where) or {}
        where = f"{where}.extensions"
        thickness = f"{where}.KHR_materials_volume.thicknessFactor"
        where = f"{where}.KHR_materials_transmission"
        return {
            "transmission": number(values.get("transmissionFactor"), f"{where}.transmissionFactor", 0, 1, 0.0),
            "transmission_texture": self._textures.from_json(
                values.get("transmissionTexture"), f"{where}.transmissionTexture"
            ),
            # The rest of that extension is not read.
            "thin_walled": number(volume.get("thicknessFactor"), thickness, low=0, default=0.0) == 0,
        }


def _index_of_refraction(entry: Any, where: str) -> float:
    values = extension(entry, "KHR_materials_ior", where) or {}
    where = f"{where}.extensions.KHR_materials_ior.ior"
    ior = number(values.get("ior"), where, low=0, default=1.5)
    return ior if ior == 0 else number(ior, where, low=1)
