"""Materials on the GPU, their textures by bindless handle."""

from collections import Counter
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.material_textures import ImageOnGpu, MaterialTextures
from pica.gpu_scene.material_traits import MaterialTraits
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
from pica.programs.scene_features import features_of, supported_features, with_features
from pica.programs.shape_types import shapes_of
from pica.rhi.device import Device
from pica.rhi.tables import HostTable
from pica.scene.changes import ChangeSet
from pica.scene.coat import MAX_COATS, baked
from pica.scene.illumination import average_emission
from pica.scene.material import AlphaMode, Image, Material, Texture
from pica.scene.material_registry import STANDARD, MaterialSource, material_source
from pica.scene.shape_registry import shape_source

# gpu_scene/table_rows.slang: TextureRow, CoatRow, Material and MaterialRows
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
    "diffuse_transmission",
    "diffuse_transmission_color",
    "coat",
    "coat_roughness",
    "coat_normal",
    "iridescence",
    "iridescence_thickness",
    "anisotropy",
    "sheen_color",
    "sheen_roughness",
)
_SRGB = {"base_color", "emissive", "specular_color", "sheen_color", "diffuse_transmission_color"}
_RADIANCE = {"emissive"}
"""Textures whose values may be above 1."""
_NORMALS = {"normal", "coat_normal"}
COAT = np.dtype(
    [
        ("transmittance", "f4", 3),
        ("strength", "f4"),
        ("roughness", "f4"),
        ("ior", "f4"),
        ("ior_below", "f4"),
        ("unused", "u4"),
    ],
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
        ("type", "u4"),
        ("coat_normal_scale", "f4"),
        ("coat_count", "u4"),
        ("textured", "u4"),
        ("row", "u4"),
        ("film_strength", "f4"),
        ("film_ior", "f4"),
        ("film_thickness", "f4", 2),
        ("sheen_color", "f4", 3),
        ("sheen_roughness", "f4"),
        ("absorption", "f4", 3),
        ("dispersion", "f4"),
        ("scattering", "f4", 3),
        ("scatter_anisotropy", "f4"),
        ("diffuse_transmission_color", "f4", 3),
        ("diffuse_transmission", "f4"),
        ("anisotropy_turn", "f4", 2),
        ("anisotropy_strength", "f4"),
        ("unused", "u4"),
        *((f"{slot}_texture", SLOT) for slot in _SLOTS),
        ("coats", COAT, MAX_COATS),
        ("parameters", "u4", MAX_PARAMETERS),
    ],
    align=True,
)
_MASK, _BLEND, _DOUBLE_SIDED, _UNLIT, _THIN_WALLED, _EVEN_EMISSION, _MEAN_NORMALS = 1, 2, 4, 8, 16, 32, 64


@dataclass
class _Packed:
    """A material as its row was packed; later edits are not included."""

    row: int
    type: str
    kind: tuple[object, ...]
    images: list[ImageOnGpu]
    emission: float
    users: int = 0


