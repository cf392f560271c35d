"""Ambient occlusion and the work of its filters as arrays for people."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.effect import Aov

Array = NDArray[Any]


def open_share(occlusion: Array) -> Array:
    """(height, width) from 0 to 1: how open each pixel's surroundings are, of a texture that AmbientOcclusion made."""
    return np.clip(occlusion[..., 0], 0, 1).astype(np.float32)


def _second(values: Array) -> Array:
    return values[..., 1].astype(np.float32)


def occlusion_views(textures: Mapping[str, spy.Texture]) -> dict[str, Aov]:
    """Views of an occlusion's textures, each (height, width).

    raw: this frame's rays or horizons, 0 to 1. And where there is a filter filtered: what the lighting uses;
    history: frames in the mean; variance: what the filter takes for its result's.
    """
    views = {"raw": Aov((textures["raw"],), open_share)}
    if "filtered" in textures:
        views["filtered"] = Aov((textures["filtered"],), open_share)
        views["history"] = Aov((textures["history"],), lambda layers: _second(layers[0]))
        views["variance"] = Aov((textures["filtered"],), _second)
    return views
