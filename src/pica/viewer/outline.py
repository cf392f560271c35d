"""The outline of what is selected, drawn over a picture."""

import numpy as np
from numpy.typing import NDArray

_COLOR = (255, 140, 0)
"""sRGB."""


def outlined(pixels: NDArray[np.uint8], selected: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(height, width, 3) sRGB, with a line of two pixels around `selected`, (height, width)."""
    inner, outer = ~_grown(~selected), _grown(selected)
    result = pixels.copy()
    result[outer & ~inner] = _COLOR
    return result


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """With all eight neighbours."""
    rows = mask.copy()
    rows[1:] |= mask[:-1]
    rows[:-1] |= mask[1:]
    grown = rows.copy()
    grown[:, 1:] |= rows[:, :-1]
    grown[:, :-1] |= rows[:, 1:]
    return grown
