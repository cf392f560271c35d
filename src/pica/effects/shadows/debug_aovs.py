"""Debug AOVs of the shadow filters."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

Array = NDArray[Any]
_SPACING = 24
"""Pixels between the drawn footprints."""


def offer_shadow_aovs(graph: FrameGraph, textures: Mapping[str, Texture], svgf: int) -> None:
    """Offer a denoiser's textures, with the denoised slots last: (height, width, slots).

    raw: this frame's samples, 0 to 1; filtered: the input of the lighting; history: samples in the mean; variance: of
    the mean, after the filter for the first `svgf` slots; footprint: (height, width, 3) the shadow of the first
    anisotropic slot with its filter ellipses at some pixels in green (RTG 19, figure 19-5), if there is such a slot.
    """

    def offer(view: str, read: Callable[..., Array], *names: str) -> None:
        graph.offer(f"debug.shadows.{view}", tuple(textures[name] for name in names), read)

    def variance(before: Array, after: Array) -> Array:
        return _last(np.concatenate([after[:svgf], before[svgf:]])[..., 0] ** 2)

    offer("raw", lambda samples: _last(samples[..., :3].mean(-1) / np.maximum(samples[..., 3], 1e-6)), "samples")
    offer("filtered", lambda filtered: _last(filtered[..., :3].mean(-1)), "filtered")
    offer("history", lambda moments: _last(moments[..., 1]), "moments")
    offer("variance", variance, "deviation", "filtered deviation")
    if svgf < (textures["filtered"].layers or 0):

        def footprint(filtered: Array, footprints: Array) -> Array:
            return _ellipses(filtered[svgf, ..., :3].astype(np.float32).mean(-1), footprints[0].astype(np.float32))

        offer("footprint", footprint, "filtered", "footprints")


def _last(values: Array) -> Array:
    """(slots, height, width) as (height, width, slots)."""
    return np.ascontiguousarray(np.moveaxis(values.astype(np.float32), 0, -1))


def _ellipses(shadow: Array, footprints: Array) -> Array:
    """(height, width, 3): the picture `shadow` in grey, on it the two-deviation ellipses of every so many pixels."""
    height, width = shadow.shape
    picture = np.repeat(shadow[..., None], 3, axis=-1)
    y, x = np.meshgrid(np.arange(_SPACING // 2, height, _SPACING), np.arange(_SPACING // 2, width, _SPACING))
    axes = footprints[y, x]
    for angle in np.linspace(0, 2 * np.pi, 96, endpoint=False):
        offset = 2 * (axes[..., :2] * np.cos(angle) + axes[..., 2:] * np.sin(angle))
        visible = np.abs(axes).max(-1) > 0
        column, row = np.rint(x + offset[..., 0]).astype(int), np.rint(y + offset[..., 1]).astype(int)
        visible &= (column >= 0) & (column < width) & (row >= 0) & (row < height)
        picture[row[visible], column[visible]] = (0, 1, 0)
    return picture
