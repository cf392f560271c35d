"""Ambient occlusion and the work of its filters as arrays for people."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

Array = NDArray[Any]


def open_share(texture: spy.Texture) -> Array:
    """(height, width) from 0 to 1: how open each pixel's surroundings are, of a texture that AmbientOcclusion made."""
    return np.clip(_channel(texture, 0), 0, 1)


def occlusion_views(textures: Mapping[str, spy.Texture]) -> dict[str, Callable[[], Array]]:
    """Functions that fetch the views of `AmbientOcclusion.debug_views`, each (height, width).

    debug.ambient_occlusion.raw: this frame's rays or horizons, 0 to 1. And where there is a filter .filtered: what the
    lighting uses; .history: frames in the mean; .variance: what the filter takes for its result's.
    """
    views: dict[str, Callable[[], Array]] = {"raw": lambda: open_share(textures["raw"])}
    if "filtered" in textures:
        views["filtered"] = lambda: open_share(textures["filtered"])
        views["history"] = lambda: _channel(textures["history"], 1)
        views["variance"] = lambda: _channel(textures["filtered"], 1)
    return {f"debug.ambient_occlusion.{name}": view for name, view in views.items()}


def _channel(texture: spy.Texture, index: int) -> Array:
    values = np.asarray(texture.to_numpy())
    return (values if values.ndim == 2 else values[..., index]).astype(np.float32)
