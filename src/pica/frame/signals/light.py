"""Light towards the camera, a picture for each kind, which the composite adds up.

Each is (width, height) of nits, three floats of 21 bits (packFloat21x3); 0 where only the surroundings are visible.
"""

from typing import NamedTuple

import numpy as np
import slangpy as spy

from pica.frame.aovs import light_of
from pica.frame.effect import Array
from pica.graph.resources import Texture

SIGNAL = spy.Format.rg32_uint
"""Light of one kind."""
BOTH_PARTS = spy.Format.rgba32_uint
"""Diffuse light, then specular light."""


class NoisyLight(NamedTuple):
    """Light that one random sample a pixel and frame brings, before its filter."""

    samples: Texture
    """(width, height, 2, rgba32_float) over albedo, diffuse and specular; alpha 1, or 0 where nothing is reflected."""
    albedo: Texture
    """(width, height) BOTH_PARTS: what multiplies it once it is filtered."""


def diffuse_of(*packed: Array) -> Array:
    """The sum of the diffuse light of textures of BOTH_PARTS."""
    return np.asarray(sum(light_of(texture[..., :2]) for texture in packed))


def specular_of(*packed: Array) -> Array:
    """The same of specular light."""
    return np.asarray(sum(light_of(texture[..., 2:]) for texture in packed))
