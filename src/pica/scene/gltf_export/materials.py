"""Materials (3.9) and their extensions: the inverse of the loader's."""

import math
from dataclasses import asdict
from typing import Any

from pica.scene.anisotropy import Anisotropy
from pica.scene.coat import Coat
from pica.scene.gltf_export.container import Asset, differing
from pica.scene.gltf_export.textures import Textures
from pica.scene.iridescence import Iridescence
from pica.scene.light import WHITE, Color
from pica.scene.material import AlphaMode, Material
from pica.scene.material_registry import STANDARD

_BLACK: Color = (0.0, 0.0, 0.0)


class Materials:
    """The materials of a file, each added once, when first used."""

    def __init__(self, asset: Asset) -> None:
        self._asset = asset
        self._textures = Textures(asset)
        self.added: dict[Material, int] = {}

    def get(self, material: Material) -> int:
        """The index of a material."""
        if material not in self.added:
            self.added[material] = self._asset.add("materials", self._entry(material))
        return self.added[material]

    def _entry(self, material: Material) -> dict[str, Any]:
        if material.type != STANDARD:
            self._asset.leave_out("material types in Slang, whose materials are standard ones")
        strength = emissive_strength(material.emission)
        info = self._textures.info
        return {
            "name": material.name,
            "pbrMetallicRoughness": self._metallic_roughness(material),
            "normalTexture": info(material.normal_texture, **differing(scale=(material.normal_scale, 1.0))),
            "occlusionTexture": info(
                material.occlusion_texture, **differing(strength=(material.occlusion_strength, 1.0))
            ),
            "emissiveTexture": info(material.emissive_texture),
            **differing(
                emissiveFactor=(tuple(each / strength for each in material.emission), _BLACK),
                alphaMode=(material.alpha_mode.value, AlphaMode.OPAQUE.value),
                doubleSided=(material.double_sided, False),
            ),
            **(differing(alphaCutoff=(material.alpha_cutoff, 0.5)) if material.alpha_mode is AlphaMode.MASK else {}),
            "extensions": self._extensions(material, strength),
            "extras": self._asset.extras(material.extras, _coefficients(material) | _coats(material)),
        }

    def _metallic_roughness(self, material: Material) -> dict[str, Any]:
        return differing(
            baseColorFactor=(material.base_color, (1.0, 1.0, 1.0, 1.0)),
            metallicFactor=(material.metallic, 1.0),
            roughnessFactor=(material.roughness, 1.0),
            baseColorTexture=(self._textures.info(material.base_color_texture), None),
            metallicRoughnessTexture=(self._textures.info(material.metallic_roughness_texture), None),
        )

    def _extensions(self, material: Material, strength: float) -> dict[str, Any]:
        values = {
            "emissive_strength": differing(emissiveStrength=(strength, 1.0)),
            "ior": differing(ior=(material.ior, 1.5)),
            "specular": self._specular(material),
            "transmission": differing(
                transmissionFactor=(material.transmission, 0.0),
                transmissionTexture=(self._textures.info(material.transmission_texture), None),
            ),
            "volume": _volume(material),
            "volume_scatter": _volume_scatter(material),
            "dispersion": differing(dispersion=(material.dispersion, 0.0)),
            "diffuse_transmission": self._diffuse_transmission(material),
            "clearcoat": self._clearcoat(material),
            "anisotropy": self._anisotropy(material.anisotropy, material),
            "iridescence": self._iridescence(material.iridescence, material),
            "sheen": self._sheen(material),
        }
        used: dict[str, dict[str, Any]] = {f"KHR_materials_{name}": each for name, each in values.items() if each}
        return self._asset.extensions(**used, **({"KHR_materials_unlit": {}} if material.unlit else {}))

    def _specular(self, material: Material) -> dict[str, Any]:
        return differing(
            specularFactor=(material.specular, 1.0),
            specularColorFactor=(material.specular_color, WHITE),
            specularTexture=(self._textures.info(material.specular_texture), None),
            specularColorTexture=(self._textures.info(material.specular_color_texture), None),
        )

    def _diffuse_transmission(self, material: Material) -> dict[str, Any]:
        info = self._textures.info
        return differing(
            diffuseTransmissionFactor=(material.diffuse_transmission, 0.0),
            diffuseTransmissionTexture=(info(material.diffuse_transmission_texture), None),
            diffuseTransmissionColorFactor=(material.diffuse_transmission_color, WHITE),
            diffuseTransmissionColorTexture=(info(material.diffuse_transmission_color_texture), None),
        )

    def _clearcoat(self, material: Material) -> dict[str, Any]:
        """The topmost coat, as far as the extension describes it."""
        if not material.coats:
            return {}
        top, info = material.coats[0], self._textures.info
        scale = differing(scale=(material.coat_normal_scale, 1.0))
        return differing(
            clearcoatFactor=(top.strength, 0.0),
            clearcoatRoughnessFactor=(top.roughness, 0.0),
            clearcoatTexture=(info(material.coat_texture), None),
            clearcoatRoughnessTexture=(info(material.coat_roughness_texture), None),
            clearcoatNormalTexture=(info(material.coat_normal_texture, **scale), None),
        )

    def _anisotropy(self, anisotropy: Anisotropy | None, material: Material) -> dict[str, Any]:
        if anisotropy is None or not anisotropy.strength:
            return {}
        return differing(
            anisotropyStrength=(anisotropy.strength, 0.0),
            anisotropyRotation=(anisotropy.rotation, 0.0),
            anisotropyTexture=(self._textures.info(material.anisotropy_texture), None),
        )

    def _iridescence(self, film: Iridescence | None, material: Material) -> dict[str, Any]:
        if film is None or not film.strength:
            return {}
        return differing(
            iridescenceFactor=(film.strength, 0.0),
            iridescenceIor=(film.ior, 1.3),
            iridescenceThicknessMinimum=(film.thickness_minimum, 100.0),
            iridescenceThicknessMaximum=(film.thickness_maximum, 400.0),
            iridescenceTexture=(self._textures.info(material.iridescence_texture), None),
            iridescenceThicknessTexture=(self._textures.info(material.iridescence_thickness_texture), None),
        )

    def _sheen(self, material: Material) -> dict[str, Any]:
        if material.sheen is None or not any(material.sheen.color):
            return {}
        return differing(
            sheenColorFactor=(material.sheen.color, _BLACK),
            sheenRoughnessFactor=(material.sheen.roughness, 0.0),
            sheenColorTexture=(self._textures.info(material.sheen_color_texture), None),
            sheenRoughnessTexture=(self._textures.info(material.sheen_roughness_texture), None),
        )


