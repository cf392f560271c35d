"""Materials and their textures on the GPU, textures by bindless handle and with mip levels."""

from collections import Counter
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.programs.library import programs
from pica.programs.material_types import (
    MAX_PARAMETERS,
    STANDARD_ONLY,
    Feature,
    MaterialTypeSet,
    ShapeOn,
    TypeEntry,
    plain,
)
from pica.programs.preparation import prepare
from pica.programs.scene_features import features_of, with_features
from pica.programs.shape_types import shapes_of
from pica.rhi.device import Device
from pica.rhi.tables import HostTable
from pica.scene.coat import MOST_COATS, baked
from pica.scene.material import AlphaMode, Image, Material, Sampler, Texture, Wrap
from pica.scene.material_registry import MaterialSource, material_source
from pica.scene.shape_registry import shape_source

# gpu_scene/scene_types.slang: TextureSlot, CoatRow and Material
SLOT = np.dtype([("texture", "u8"), ("sampler", "u8"), ("transform", "f4", (2, 3)), ("uv_set", "u4"), ("texels", "f4")])
_SLOTS = (
    "base_color",
    "metallic_roughness",
    "normal",
    "occlusion",
    "emissive",
    "specular",
    "specular_color",
    "transmission",
    "coat",
    "coat_roughness",
    "coat_normal",
    "iridescence",
    "iridescence_thickness",
    "anisotropy",
    "sheen_color",
    "sheen_roughness",
)
_SRGB = {"base_color", "emissive", "specular_color", "sheen_color"}
COAT = np.dtype(
    [("transmittance", "f4", 3), ("strength", "f4"), ("roughness", "f4"), ("ior", "f4"), ("ior_below", "f4")],
    align=True,
)
MATERIAL = np.dtype(
    [
        ("base_color", "f4", 4),
        ("emission", "f4", 3),
        ("metallic", "f4"),
        ("specular_color", "f4", 3),
        ("roughness", "f4"),
        ("ior", "f4"),
        ("specular", "f4"),
        ("normal_scale", "f4"),
        ("occlusion_strength", "f4"),
        ("alpha_cutoff", "f4"),
        ("transmission", "f4"),
        ("flags", "u4"),
        *((f"{slot}_texture", SLOT) for slot in _SLOTS),
        ("coat_normal_scale", "f4"),
        ("coat_count", "u4"),
        ("coats", COAT, MOST_COATS),
        ("film_strength", "f4"),
        ("film_ior", "f4"),
        ("film_thickness", "f4", 2),
        ("anisotropy_strength", "f4"),
        ("anisotropy_turn", "f4", 2),
        ("sheen_color", "f4", 3),
        ("sheen_roughness", "f4"),
        ("type", "u4"),
        ("parameters", "u4", MAX_PARAMETERS),
    ],
    align=True,
)
_MASK, _BLEND, _DOUBLE_SIDED, _UNLIT, _THIN_WALLED = 1, 2, 4, 8, 16
_WRAP = {
    Wrap.REPEAT: spy.TextureAddressingMode.wrap,
    Wrap.MIRRORED_REPEAT: spy.TextureAddressingMode.mirror_repeat,
    Wrap.CLAMP_TO_EDGE: spy.TextureAddressingMode.clamp_to_edge,
}


@dataclass
class _ImageOnGpu:
    """A texture, and the image that it was made of, whose id is its key."""

    image: Image
    texture: spy.Texture
    view: spy.TextureView
    users: int = 0


