"""The sRGB transfer curve and Rec. 709 luminance on NumPy arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def srgb_encode(linear: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Linear values to sRGB, element by element; values outside 0 to 1 are clipped (IEC 61966-2-1, 5.2)."""
    value = np.clip(linear, 0, 1).astype(np.float32, copy=False)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** np.float32(1 / 2.4) - 0.055).astype(np.float32)


def srgb_decode(encoded: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """sRGB from 0 to 1 to linear values, likewise."""
    value = np.clip(encoded, 0, 1).astype(np.float32, copy=False)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** np.float32(2.4)).astype(np.float32)


def luminance(linear: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """Luminance of (..., 3) linear Rec. 709 colours, (...) (ITU-R BT.709-6, item 3.2)."""
    return linear @ _LUMINANCE
