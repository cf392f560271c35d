"""Tables for sampling an environment by its brightness, as shaders/environment.slang reads them."""

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.lights.light_rows import LUMINANCE

SMALLEST_SHARE = 2.0**-10
"""Smallest probability of a lit texel over its row's mean: single precision still separates neighbouring texels."""


def build_tables(radiance: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Cumulative shares of light of the rows (height,), and within each row (height, width), last element 1.

    `radiance` is (height, width, 3), linear. A texel weighs its mean luminance after bilinear filtering, so that none
    is left out in which the filtered map is lit, times its solid angle. A black map is sampled evenly.
    """
    height, _, _ = radiance.shape
    brightness = _filtered(radiance.astype(np.float64) @ LUMINANCE)
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    band = edges[:-1] - edges[1:]  # solid angle of a row over 2 pi
    if not brightness.any():
        brightness[:] = 1
    brightness = _raised(brightness, axis=1)
    rows = _raised(brightness.mean(axis=1) * band, axis=0)
    return _cumulative(rows).astype(np.float32), _cumulative(brightness).astype(np.float32)


def _filtered(texels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over each texel of the bilinear interpolation: 1/8, 6/8, 1/8 along both axes."""
    above, below = np.vstack([texels[:1], texels[:-1]]), np.vstack([texels[1:], texels[-1:]])
    rows = 0.75 * texels + 0.125 * (above + below)
    return 0.75 * rows + 0.125 * (np.roll(rows, 1, axis=1) + np.roll(rows, -1, axis=1))


def _raised(weights: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Raise very dark lit texels to SMALLEST_SHARE of the mean."""
    least = weights.mean(axis=axis, keepdims=True) * SMALLEST_SHARE
    return np.where(weights > 0, np.maximum(weights, least), 0.0)


def _cumulative(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Running sums along the last axis over their total; a row of zeros counts as even, it is never chosen."""
    sums = np.cumsum(weights, axis=-1)
    even = np.linspace(1 / weights.shape[-1], 1, weights.shape[-1])
    total = sums[..., -1:]
    return np.where(total > 0, sums / np.where(total > 0, total, 1), even)
