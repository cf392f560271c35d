"""Materials as glTF 2.0 describes them, and the textures that they read."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from pica.scene.light import WHITE, Color
from pica.scene.material_registry import STANDARD


class AlphaMode(Enum):
    """What a material's alpha does (glTF 2.0, 3.9.4)."""

    OPAQUE = "OPAQUE"
    MASK = "MASK"
    """Below alpha_cutoff the surface is not there."""
    BLEND = "BLEND"
    """Alpha is coverage: the share of rays that meet the surface."""


class Wrap(Enum):
    """How a texture goes on outside 0 to 1."""

    REPEAT = "repeat"
    MIRRORED_REPEAT = "mirrored_repeat"
    CLAMP_TO_EDGE = "clamp_to_edge"


@dataclass(frozen=True)
class Sampler:
    """How a texture is read between and outside its texels."""

    wrap_u: Wrap = Wrap.REPEAT
    wrap_v: Wrap = Wrap.REPEAT
    linear: bool = True
    """Interpolate between texels; False shows them as blocks."""


@dataclass(frozen=True, eq=False)
class Image:
    """Pixels of a texture: (height, width, 4) uint8, row 0 on top; what they mean depends on the use."""

    pixels: NDArray[np.uint8]
    name: str = ""


@dataclass(frozen=True, eq=False)
class Texture:
    """An image as one material uses it."""

    image: Image
    sampler: Sampler = Sampler()
    uv_set: int = 0
    """Which texture coordinates to use, 0 or 1."""
    transform: tuple[float, float, float, float, float, float] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    """Rows of a 2x3 matrix: (u', v') = matrix * (u, v, 1) (KHR_texture_transform)."""


@dataclass(eq=False)
class Material:
    """Metallic-roughness material; factors multiply their textures (glTF 2.0, 3.9)."""

    name: str = ""
    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Linear Rec. 709 and alpha."""
    metallic: float = 1.0
    roughness: float = 1.0
    """GGX's alpha is roughness squared."""
    emission: Color = (0.0, 0.0, 0.0)
    """Nits: glTF's emissiveFactor times KHR_materials_emissive_strength."""
    base_color_texture: Texture | None = None
    """sRGB; alpha linear."""
    metallic_roughness_texture: Texture | None = None
    """Linear: roughness in green, metallic in blue."""
    normal_texture: Texture | None = None
    """Linear, tangent space, +Y up."""
    normal_scale: float = 1.0
    occlusion_texture: Texture | None = None
    """Linear, in red."""
    occlusion_strength: float = 1.0
    emissive_texture: Texture | None = None
    """sRGB."""
    alpha_mode: AlphaMode = AlphaMode.OPAQUE
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    """False: the camera sees front faces only. Other rays meet both sides."""
    unlit: bool = False
    """Show the base colour as it is (KHR_materials_unlit)."""
    ior: float = 1.5
    """Index of refraction (KHR_materials_ior); 0 stands for infinity."""
    specular: float = 1.0
    """Strength of the dielectric reflection; 0 leaves pure Lambert (KHR_materials_specular)."""
    specular_color: Color = WHITE
    specular_texture: Texture | None = None
    """Linear, in alpha."""
    specular_color_texture: Texture | None = None
    """sRGB."""
    transmission: float = 0.0
    """Share of the light that enters the dielectric and leaves on its far side, 0 to 1, tinted by the base colour
    (KHR_materials_transmission). Only shadows of direct light know of it; all else sees an opaque surface."""
    transmission_texture: Texture | None = None
    """Linear, in red."""
    thin_walled: bool = True
    """True: the surface is a pane with air on both sides. False: it bounds a solid, which light enters at the front and
    leaves at the back (KHR_materials_volume with a thickness)."""
    type: str = STANDARD
    """"standard", or the name that register_material gave to a type of your own."""
    parameters: dict[str, float | Sequence[float]] = field(default_factory=dict)
    """The numbers that a type of your own wants, by the names in its `struct Parameters`."""
    extras: dict[str, object] = field(default_factory=dict)
