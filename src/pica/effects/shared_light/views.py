"""What the filter of shared light sees and does, as pictures."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

Array = NDArray[Any]
_PARTS = ("diffuse", "specular")


def shared_light_views(textures: Mapping[str, spy.Texture]) -> dict[str, Callable[[], Array]]:
    """Functions that fetch the views of `SharedLight.debug_views`, of the diffuse and the specular part.

    debug.shared_light.PART.raw: this frame's samples over albedo, (height, width, 3), nits; .filtered: what the picture
    has of them; .history: (height, width) samples in the mean; .variance: of the result, as the filter sees it.
    """

    def fetch(name: str, layer: int) -> Array:
        return np.asarray(textures[name].to_numpy(layer=layer))

    def color(name: str, layer: int) -> Array:
        return fetch(name, layer)[..., :3]

    def history(layer: int) -> Array:
        return fetch("moments", layer)[..., 1]

    def variance(layer: int) -> Array:
        return np.maximum(fetch("deviation", layer), 0) ** 2

    views: dict[str, Callable[[], Array]] = {}
    for layer, part in enumerate(_PARTS):
        place = f"debug.shared_light.{part}"
        views[f"{place}.raw"] = partial(color, "samples", layer)
        views[f"{place}.filtered"] = partial(color, "filtered", layer)
        views[f"{place}.history"] = partial(history, layer)
        views[f"{place}.variance"] = partial(variance, layer)
    return views
