"""The shadows of a frame's light slots, from rays or shadow maps."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.graph.resources import Texture


@dataclass(frozen=True)
class ShadowTextures:
    """The textures with the shadows of a frame."""

    bits: Texture
    """(width, height, rg32_uint) one bit a slot. Red: the light's sample is not hidden; green: a ray was traced."""
    filtered: Texture
    """(width, height, denoised slots, rgba16_float) visibility of a slot's light, 0 to 1."""
    samples: Texture | None
    """(width, height, slots, rgba16_float) the same of this frame's samples, weighted; in other than transparent scenes
    of the denoised slots alone. None where no rays are traced."""
    followed: Texture | None = None
    """(width, height, r8_uint) above 0 where something that moves casts a sharp shadow, or did a few frames ago. None
    where no rays are traced."""
    rates: Texture | None = None
    """(width, height, r8_unorm) how fast what hides samples of many lights moves (shadow_rays.slang). None likewise,
    and without such samples."""
    maps: Mapping[str, Any] | None = None
    """The parameters of light_sampling/mapped_visibility.slang, where lights have shadow maps."""


def visibility_layers(bits: NDArray[np.uint32], slots: int) -> NDArray[np.float32]:
    """(height, width, 2) bits as (height, width, slots) numbers, 1 where the light's sample was not hidden."""
    return ((bits[..., :1] >> np.arange(slots, dtype=np.uint32)) & 1).astype(np.float32)
