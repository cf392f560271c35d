"""Materials as glTF 2.0 describes them, and the textures that they read."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.images.blocks import BlockPicture
from pica.names import checked_names
from pica.scene.anisotropy import Anisotropy
from pica.scene.arrays import integers, picture
from pica.scene.changes import Followed
from pica.scene.checked_field import CheckedField, read_only
from pica.scene.coat import Coat, coats
from pica.scene.construction import fields_only, unchecked_constructor
from pica.scene.iridescence import Iridescence
from pica.scene.light import COLOR, WHITE, Color
from pica.scene.material_registry import STANDARD
from pica.scene.sheen import Sheen
from pica.scene.texels import texels
from pica.scene.tracked_field import TrackedField
from pica.scene.values import (
    BRIGHTEST,
    UnfitError,
    checked,
    choice,
    flag,
    instance,
    number,
    optional,
    text,
    vector,
    whole,
)

_SHARE = number(0, 1)
_NOT_NEGATIVE = number(0)
_ANISOTROPY = number(-1, 1)


class AlphaMode(Enum):
    """Alpha modes (glTF 2.0, 3.9.4)."""

    OPAQUE = "OPAQUE"
    MASK = "MASK"
    """Below alpha_cutoff the surface is not there."""
    BLEND = "BLEND"
    """Alpha is coverage: the fraction of rays that hit the surface."""


class Wrap(Enum):
    """Texture wrap modes outside 0 to 1."""

    REPEAT = "repeat"
    MIRRORED_REPEAT = "mirrored_repeat"
    CLAMP_TO_EDGE = "clamp_to_edge"


@checked_names(SceneError)
@dataclass(frozen=True)
class Sampler:
    """How a texture is read between and outside its texels."""

    wrap_u: CheckedField[Wrap] = CheckedField(instance(Wrap), Wrap.REPEAT)
    wrap_v: CheckedField[Wrap] = CheckedField(instance(Wrap), Wrap.REPEAT)
    linear: CheckedField[bool] = CheckedField(flag, True)
    """Interpolate between texels; False shows them as blocks."""


Encoding = Literal["srgb", "linear"]
_ENCODING = choice("srgb", "linear")


class _Pixels(TrackedField[NDArray[np.uint8]]):
    """Decoded at each use, and not stored, while an image has blocks."""

    def __get__(self, holder: Any, owner: type) -> Any:
        blocks = None if holder is None else holder.blocks
        return super().__get__(holder, owner) if blocks is None else read_only(blocks.pixels())

    def check_again(self, holder: object) -> None:
        """As of all fields; blocks do not change."""
        if "pixels" in vars(holder):
            super().check_again(holder)


@fields_only
@dataclass(eq=False)
class Image(Followed):
    """Pixels of a texture: (height, width, 4) uint8, row 0 on top; their meaning depends on the use.

    Assigned pixels, of any size, are in the next picture. Raises SceneError for other shapes, sides beyond
    16384, and values that are not integers of 0 to 255. Pictures that stay compressed, as blocks, are decoded whenever
    `pixels` is read.
    """

    pixels: TrackedField[NDArray[np.uint8]] = _Pixels(picture(integers(np.uint8, "height", "width", 4)))
    name: CheckedField[str] = CheckedField(text, "")
    encoding: TrackedField[Encoding | None] = TrackedField(optional(_ENCODING), None)
    """The encoding of red, green and blue in every use; None: that of each use in Material. Alpha is linear."""
    _file_format: str = field(default="", init=False, repr=False)

    @property
    def file_format(self) -> str:
        """Format of the file that the pixels were decoded from, such as "PNG"; empty for those made in code."""
        return self._file_format

    @property
    def blocks(self) -> BlockPicture | None:
        """The picture as a device samples it, until pixels are assigned; None: it is not compressed."""
        blocks: BlockPicture | None = vars(self).get("_blocks")
        return blocks

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in texels."""
        if self.blocks is not None:
            return self.blocks.width, self.blocks.height
        return self.pixels.shape[1], self.pixels.shape[0]

    def _written(self, field: str, before: Any) -> None:
        """As tracked_field.Holder."""
        if field == "pixels":
            vars(self).pop("_blocks", None)
            self._file_format = ""
        super()._written(field, before)

    @staticmethod
    def of_blocks(blocks: BlockPicture, name: str = "", encoding: Encoding | None = None) -> "Image":
        """An image that stays compressed."""
        image = _plain_image(name=name, encoding=encoding)
        vars(image)["_blocks"] = blocks
        return image

    @staticmethod
    def from_array(array: ArrayLike, *, encoding: Encoding, name: str = "") -> "Image":
        """An image of uint8, or of floats from 0 to 1, which are rounded to 8 bits as they are.

        `array`: (height, width) or (height, width, 1 to 4), row 0 on top; one channel is grey, two are grey and alpha.
        `encoding`: "srgb", as of pictures, or "linear", as of measured data; shaders decode the image accordingly
        in any texture of a material. Linear colours have few dark steps in 8 bits: encode them first. Raises
        SceneError for other shapes, types and numbers.
        """
        encoding = checked("image: encoding", _ENCODING, encoding)
        return Image(checked("image: array", picture(texels), array), name, encoding)


