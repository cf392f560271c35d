"""What shaders say of a surface, whatever their names for it: numbers and maps, which materials.py writes."""

from dataclasses import dataclass
from typing import NamedTuple

Color = tuple[float, float, float]
Transform = tuple[float, float, float, float, float, float]
_CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}


class Map(NamedTuple):
    """A texture as one input reads it."""

    content: bytes
    """Of the picture's file."""
    name: str
    output: str = "rgb"
    """Or one of r, g, b and a."""
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    uv: str = "st"
    """The primvar of texture coordinates."""
    transform: Transform | None = None
    """Of texture coordinates whose v points up: rows of a 2x3 matrix."""
    wraps: tuple[int, int] = (10497, 10497)
    """As glTF's sampler has them."""
    encoding: str | None = None
    """"srgb" or "linear"; None: by use."""

    @property
    def channel(self) -> int:
        """0 to 3 for red, green, blue and alpha."""
        return _CHANNELS.get(self.output, 0)


@dataclass
class Surface:
    """Parameters as glTF's extensions define them; None is what the shader does not say."""

    base_color: Color | Map = (1.0, 1.0, 1.0)
    metallic: float | Map = 0.0
    roughness: float | Map = 0.5
    emission: Color | Map = (0.0, 0.0, 0.0)
    opacity: float | Map = 1.0
    cutoff: float = 0.0
    """Alpha below it is not there; 0: alpha is blended."""
    normal: Map | None = None
    occlusion: Map | None = None
    ior: float = 1.5
    specular: float = 1.0
    specular_color: Color = (1.0, 1.0, 1.0)
    specular_workflow: Color | None = None
    """Reflectance at normal incidence instead of a metal's."""
    transmission: float = 0.0
    absorption: Color = (0.0, 0.0, 0.0)
    """Per metre."""
    thin_walled: bool = True
    coat: float | Map = 0.0
    coat_roughness: float | Map = 0.0
    sheen_color: Color = (0.0, 0.0, 0.0)
    sheen_roughness: float = 0.0
    film_weight: float = 0.0
    film_ior: float = 1.3
    film_thickness: float = 0.0
    """Nanometres."""
    anisotropy: float = 0.0
    anisotropy_rotation: float = 0.0
    """Radians."""
    dispersion: float = 0.0
    takes_colors: bool = False
    """Whether colours of vertices multiply the base colour."""

    def maps(self) -> list[Map]:
        """The maps that are used."""
        return [value for value in vars(self).values() if isinstance(value, Map)]
