"""Light towards the camera, a picture for each kind, which the composite adds up.

Each is (width, height) of nits, three floats of 21 bits (packFloat21x3); 0 where only the surroundings are visible.
"""

import numpy as np
import slangpy as spy

from pica.frame.aovs import light_of
from pica.frame.effect import Array

SIGNAL = spy.Format.rg32_uint
"""Light of one kind."""
BOTH_PARTS = spy.Format.rgba32_uint
"""Diffuse light, then specular light."""


def diffuse_of(*packed: Array) -> Array:
    """The sum of the diffuse light of textures of BOTH_PARTS."""
    return np.asarray(sum(light_of(texture[..., :2]) for texture in packed))


def specular_of(*packed: Array) -> Array:
    """The same of specular light."""
    return np.asarray(sum(light_of(texture[..., 2:]) for texture in packed))
