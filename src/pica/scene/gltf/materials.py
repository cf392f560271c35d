"""Materials (3.9) and their extensions."""

import math
from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any

from pica.scene.anisotropy import Anisotropy
from pica.scene.coat import Coat
from pica.scene.construction import unchecked_constructor
from pica.scene.gltf import specular_glossiness
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.gltf.pointers import parsed
from pica.scene.gltf.texture_places import SPECULAR_GLOSSINESS
from pica.scene.gltf.textures import UV_SETS, Textures, uv_sets_of
from pica.scene.gltf.variants import Variants
from pica.scene.iridescence import Iridescence
from pica.scene.light import WHITE, Color
from pica.scene.limits import OBJECT_BYTES
from pica.scene.material import AlphaMode, Material
from pica.scene.sheen import Sheen
from pica.scene.values import LARGEST

_METALLIC_ROUGHNESS = "pbrMetallicRoughness"
_ALPHA_MODES = {mode.value: mode for mode in AlphaMode}
_plain_material = unchecked_constructor(Material)


class Materials:
    """The materials of a file, each made once, when first used."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._textures = Textures(document)
        self._variants = Variants(document)
        self._animated: dict[Element, list[str]] = {}
        """Keys of materials that animations set."""
        for place in map(parsed, document.animated_pointers):
            entries = document.entries("materials") if place is not None and place.array == "materials" else []
            if place is not None and place.row < len(entries):
                self._animated.setdefault(entries[place.row], []).append(place.key)
        self._default = Material(name="default")
        self.made: dict[Element, Material] = {}
        """By their entries in the file."""
        self._unlit: dict[Material, Material] = {}
        self._uv_sets: dict[Material, tuple[int, int]] = {}
        """Where they are not 0 and 1."""

    def expect(self, primitives: Iterable[Any]) -> None:
        """Get ready for the materials of primitives, which are parts of the file's JSON."""
        if self._document.variant is not None:
            return
        rows = (primitive.get("material") for primitive in primitives if type(primitive) is dict)
        used = dict.fromkeys(row for row in rows if type(row) is int)
        entries = self._document.entries("materials") if used else []
        self._textures.expect(entries[row] for row in used if 0 <= row < len(entries))

    def get(self, primitive: Element) -> Material:
        """The primitive's material, the default one (3.9.6) where it names none."""
        holder = self._variants.choose(primitive) if "extensions" in primitive else primitive
        if "material" not in holder:
            return self._default
        entry = holder.reference("material", self._document.entries("materials"))
        if entry not in self.made:
            self.made[entry] = self._make(entry)
        return self.made[entry]

    def unlit(self, material: Material) -> Material | None:
        """What `get_unlit` has made of a material, if it has."""
        return self._unlit.get(material)

    def get_unlit(self, primitive: Element) -> Material:
        """The primitive's material as points and lines without normals have it, which no light reaches (3.9.7)."""
        material = self.get(primitive)
        if material not in self._unlit:
            self._unlit[material] = Material(
                name=material.name,
                base_color=material.base_color,
                base_color_texture=material.base_color_texture,
                alpha_mode=material.alpha_mode,
                alpha_cutoff=material.alpha_cutoff,
                unlit=True,
                extras=material.extras,
            )
        return self._unlit[material]

    def _make(self, entry: Element) -> Material:
        self._document.take(entry, bytes=OBJECT_BYTES)
        self._textures.uv_sets = uv_sets_of(entry)
        material = self._read(entry)
        if self._textures.uv_sets != UV_SETS:
            self._uv_sets[material] = self._textures.uv_sets
        return material

    def uv_sets(self, material: Material) -> tuple[int, int]:
        """The numbers of the texture coordinates that a material uses."""
        return self._uv_sets.get(material, UV_SETS)

    def _read(self, entry: Element) -> Material:
        values: dict[str, Any] = {"name": entry.name, "extras": entry.extras}
        converts = entry.has_extension(SPECULAR_GLOSSINESS)
        for key, read in self._parts.items():
            if key in entry and not (converts and key == _METALLIC_ROUGHNESS):
                values |= read(entry)
        is_plain = "extensions" not in entry and "emissiveFactor" not in entry and "pica" not in entry.extras
        if is_plain and entry not in self._animated:
            return _plain_material(**values)  # the values are checked already
        return entry.apply(Material, **values | self._extended(entry))

    @cached_property
    def _parts(self) -> dict[str, Callable[[Element], dict[str, Any]]]:
        """What is to be read where a material has a key."""
        read = self._textures.get
        return {
            _METALLIC_ROUGHNESS: lambda entry: self._metallic_roughness(entry.object(_METALLIC_ROUGHNESS)),
            "normalTexture": lambda entry: {
                "normal_texture": read(entry, "normalTexture"),
                "normal_scale": entry.object("normalTexture").number("scale", default=1.0),
            },
            "occlusionTexture": lambda entry: {
                "occlusion_texture": read(entry, "occlusionTexture"),
                "occlusion_strength": entry.object("occlusionTexture").number("strength", 0, 1, 1.0),
            },
            "emissiveTexture": lambda entry: {"emissive_texture": read(entry, "emissiveTexture")},
            "alphaMode": lambda entry: {"alpha_mode": entry.choice("alphaMode", _ALPHA_MODES)},
            "alphaCutoff": lambda entry: {"alpha_cutoff": entry.number("alphaCutoff", low=0)},
            "doubleSided": lambda entry: {"double_sided": entry.flag("doubleSided", default=False)},
        }

    def _metallic_roughness(self, pbr: Element) -> dict[str, Any]:
        return {
            "base_color": pbr.numbers("baseColorFactor", 4, 0, 1, (1.0, 1.0, 1.0, 1.0)),
            "metallic": pbr.number("metallicFactor", 0, 1, 1.0),
            "roughness": pbr.number("roughnessFactor", 0, 1, 1.0),
            "base_color_texture": self._textures.get(pbr, "baseColorTexture"),
            "metallic_roughness_texture": self._textures.get(pbr, "metallicRoughnessTexture"),
        }

    def _extended(self, entry: Element) -> dict[str, Any]:
        """The parameters of extensions, and emission, which one of them multiplies."""
        strength = entry.extension("KHR_materials_emissive_strength").number("emissiveStrength", low=0, default=1.0)
        red, green, blue = entry.numbers("emissiveFactor", 3, low=0, default=(0.0, 0.0, 0.0))
        if max(red, green, blue) * strength > LARGEST:
            raise entry.fault(f"times a strength of {strength:g} is too bright", "emissiveFactor")
        return {
            "emission": (red * strength, green * strength, blue * strength),
            "unlit": entry.has_extension("KHR_materials_unlit"),
            "ior": _index_of_refraction(entry),
            **self._specular(entry.extension("KHR_materials_specular")),
            **self._transmission(entry),
            **_coefficients(entry.pica),
            **self._diffuse_transmission(entry.extension("KHR_materials_diffuse_transmission")),
            **self._clearcoat(*self._extension(entry, "KHR_materials_clearcoat"), _coats(entry.pica)),
            **self._anisotropy(*self._extension(entry, "KHR_materials_anisotropy")),
            **self._iridescence(*self._extension(entry, "KHR_materials_iridescence")),
            **self._sheen(*self._extension(entry, "KHR_materials_sheen")),
            **self._specular_glossiness(entry),
        }

    def _extension(self, entry: Element, name: str) -> tuple[Element, bool]:
        """An extension of a material, and whether it is kept even without effect, as one that is animated."""
        return entry.extension(name), any(f"extensions/{name}/" in key for key in self._animated.get(entry, ()))

    def _specular(self, specular: Element) -> dict[str, Any]:
        return {
            "specular": specular.number("specularFactor", 0, 1, 1.0),
            "specular_color": specular.numbers("specularColorFactor", 3, low=0, default=WHITE),
            "specular_texture": self._textures.get(specular, "specularTexture"),
            "specular_color_texture": self._textures.get(specular, "specularColorTexture"),
        }

    def _transmission(self, entry: Element) -> dict[str, Any]:
        transmission = entry.extension("KHR_materials_transmission")
        volume = entry.extension("KHR_materials_volume")
        thickness = volume.number("thicknessFactor", low=0, default=0.0)
        scatter = entry.extension("KHR_materials_volume_scatter")
        absorption, scattering = coefficients(
            volume.numbers("attenuationColor", 3, 0, 1, WHITE),
            volume.number("attenuationDistance", low=0, default=math.inf),
            scatter.numbers("multiscatterColor", 3, 0, 1, (0.0, 0.0, 0.0)),
        )
        return {
            "transmission": transmission.number("transmissionFactor", 0, 1, 0.0),
            "transmission_texture": self._textures.get(transmission, "transmissionTexture"),
            "thin_walled": thickness == 0,  # rays find the true thickness
            "absorption": absorption,
            "scattering": scattering,
            "scatter_anisotropy": scatter.number("scatterAnisotropy", -1, 1, 0.0),
            "dispersion": entry.extension("KHR_materials_dispersion").number("dispersion", low=0, default=0.0),
        }

    def _diffuse_transmission(self, extension: Element) -> dict[str, Any]:
        return {
            "diffuse_transmission": extension.number("diffuseTransmissionFactor", 0, 1, 0.0),
            "diffuse_transmission_texture": self._textures.get(extension, "diffuseTransmissionTexture"),
            "diffuse_transmission_color": extension.numbers("diffuseTransmissionColorFactor", 3, low=0, default=WHITE),
            "diffuse_transmission_color_texture": self._textures.get(extension, "diffuseTransmissionColorTexture"),
        }

    def _clearcoat(self, clearcoat: Element, kept: bool, coats: tuple[Coat, ...]) -> dict[str, Any]:
        """The extension's coat or, with its textures, those of the extras."""
        strength = clearcoat.number("clearcoatFactor", 0, 1, 0.0)
        roughness = clearcoat.number("clearcoatRoughnessFactor", 0, 1, 0.0)
        textures = {
            "coat_texture": self._textures.get(clearcoat, "clearcoatTexture"),
            "coat_roughness_texture": self._textures.get(clearcoat, "clearcoatRoughnessTexture"),
            "coat_normal_texture": self._textures.get(clearcoat, "clearcoatNormalTexture"),
        }
        scale = clearcoat.object("clearcoatNormalTexture").number("scale", default=1.0)
        if strength == 0 and not coats and not kept:
            return {}
        coats = coats or (Coat(strength, roughness, air_below=True),)
        return {"coats": coats, "coat_normal_scale": scale, **textures}

    def _anisotropy(self, extension: Element, kept: bool) -> dict[str, Any]:
        strength = extension.number("anisotropyStrength", 0, 1, 0.0)
        anisotropy = Anisotropy(strength, extension.number("anisotropyRotation", default=0.0))
        texture = self._textures.get(extension, "anisotropyTexture")
        return {} if strength == 0 and not kept else {"anisotropy": anisotropy, "anisotropy_texture": texture}

    def _iridescence(self, iridescence: Element, kept: bool) -> dict[str, Any]:
        film = Iridescence(
            iridescence.number("iridescenceFactor", 0, 1, 0.0),
            iridescence.number("iridescenceIor", low=1, default=1.3),
            iridescence.number("iridescenceThicknessMinimum", 0, 1e5, 100.0),
            iridescence.number("iridescenceThicknessMaximum", 0, 1e5, 400.0),
        )
        textures = {
            "iridescence_texture": self._textures.get(iridescence, "iridescenceTexture"),
            "iridescence_thickness_texture": self._textures.get(iridescence, "iridescenceThicknessTexture"),
        }
        return {} if film.strength == 0 and not kept else {"iridescence": film, **textures}

    def _specular_glossiness(self, entry: Element) -> dict[str, Any]:
        """Instead of pbrMetallicRoughness, which a file may have for readers without the extension."""
        is_used = entry.has_extension(SPECULAR_GLOSSINESS)
        return specular_glossiness.metallic_roughness(self._document, self._textures, entry) if is_used else {}

    def _sheen(self, extension: Element, kept: bool) -> dict[str, Any]:
        red, green, blue = extension.numbers("sheenColorFactor", 3, 0, 1, (0.0, 0.0, 0.0))
        sheen = Sheen((red, green, blue), extension.number("sheenRoughnessFactor", 0, 1, 0.0))
        textures = {
            "sheen_color_texture": self._textures.get(extension, "sheenColorTexture"),
            "sheen_roughness_texture": self._textures.get(extension, "sheenRoughnessTexture"),
        }
        return {"sheen": sheen, **textures} if kept or any(sheen.color) else {}