class MaterialTable:
    """The materials in use; an image used twice is uploaded once, and freed with its last material."""

    def __init__(self, device: Device, changes: ChangeSet) -> None:
        """`changes`: where images note that they were written to."""
        self._device = device
        self.table = HostTable(device, "materials", MATERIAL)
        self.traits = MaterialTraits()
        self._materials: dict[Material, _Packed] = {}
        self._textures, self._changes = device.shared(MaterialTextures), changes
        self._types: MaterialTypeSet = ()
        self._type_users: Counter[str] = Counter()

    @property
    def types(self) -> MaterialTypeSet:
        """The material types in the programs; a type's position is its number in shaders and its hit group.

        They include hit groups of primitives (programs/shape_types.py) and features (scene_features.py)."""
        return self._types or STANDARD_ONLY

    @property
    def used_types(self) -> list[str]:
        """The names of types with materials in use."""
        return [kind.name for kind in self._types if self._type_users[kind.name]]

    def type_number(self, name: str) -> int:
        """The place of a type in use, or of an entry "shape/type". Raises StopIteration for one that is not."""
        return next(number for number, source in enumerate(self._types) if source.name == name)

    def types_with(self, entries: Iterable[TypeEntry], features: Set[Feature] = frozenset()) -> MaterialTypeSet:
        """The types in use, and these. All keep their positions; a new type replaces one without users.

        Entries of shapes neither leave nor reuse a position, because records hold shape numbers; nor do features.
        """
        by_name = {entry.name: entry for entry in entries}
        materials = {name: entry for name, entry in by_name.items() if isinstance(entry, MaterialSource)}
        types = [
            ShapeOn(kind.shape, materials.get(kind.material.name, kind.material))
            if isinstance(kind, ShapeOn)
            else by_name.get(kind.name, kind)
            for kind in self._types
        ]
        known_names = {kind.name for kind in types}
        free = [
            number
            for number, kind in enumerate(types)
            if kind.name not in by_name and isinstance(kind, MaterialSource) and not self._type_users[kind.name]
        ]
        for newcomer in (entry for name, entry in by_name.items() if name not in known_names):
            if free and isinstance(newcomer, MaterialSource):
                types[free.pop(0)] = newcomer
            else:
                types.append(newcomer)
        return with_features(tuple(types), features)

    def know(self, features: Set[Feature]) -> None:
        """Add features to the programs, before any are made."""
        if features:
            self._types = with_features(self.types, features)

    def switch(self, types: MaterialTypeSet) -> None:
        """Switch to programs of these types, in which all types in use have kept their positions.

        Raises MaterialTypeError, and changes nothing, if a type was replaced and its materials' parameters do not
        fit the new version.
        """
        replaced = {kind.name: kind for kind in plain(types).values() if kind not in self._types}
        compiled = programs(self._device).material_types
        packed = {
            entry.row: compiled[replaced[entry.type]].packed(material.name, material.parameters)
            for material, entry in self._materials.items()
            if entry.type in replaced and entry.type == material.type
        }
        for row, parameters in packed.items():
            self.table.rows[row]["parameters"] = parameters
            self.table.touch(np.array([row]))
        self._types = types

    def make_programs(self) -> None:
        """Compile all missing programs of the device's passes before a first frame, perhaps with more features than are
        in use."""
        types = prepare(self._device, self.types)
        if types != self.types:
            self._types = types

    def has(self, material: Material) -> bool:
        """Whether the material has users."""
        return material in self._materials

    def acquire(self, material: Material, users: int = 1) -> int:
        """The row of a material, with one more user, or several."""
        entry = self._materials.get(material)
        if entry is None:
            entry = self._materials[material] = self._pack(material, self.table.take(1))
        entry.users += users
        return entry.row

    def can_renew(self, material: Material) -> bool:
        """Whether `renew` suffices for the edits of a material in use."""
        return self._materials[material].kind == _kind(material) and features_of(material) <= supported_features(
            self.types
        )

    def renew(self, material: Material) -> bool:
        """Pack a material in use as it is now. Returns whether the light that it emits is other than before."""
        before = self._materials[material]
        entry = self._materials[material] = self._pack(material, before.row)
        entry.users = before.users
        self._type_users[before.type] -= 1
        self.table.touch(np.array([entry.row]))
        return entry.emission != before.emission

    def check(self, material: Material) -> None:
        """Raises MaterialTypeError if its parameters do not match its type, which the programs have."""
        compiled = programs(self._device).material_types[material_source(material.type)]
        compiled.packed(material.name, material.parameters)

    def with_image(self, image: Image) -> list[Material]:
        """The materials in use that have it. Its pixels have changed: the next that is packed uploads them."""
        users = [(m, used) for m, entry in self._materials.items() for used in entry.images if used.image is image]
        for _, used in users:
            self._textures.outdate(used)
        return [material for material, _ in users]

    def numbered(self) -> Iterator[tuple[int, Material]]:
        """Each material in use and its row."""
        return ((entry.row, material) for material, entry in self._materials.items())

    def shape_number(self, hit_group: str) -> int:
        """`SectionRecord.shape` of primitives with the entry "shape/type", whose material has been acquired."""
        shape, material = hit_group.split("/")
        if all(kind.name != hit_group for kind in self._types):
            kind = self._types[self.type_number(material)]
            assert isinstance(kind, MaterialSource)
            self._types = self.types_with([ShapeOn(shape_source(shape), kind)])
        return [source.name for source in shapes_of(self._types)].index(shape) + 1

    def release(self, material: Material) -> None:
        """Remove one user."""
        entry = self._materials[material]
        entry.users -= 1
        if entry.users:
            return
        del self._materials[material]
        self.traits.forget(entry.row)
        self._type_users[entry.type] -= 1
        self.table.give_back(entry.row, 1)

    def _pack(self, material: Material, row: int) -> _Packed:
        images: list[ImageOnGpu] = []
        self.table.rows[row] = self._packed(material, row, images)
        self._type_users[material.type] += 1
        self.traits.note(row, material)
        return _Packed(row, material.type, _kind(material), images, average_emission(material))

    def _packed(self, material: Material, row: int, images: list[ImageOnGpu]) -> NDArray[np.void]:
        """The content of its row; the images that it uses are added to `images`."""
        packed = np.zeros((), MATERIAL)
        packed["row"] = row
        for name in (
            "base_color",
            "emission",
            "metallic",
            "specular_color",
            "roughness",
            "ior",
            "specular",
            "absorption",
            "scattering",
            "diffuse_transmission_color",
        ):
            packed[name] = getattr(material, name)
        for name in (
            "normal_scale",
            "occlusion_strength",
            "alpha_cutoff",
            "transmission",
            "coat_normal_scale",
            "dispersion",
            "scatter_anisotropy",
        ):
            packed[name] = getattr(material, name)
        packed["diffuse_transmission"] = material.diffuse_transmission if material.passes_diffusely() else 0
        coats = baked(material)
        packed["coat_count"] = len(coats)
        for entry, coat in zip(packed["coats"], coats, strict=False):
            for name in ("strength", "roughness", "ior"):
                entry[name] = getattr(coat, name)
            entry["transmittance"] = coat.transmittance
            entry["ior_below"] = 1.0 if coat.air_below else coat.ior
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
            | _EVEN_EMISSION * (material.type == STANDARD and material.emissive_texture is None)
        )
        source = next((kind for kind in plain(self._types).values() if kind.name == material.type), None)
        if source is None:
            source = material_source(material.type)
            self._types = self.types_with([source])
        self.know(features_of(material))
        packed["parameters"] = programs(self._device).material_types[source].packed(material.name, material.parameters)
        packed["type"] = self.type_number(material.type)
        base_color: ImageOnGpu | None = None
        normals_are_means = True
        for number, slot in enumerate(_SLOTS):
            texture: Texture | None = getattr(material, f"{slot}_texture")
            if texture is None:
                continue
            width, height = texture.image.size
            packed["textured"] |= 1 << number
            entry = packed[f"{slot}_texture"]
            weighted_by = base_color if _is_weighted(material, texture) else None
            srgb = is_srgb(texture.image, slot)
            images.append(self._textures.of(texture.image, srgb, slot in _RADIANCE, weighted_by))
            texture.image.follow(self._changes)
            if slot == "base_color":
                base_color = images[-1]
            if slot in _NORMALS:
                normals_are_means &= images[-1].has_made_levels
            entry["texture"] = images[-1].view.descriptor_handle_ro.value
            entry["sampler"] = self._textures.sampler(texture.sampler).descriptor_handle.value
            entry["transform"] = np.reshape(texture.transform, (2, 3))
            entry["uv_set"] = texture.uv_set
            entry["texels"] = width * height
        packed["flags"] |= _MEAN_NORMALS * normals_are_means
        return packed


def _is_weighted(material: Material, texture: Texture) -> bool:
    """Whether a texture has the roughness and metalness of a material (and perhaps its occlusion), and lies on its base
    colour, which then weights its coarser mip levels."""
    surface, color = material.metallic_roughness_texture, material.base_color_texture
    if surface is None or color is None or texture.image is not surface.image or texture.image is color.image:
        return False
    return surface.uv_set == color.uv_set and np.array_equal(surface.transform, color.transform)


def _kind(material: Material) -> tuple[object, ...]:
    """The properties that draws, structures and hit groups depend on."""
    return material.type, material.double_sided, material.alpha_mode is AlphaMode.OPAQUE, material.transmission > 0


def is_srgb(image: Image, slot: str) -> bool:
    """Whether a material's texture of this name is decoded from sRGB."""
    return slot in _SRGB if image.encoding is None else image.encoding == "srgb"