def emissive_strength(emission: Color) -> float:
    """What emission is divided by, so that it is at most 1: a power of two, which loses no digit."""
    return math.ldexp(1.0, math.frexp(max(emission))[1]) if max(emission) > 1 else 1.0


def _volume(material: Material) -> dict[str, Any]:
    extinction = [sum(pair) for pair in zip(material.absorption, material.scattering, strict=True)]
    values = differing(thicknessFactor=(0.0 if material.thin_walled else 1.0, 0.0))
    if any(extinction):
        densest = max(extinction)
        values["attenuationDistance"] = 1 / densest
        values["attenuationColor"] = [math.exp(-each / densest) for each in extinction]
    return values


def _volume_scatter(material: Material) -> dict[str, Any]:
    pairs = zip(material.absorption, material.scattering, strict=True)
    shares = [scattered / (absorbed + scattered) if scattered else 0.0 for absorbed, scattered in pairs]
    return differing(
        multiscatterColor=(tuple(map(_multiple_scattering_color, shares)), _BLACK),
        scatterAnisotropy=(material.scatter_anisotropy, 0.0),
    )


def _multiple_scattering_color(albedo: float) -> float:
    """The colour of a surface for the albedo of its medium: the inverse of the loader's formula."""
    if albedo == 0:
        return 0.0
    root = 4.09712 - math.sqrt(1 - albedo)
    # squared, both sides have the same quadratic term
    return min(max((9.59217 - root * root) / (2 * 4.20863 * root - 41.6808), 0.0), 1.0)


def _coefficients(material: Material) -> dict[str, Any]:
    """Coefficients that the extensions have only as colours, with other last digits."""
    return differing(absorption=(material.absorption, _BLACK), scattering=(material.scattering, _BLACK))


def _coats(material: Material) -> dict[str, Any]:
    """Coats that KHR_materials_clearcoat cannot describe."""
    if not material.coats:
        return {}
    top = material.coats[0]
    plain = top.strength > 0 and material.coats == (Coat(top.strength, top.roughness, air_below=True),)
    return {} if plain else {"coats": [asdict(coat) for coat in material.coats]}
