"""What the filter of stochastic light sees and does, as pictures."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.aovs import light_of
from pica.frame.effect import Aov

Array = NDArray[Any]
_PARTS = ("diffuse", "specular")


def stochastic_light_views(textures: Mapping[str, spy.Texture]) -> dict[str, Aov]:
    """Views of the denoiser's textures, of the diffuse and the specular part.

    PART.raw: this frame's samples over albedo, (height, width, 3), nits; PART.filtered: what the picture has of them;
    PART.history: (height, width) samples in the mean; PART.variance: of the result, as the filter sees it.
    """

    def of(name: str, layer: int, read: Callable[[Array], Array]) -> Aov:
        return Aov((textures[name],), lambda layers: read(layers[layer]))

    views = {}
    for layer, part in enumerate(_PARTS):
        views[f"{part}.raw"] = of("samples", layer, lambda values: values[..., :3])
        views[f"{part}.filtered"] = of("filtered", layer, light_of)
        views[f"{part}.history"] = of("moments", layer, lambda values: values[..., 1])
        views[f"{part}.variance"] = of(
            "filtered", layer, lambda values: np.maximum(values[..., 3].view(np.float32), 0) ** 2
        )
    return views
