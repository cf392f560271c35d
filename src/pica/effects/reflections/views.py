"""Reflections and the work of their filters as arrays for people."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.aovs import light_of
from pica.frame.effect import Aov

Array = NDArray[Any]


def color(values: Array) -> Array:
    """(height, width, 3) of a texture with an alpha channel."""
    return values[..., :3].astype(np.float32)


def reflection_views(textures: Mapping[str, spy.Texture]) -> dict[str, Aov]:
    """Views of the reflections' textures; light is in nits over specular albedo.

    raw: (height / 2, width / 2, 3) what each ray brought. reconstructed: (height, width, 3) from neighbours' rays of
    this frame; variance: of that, (height, width); distance: metres to what is mirrored; accumulated: with earlier
    frames; history: how many these are, times the rays that each tells as much as.

    Where the textures are given, what the newest frame found of the one before: of_surface and of_image, light where
    the surface was and where the image of what it mirrors was; image_share: how much the latter counts; kernel: pixels
    that the filter reaches.
    """
    past = {}
    if "choice" in textures:
        past = {
            "of_surface": Aov((textures["ofSurface"],), color),
            "of_image": Aov((textures["ofImage"],), color),
            "image_share": Aov((textures["choice"],), lambda values: values[..., 0]),
            "kernel": Aov((textures["choice"],), lambda values: values[..., 1]),
        }
    return past | {
        "raw": Aov((textures["light"],), lambda light: light_of(light[..., :2]) + light_of(light[..., 2:])),
        "reconstructed": Aov((textures["reconstructed"],), color),
        "variance": Aov((textures["reconstructed"],), lambda values: values[..., 3]),
        "distance": Aov((textures["distances"],), lambda values: values[..., 0]),
        "accumulated": Aov((textures["signal"],), color),
        "history": Aov((textures["history"],), lambda layers: layers[0, ..., 3]),
    }