_plain_image = unchecked_constructor(Image)


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Texture:
    """An image as one material uses it."""

    image: CheckedField[Image] = CheckedField(instance(Image))
    sampler: CheckedField[Sampler] = CheckedField(instance(Sampler), Sampler())
    uv_set: CheckedField[int] = CheckedField(whole(0, 1), 0)
    """Which texture coordinates to use, 0 or 1."""
    transform: CheckedField[tuple[float, float, float, float, float, float]] = CheckedField(
        vector(6), (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    )
    """Rows of a 2x3 matrix: (u', v') = matrix * (u, v, 1) (KHR_texture_transform)."""

    @staticmethod
    def from_array(
        array: ArrayLike, *, encoding: Encoding, sampler: Sampler | None = None, name: str = ""
    ) -> "Texture":
        """A texture of an array, as Image.from_array has it; `sampler` None: repeated, and interpolated."""
        return Texture(Image.from_array(array, encoding=encoding, name=name), sampler or Sampler())


_TEXTURE = optional(instance(Texture))


def _parameters(values: Any) -> dict[str, Any]:
    """Checked by the compiled type alone (programs/material_types.py)."""
    names: dict[str, Any] = instance(dict)(values)
    for name in names:
        text(name)
    return names


def _index_of_refraction(value: Any) -> float:
    number = _NOT_NEGATIVE(value)
    if 0 < number < 1:
        raise UnfitError(f"{shown(number)} is neither 0 nor 1 or more")
    return number


@fields_only
@dataclass(eq=False)
class Material(Followed):
    """Metallic-roughness material; factors multiply their textures (glTF 2.0, 3.9).

    Assign to a field to change all objects with the material, in the next picture. Raises SceneError, whenever a field
    is set, for values out of range: 0 to 1 unless stated otherwise.
    """

    name: CheckedField[str] = CheckedField(text, "")
    base_color: TrackedField[tuple[float, float, float, float]] = TrackedField(vector(4, 0, 1), (1.0, 1.0, 1.0, 1.0))
    """Linear Rec. 709 and alpha."""
    metallic: TrackedField[float] = TrackedField(_SHARE, 1.0)
    roughness: TrackedField[float] = TrackedField(_SHARE, 1.0)
    """GGX's alpha is roughness squared."""
    emission: TrackedField[Color] = TrackedField(vector(3, 0, BRIGHTEST), (0.0, 0.0, 0.0))
    """Nits, 0 or more: glTF's emissiveFactor times KHR_materials_emissive_strength."""
    base_color_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """sRGB; alpha linear."""
    metallic_roughness_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear: roughness in green, metallic in blue."""
    normal_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, tangent space, +Y up."""
    normal_scale: TrackedField[float] = TrackedField(number(), 1.0)
    """Any number: a negative one inverts bumps."""
    occlusion_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in red."""
    occlusion_strength: TrackedField[float] = TrackedField(_SHARE, 1.0)
    emissive_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """sRGB."""
    alpha_mode: TrackedField[AlphaMode] = TrackedField(instance(AlphaMode), AlphaMode.OPAQUE)
    alpha_cutoff: TrackedField[float] = TrackedField(_NOT_NEGATIVE, 0.5)
    """0 or more."""
    double_sided: TrackedField[bool] = TrackedField(flag, False)
    """False: back faces are culled for the camera. Other rays hit both sides."""
    unlit: TrackedField[bool] = TrackedField(flag, False)
    """Show the base colour as it is (KHR_materials_unlit)."""
    ior: TrackedField[float] = TrackedField(_index_of_refraction, 1.5)
    """Index of refraction (KHR_materials_ior), 1 or more; 0 is infinity."""
    specular: TrackedField[float] = TrackedField(_SHARE, 1.0)
    """Strength of the dielectric reflection; 0 leaves pure Lambert (KHR_materials_specular)."""
    specular_color: TrackedField[Color] = TrackedField(COLOR, WHITE)
    """0 or more."""
    specular_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in alpha."""
    specular_color_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """sRGB."""
    transmission: TrackedField[float] = TrackedField(_SHARE, 0.0)
    """Fraction of the light in the dielectric that passes the surface instead of being reflected diffusely, 0 to 1,
    tinted by the base colour (KHR_materials_transmission)."""
    transmission_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in red."""
    thin_walled: TrackedField[bool] = TrackedField(flag, True)
    """True: the surface is a pane with air on both sides. False: it bounds a solid, which light enters at the front and
    leaves at the back (KHR_materials_volume with a thickness)."""
    absorption: TrackedField[Color] = TrackedField(COLOR, (0.0, 0.0, 0.0))
    """Absorption coefficient of a solid, per metre (KHR_materials_volume: -ln(attenuationColor) /
    attenuationDistance)."""
    dispersion: TrackedField[float] = TrackedField(_NOT_NEGATIVE, 0.0)
    """20 over the Abbe number of a solid (KHR_materials_dispersion): red is refracted less than blue. Glass has 0.3 to
    1."""
    diffuse_transmission: TrackedField[float] = TrackedField(_SHARE, 0.0)
    """Fraction of the dielectric's diffuse light that goes on at the other side of the surface instead, evenly in all
    directions (KHR_materials_diffuse_transmission): of leaves and paper, and with `scattering` of wax and fruit."""
    diffuse_transmission_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in alpha."""
    diffuse_transmission_color: TrackedField[Color] = TrackedField(COLOR, WHITE)
    """Tint of that light at each surface that it passes, at most 1."""
    diffuse_transmission_color_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """sRGB."""
    scattering: TrackedField[Color] = TrackedField(COLOR, (0.0, 0.0, 0.0))
    """Scattering coefficient of a solid, per metre: light is scattered after 1 / scattering metres on average
    (KHR_materials_volume_scatter)."""
    scatter_anisotropy: TrackedField[float] = TrackedField(_ANISOTROPY, 0.0)
    """Mean cosine of the angle of scattering, -1 to 1: 0 scatters evenly, 1 straight on (Henyey and Greenstein
    1941)."""
    coats: TrackedField[tuple[Coat, ...]] = TrackedField(coats, ())
    """Clear layers over all this, the topmost first, 3 at most. Textures are the topmost one's."""
    coat_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in red: times its strength (KHR_materials_clearcoat)."""
    coat_roughness_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in green."""
    coat_normal_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, tangent space, +Y up; the normals of all coats, which are independent of normal_texture."""
    coat_normal_scale: TrackedField[float] = TrackedField(number(), 1.0)
    """Any number."""
    iridescence: TrackedField[Iridescence | None] = TrackedField(optional(instance(Iridescence)), None)
    """A thin film, below all coats."""
    iridescence_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in red: times its strength (KHR_materials_iridescence)."""
    iridescence_thickness_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in green: from the smallest to the largest thickness."""
    anisotropy: TrackedField[Anisotropy | None] = TrackedField(optional(instance(Anisotropy)), None)
    """Of the mirror below all coats."""
    anisotropy_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear: direction in red and green, from -1 to 1, strength in blue (KHR_materials_anisotropy)."""
    sheen: TrackedField[Sheen | None] = TrackedField(optional(instance(Sheen)), None)
    """Fibres on top of all layers but the coats."""
    sheen_color_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """sRGB (KHR_materials_sheen)."""
    sheen_roughness_texture: TrackedField[Texture | None] = TrackedField(_TEXTURE, None)
    """Linear, in alpha."""
    type: TrackedField[str] = TrackedField(text, STANDARD)
    """"standard", or the name that register_material gave to a type of your own."""
    parameters: TrackedField[dict[str, float | Sequence[float]]] = TrackedField(_parameters, dict)
    """The numbers that a type of your own wants, by the names in its `struct Parameters`."""
    extras: dict[str, object] = field(default_factory=dict)

    def passes_diffusely(self) -> bool:
        """Whether light passes its surface diffusely, which needs the standard type."""
        return self.type == STANDARD and self.diffuse_transmission > 0

    def stops_rays(self) -> bool:
        """Whether no ray passes its surface, as one of a texture with holes or of glass."""
        return self.alpha_mode is AlphaMode.OPAQUE and self.transmission == 0