def coefficients(color: Iterable[float], distance: float, scattered: Iterable[float]) -> tuple[Color, Color]:
    """Absorption and scattering coefficients of a medium, by KHR_materials_volume and KHR_materials_volume_scatter."""
    extinction = [min(-math.log(max(each, 1e-20)) / max(distance, 1e-20), LARGEST) for each in color]
    pairs = [(each, _single_scattering_albedo(share)) for each, share in zip(extinction, scattered, strict=True)]
    (r, r_share), (g, g_share), (b, b_share) = pairs
    absorption = r * (1 - r_share), g * (1 - g_share), b * (1 - b_share)
    return absorption, (r * r_share, g * g_share, b * b_share)


def _coefficients(pica: Element) -> dict[str, Any]:
    """Coefficients of the medium in extras, which KHR_materials_volume has only as colours."""
    return {name: pica.numbers(name, 3, low=0) for name in ("absorption", "scattering") if name in pica}


def _coats(pica: Element) -> tuple[Coat, ...]:
    """Coats in extras, which KHR_materials_clearcoat cannot describe."""
    return tuple(
        coat.apply(
            Coat,
            strength=coat.number("strength", 0, 1, 1.0),
            roughness=coat.number("roughness", 0, 1, 0.0),
            ior=coat.number("ior", low=1, default=1.5),
            absorption=coat.numbers("absorption", 3, low=0, default=(0.0, 0.0, 0.0)),
            thickness=coat.number("thickness", low=0, default=0.0),
            air_below=coat.flag("air_below", default=False),
        )
        for coat in pica.objects("coats")
    )


def _single_scattering_albedo(color: float) -> float:
    """Of a medium whose surface has a colour, by Kulla and Conty 2017, "Revisiting Physically Based Shading at
    Imageworks", slide 104, as KHR_materials_volume_scatter has it."""
    root = 4.09712 + 4.20863 * color - math.sqrt(9.59217 + 41.6808 * color + 17.7126 * color * color)
    return min(max(1 - root * root, 0.0), 1.0)


def _index_of_refraction(entry: Element) -> float:
    extension = entry.extension("KHR_materials_ior")
    ior = extension.number("ior", low=0, default=1.5)
    return ior if ior == 0 else extension.number("ior", low=1, default=ior)
