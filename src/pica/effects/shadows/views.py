"""What the shadow filters see and do, as pictures."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

Array = NDArray[Any]
_SPACING = 24
"""Pixels between the drawn footprints."""


def shadow_views(textures: Mapping[str, spy.Texture], svgf: int) -> dict[str, Callable[[], Array]]:
    """Functions that fetch the views of `Shadows.debug_views`, with the denoised slots last: (height, width, slots).

    debug.shadows.raw: this frame's samples, 0 to 1. .filtered: what the lighting uses. .history: samples in the mean.
    .variance: of the mean, after the filter for the first `svgf` slots. .footprint: (height, width, 3) the shadow of
    the first anisotropic slot with the ellipses of its filter at some pixels in green, as in figure 19-5 of seed 000;
    only where there is such a slot.
    """

    def layers(name: str) -> Array:
        """(slots, height, width, channels)"""
        texture = textures[name]
        values = np.stack([texture.to_numpy(layer=layer) for layer in range(texture.array_length)]).astype(np.float32)
        return values if values.ndim == 4 else values[..., None]

    def last(values: Array) -> Array:
        return np.ascontiguousarray(np.moveaxis(values, 0, -1))

    def raw() -> Array:
        samples = layers("samples")
        return last(samples[..., :3].mean(-1) / np.maximum(samples[..., 3], 1e-6))

    def variance() -> Array:
        before, after = layers("deviation")[..., 0], layers("filtered deviation")[..., 0]
        return last(np.concatenate([after[:svgf], before[svgf:]]) ** 2)

    views = {
        "debug.shadows.raw": raw,
        "debug.shadows.filtered": lambda: last(layers("filtered")[..., :3].mean(-1)),
        "debug.shadows.history": lambda: last(layers("moments")[..., 1]),
        "debug.shadows.variance": variance,
    }
    if svgf < textures["filtered"].array_length:
        shadow = views["debug.shadows.filtered"]
        views["debug.shadows.footprint"] = lambda: _ellipses(shadow()[..., svgf], layers("footprints")[0])
    return views


def _ellipses(shadow: Array, footprints: Array) -> Array:
    """(height, width, 3): the picture `shadow` in grey, on it the two-deviation ellipses of every so many pixels."""
    height, width = shadow.shape
    picture = np.repeat(shadow[..., None], 3, axis=-1)
    y, x = np.meshgrid(np.arange(_SPACING // 2, height, _SPACING), np.arange(_SPACING // 2, width, _SPACING))
    axes = footprints[y, x]
    for angle in np.linspace(0, 2 * np.pi, 96, endpoint=False):
        offset = 2 * (axes[..., :2] * np.cos(angle) + axes[..., 2:] * np.sin(angle))
        drawn = np.abs(axes).max(-1) > 0
        column, row = np.rint(x + offset[..., 0]).astype(int), np.rint(y + offset[..., 1]).astype(int)
        drawn &= (column >= 0) & (column < width) & (row >= 0) & (row < height)
        picture[row[drawn], column[drawn]] = (0, 1, 0)
    return picture
