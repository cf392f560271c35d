"""Ambient occlusion and the work of its filters as arrays for people."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

Array = NDArray[Any]


def unoccluded(occlusion: Array) -> Array:
    """(height, width) from 0 to 1: how open each pixel's surroundings are, of a texture that AmbientOcclusion made."""
    return np.clip(occlusion[..., 0], 0, 1).astype(np.float32)


def offer_occlusion_aovs(graph: FrameGraph, history: Texture, filtered: Texture) -> None:
    """Offer views of a filter's textures, each (height, width).

    filtered: the filter's result; history: frames in the mean; variance: the filter's estimate for its result.
    """
    of = "debug.ambient_occlusion"
    graph.offer(f"{of}.filtered", (filtered,), unoccluded)
    graph.offer(f"{of}.history", (history,), lambda layers: layers[0, ..., 1].astype(np.float32))
    graph.offer(f"{of}.variance", (filtered,), lambda values: values[..., 1].astype(np.float32))
