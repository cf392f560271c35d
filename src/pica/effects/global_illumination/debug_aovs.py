"""Indirect light and the work of its filters as arrays for people."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.filtering.accumulation import history_length
from pica.frame.effect import rgb
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

Array = NDArray[Any]
_OF = "debug.global_illumination"


def offer_ray_aovs(graph: FrameGraph, path_light: Texture) -> None:
    """Offer results of rays, at half size; light is in nits over diffuse albedo, which is irradiance over pi.

    raw: radiance of single rays; distance: metres to the hit, below 0 for a miss.
    """
    graph.offer(f"{_OF}.raw", (path_light,), rgb)
    graph.offer(f"{_OF}.distance", (path_light,), lambda values: values[..., 3])


def offer_filter_aovs(
    graph: FrameGraph, gathered: Texture, gradients: Texture, signal: Texture, history: Texture
) -> None:
    """Offer results of the filters.

    Half size: gathered: spatial filter over this frame's rays; nearness: 1 / metres to the light's origin. Full
    size: accumulated: temporal filter; variance: of that; history: its length in frames.
    """
    graph.offer(f"{_OF}.gathered", (gathered,), rgb)
    graph.offer(f"{_OF}.nearness", (gradients,), _nearness)
    graph.offer(f"{_OF}.accumulated", (signal,), rgb)
    graph.offer(f"{_OF}.variance", (signal,), lambda values: values[..., 3])
    graph.offer(f"{_OF}.history", (history,), lambda layers: history_length(layers[0]))


def _nearness(gradients: Array) -> Array:
    """As irradiance_gradient.slang packs it."""
    return (gradients[..., 1] & np.uint32(0xFFFF0000)).view(np.float32)


def offer_irradiance_aovs(graph: FrameGraph, arriving: Texture) -> None:
    """Offer the irradiance of each pixel, (height, width[, 3]).

    arriving: nits over diffuse albedo; coverage: the sum of the weights of surfels' discs, otherwise 1 where
    valid.
    """
    graph.offer(f"{_OF}.arriving", (arriving,), rgb)
    graph.offer(f"{_OF}.coverage", (arriving,), lambda values: values[..., 3])


SURFEL_AOVS = tuple(f"{_OF}.{name}" for name in ("discs", "age", "samples", "rays", "cells"))


def offer_surfel_aovs(graph: FrameGraph, nearest: Texture, cells: Texture) -> None:
    """Offer surfels, (height, width[, 3]); 0 without one.

    discs: number of the surfel with the nearest disc, from 1; age: in frames, from 1; samples: number of its rays;
    rays: those of this frame. cells: a colour for each cell of the grid, with the hue of the grid's level.
    """
    graph.offer(f"{_OF}.discs", (nearest,), lambda values: values[..., 0])
    graph.offer(f"{_OF}.age", (nearest,), lambda values: values[..., 1].astype(np.float32))
    graph.offer(f"{_OF}.samples", (nearest,), lambda values: values[..., 2].astype(np.float32))
    graph.offer(f"{_OF}.rays", (nearest,), lambda values: values[..., 3].astype(np.float32))
    graph.offer(f"{_OF}.cells", (cells,), _cell_colors)


_HUES = np.array([(1, 0.2, 0.2), (1, 1, 0.2), (0.2, 1, 0.2), (0.2, 1, 1), (0.2, 0.2, 1), (1, 0.2, 1)], np.float32)
"""Of levels modulo six."""


def _cell_colors(cells: Array) -> Array:
    """The lightness is of the cell's own number, by multiplicative hashing (Knuth)."""
    number, level = cells[..., :1], cells[..., 1].view(np.int32)
    hashed = (number * np.uint32(2654435761)) >> np.uint32(24)
    lightness = np.where(number > 0, 0.15 + 0.85 * hashed / 255, 0)
    return (_HUES[level % 6] * lightness).astype(np.float32)
