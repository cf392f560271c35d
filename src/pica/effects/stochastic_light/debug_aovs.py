"""Debug AOVs of the stochastic light's filter."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.filtering.accumulation import history_length
from pica.frame.aovs import light_of
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

Array = NDArray[Any]
_PARTS = ("diffuse", "specular")


def offer_stochastic_light_aovs(graph: FrameGraph, samples: Texture, filtered: Texture, history: Texture) -> None:
    """Offer the denoiser's textures, of the diffuse and the specular part.

    PART.raw: this frame's samples over albedo, (height, width, 3), nits; PART.filtered: the result;
    PART.history: (height, width) samples in the mean; PART.variance: the filter's estimate for the result.
    """

    def offer(name: str, source: Texture, layer: int, read: Callable[[Array], Array]) -> None:
        graph.offer(f"debug.stochastic_light.{name}", (source,), lambda layers: read(layers[layer]))

    for layer, part in enumerate(_PARTS):
        offer(f"{part}.raw", samples, layer, lambda values: values[..., :3])
        offer(f"{part}.filtered", filtered, layer, light_of)
        offer(f"{part}.history", history, layer, history_length)
        offer(f"{part}.variance", filtered, layer, lambda values: np.maximum(values[..., 3].view(np.float32), 0) ** 2)