class MaterialTable:
    """The materials of what is shown; an image used twice is uploaded once, and goes with its last material."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self.table = HostTable(device, "materials", MATERIAL)
        self.transparent: set[int] = set()
        """Rows of the materials that let light through."""
        self._users: dict[int, int] = {}
        self._materials: dict[int, tuple[int, Material]] = {}
        self._textures: dict[tuple[int, bool], _ImageOnGpu] = {}
        self._samplers: dict[Sampler, spy.Sampler] = {}
        self._types: MaterialTypeSet = ()
        self._type_users: Counter[str] = Counter()

    @property
    def types(self) -> MaterialTypeSet:
        """The material types that programs must know; a type's place is its number in shaders and its hit group.

        Among them what primitives have for hit groups (programs/shape_types.py), and features (scene_features.py)."""
        return self._types or STANDARD_ONLY

    @property
    def used_types(self) -> list[str]:
        """The names of those that a material has now."""
        return [known.name for known in self._types if self._type_users[known.name]]

    def type_number(self, name: str) -> int:
        """The place of a type in use, or of an entry "shape/type". Raises StopIteration for one that is not."""
        return next(number for number, source in enumerate(self._types) if source.name == name)

    def types_with(self, entries: Iterable[TypeEntry], features: Set[Feature] = frozenset()) -> MaterialTypeSet:
        """The types in use and these. All keep their places; a newcomer takes one whose type nobody uses any more.

        Entries of shapes neither go nor take such a place, for records hold the numbers of shapes; nor do features.
        """
        wanted = {entry.name: entry for entry in entries}
        materials = {name: entry for name, entry in wanted.items() if isinstance(entry, MaterialSource)}
        types = [
            ShapeOn(known.shape, materials.get(known.material.name, known.material))
            if isinstance(known, ShapeOn)
            else wanted.get(known.name, known)
            for known in self._types
        ]
        known_names = {known.name for known in types}
        free = [
            number
            for number, known in enumerate(types)
            if known.name not in wanted and isinstance(known, MaterialSource) and not self._type_users[known.name]
        ]
        for newcomer in (entry for name, entry in wanted.items() if name not in known_names):
            if free and isinstance(newcomer, MaterialSource):
                types[free.pop(0)] = newcomer
            else:
                types.append(newcomer)
        return with_features(tuple(types), features)

    def know(self, features: Set[Feature]) -> None:
        """Let programs know these features, before any is made."""
        if features:
            self._types = with_features(self.types, features)

    def switch(self, types: MaterialTypeSet) -> None:
        """Let programs know these types, in which all that are in use have kept their places.

        Raises MaterialTypeError, and changes nothing, when a type was replaced and its materials' parameters do not
        fit the new one.
        """
        replaced = {known.name: known for known in plain(types).values() if known not in self._types}
        compiled = programs(self._device).material_types
        packed = {
            row: compiled[replaced[material.type]].packed(material.name, material.parameters)
            for row, material in self._materials.values()
            if material.type in replaced
        }
        for row, parameters in packed.items():
            self.table.rows[row]["parameters"] = parameters
            self.table.touch(np.array([row]))
        self._types = types

    def make_programs(self) -> None:
        """Make all programs that passes on the device have none of yet, before a first frame; perhaps such as know more
        features than are in use."""
        types = prepare(self._device, self.types)
        if types != self.types:
            self._types = types

    def acquire(self, material: Material, users: int = 1) -> int:
        """The row of a material that somebody starts to use, or several."""
        key = id(material)
        if key not in self._materials:
            row = self.table.take(1)
            self._materials[key] = row, material
            self.table.rows[row] = self._packed(material)
            self._type_users[material.type] += 1
            if material.transmission > 0:
                self.transparent.add(row)
        self._users[key] = self._users.get(key, 0) + users
        return self._materials[key][0]

    def numbered(self) -> Iterator[tuple[int, Material]]:
        """Each material in use and its row."""
        return iter(self._materials.values())

    def shape_number(self, hit_group: str) -> int:
        """`SectionRecord.shape` of primitives with this entry "shape/type", whose material has been acquired."""
        shape, material = hit_group.split("/")
        if all(known.name != hit_group for known in self._types):
            known = self._types[self.type_number(material)]
            assert isinstance(known, MaterialSource)
            self._types = self.types_with([ShapeOn(shape_source(shape), known)])
        return [source.name for source in shapes_of(self._types)].index(shape) + 1

    def release(self, material: Material) -> None:
        """Somebody stops using it."""
        key = id(material)
        self._users[key] -= 1
        if self._users[key]:
            return
        row, _ = self._materials.pop(key)
        del self._users[key]
        self._type_users[material.type] -= 1
        self.transparent.discard(row)
        self.table.give_back(row, 1)
        for slot in _SLOTS:
            texture: Texture | None = getattr(material, f"{slot}_texture")
            if texture is not None:
                self._release_image(texture.image, slot in _SRGB)

    def _packed(self, material: Material) -> NDArray[np.void]:
        packed = np.zeros((), MATERIAL)
        for name in ("base_color", "emission", "metallic", "specular_color", "roughness", "ior", "specular"):
            packed[name] = getattr(material, name)
        for name in ("normal_scale", "occlusion_strength", "alpha_cutoff", "transmission", "coat_normal_scale"):
            packed[name] = getattr(material, name)
        coats = baked(material)
        packed["coat_count"] = len(coats)
        for row, coat in zip(packed["coats"], coats, strict=False):
            for name in ("strength", "roughness", "ior"):
                row[name] = getattr(coat, name)
            row["transmittance"] = coat.transmittance
            row["ior_below"] = 1.0 if coat.air_below else coat.ior
        if material.iridescence is not None:
            film = material.iridescence
            packed["film_strength"], packed["film_ior"] = film.strength, film.ior
            packed["film_thickness"] = film.thickness_minimum, film.thickness_maximum
        if material.anisotropy is not None:
            packed["anisotropy_strength"] = material.anisotropy.strength
            packed["anisotropy_turn"] = np.cos(material.anisotropy.rotation), np.sin(material.anisotropy.rotation)
        if material.sheen is not None:
            packed["sheen_color"], packed["sheen_roughness"] = material.sheen.color, material.sheen.roughness
        packed["flags"] = (
            _MASK * (material.alpha_mode is AlphaMode.MASK)
            | _BLEND * (material.alpha_mode is AlphaMode.BLEND)
            | _DOUBLE_SIDED * material.double_sided
            | _UNLIT * material.unlit
            | _THIN_WALLED * material.thin_walled
        )
        source = next((known for known in plain(self._types).values() if known.name == material.type), None)
        if source is None:
            source = material_source(material.type)
            self._types = self.types_with([source])
        self.know(features_of(material))
        packed["parameters"] = programs(self._device).material_types[source].packed(material.name, material.parameters)
        packed["type"] = self.type_number(material.type)
        for slot in _SLOTS:
            texture: Texture | None = getattr(material, f"{slot}_texture")
            if texture is None:
                continue
            height, width, _ = texture.image.pixels.shape
            entry = packed[f"{slot}_texture"]
            entry["texture"] = self._texture(texture.image, slot in _SRGB)
            entry["sampler"] = self._sampler(texture.sampler).descriptor_handle.value
            entry["transform"] = np.reshape(texture.transform, (2, 3))
            entry["uv_set"] = texture.uv_set
            entry["texels"] = width * height
        return packed

    def _texture(self, image: Image, srgb: bool) -> int:
        key = (id(image), srgb)
        if key not in self._textures:
            self._textures[key] = self._upload(image, srgb)
        self._textures[key].users += 1
        return int(self._textures[key].view.descriptor_handle_ro.value)

    def _upload(self, image: Image, srgb: bool) -> "_ImageOnGpu":
        height, width, _ = image.pixels.shape
        levels = max(width, height).bit_length()
        with self._device.allocating(f"picture {image.name}, {width}x{height} texels"):
            texture = self._device.handle.create_texture(
                format=spy.Format.rgba8_unorm_srgb if srgb else spy.Format.rgba8_unorm,
                width=width,
                height=height,
                mip_count=levels,
                usage=spy.TextureUsage.shader_resource | spy.TextureUsage.render_target,
                label=image.name.encode(errors="replace").decode(),  # files can name things by what is no text
            )
        self._device.count_memory(texture.memory_usage.device)
        # SlangPy refuses read-only arrays.
        texture.copy_from_numpy(np.require(image.pixels, requirements=["C", "W"]))
        if levels > 1:
            encoder = self._device.handle.create_command_encoder()
            encoder.generate_mips(texture)
            self._device.handle.submit_command_buffer(encoder.finish())
        return _ImageOnGpu(image, texture, texture.create_view())

    def _release_image(self, image: Image, srgb: bool) -> None:
        on_gpu = self._textures[id(image), srgb]
        on_gpu.users -= 1
        if not on_gpu.users:
            self._device.count_memory(-on_gpu.texture.memory_usage.device)
            del self._textures[id(image), srgb]

    def _sampler(self, sampler: Sampler) -> spy.Sampler:
        if sampler not in self._samplers:
            filtering = spy.TextureFilteringMode.linear if sampler.linear else spy.TextureFilteringMode.point
            self._samplers[sampler] = self._device.sampler(
                min_filter=filtering,
                mag_filter=filtering,
                mip_filter=filtering,
                address_u=_WRAP[sampler.wrap_u],
                address_v=_WRAP[sampler.wrap_v],
            )
        return self._samplers[sampler]


def average_emission(material: Material) -> float:
    """Mean luminance that the material emits, nits; estimates what a light is worth, nothing more."""
    luminance = np.dot(material.emission, (0.2126, 0.7152, 0.0722))
    texture = material.emissive_texture
    if texture is not None and luminance > 0:
        pixels = texture.image.pixels[::4, ::4, :3] / 255.0
        luminance *= float(np.mean(pixels**2.2 @ (0.2126, 0.7152, 0.0722)))
    return float(luminance)
