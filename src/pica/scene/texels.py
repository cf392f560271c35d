"""Conversion of arrays to texels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.arrays import as_array, check_shares, floats
from pica.scene.values import UnfitError

_ANY = floats()
_WHAT = "uint8, or of floats from 0 to 1"


def texels(values: Any) -> NDArray[np.uint8]:
    """Checks an array for texels, (height, width) or (height, width, 1 to 4): uint8, or floats of 0 to 1.

    Returns (height, width, 4) uint8, without any change of encoding. One channel is grey, two are grey and alpha.
    """
    given = as_array(values, (), "fiu", _WHAT)
    if given.dtype == np.uint8:
        eight_bit: NDArray[np.uint8] = given
    elif given.dtype.kind == "f":
        eight_bit = _quantized(_ANY(given))
    else:
        raise UnfitError(f"an array of {given.dtype.name} is not an array of {_WHAT}")
    if eight_bit.ndim == 2:
        eight_bit = eight_bit[..., None]
    if eight_bit.ndim != 3 or not 1 <= eight_bit.shape[2] <= 4:
        raise UnfitError(f"has the shape {given.shape}, not (height, width) or (height, width, 1 to 4)")
    channels = eight_bit.shape[2]
    made = np.full((*eight_bit.shape[:2], 4), 255, np.uint8)
    has_alpha = channels in (2, 4)
    made[..., :3] = eight_bit[..., : channels - has_alpha]
    if has_alpha:
        made[..., 3] = eight_bit[..., -1]
    return made


def _quantized(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    check_shares(values)
    return np.rint(values * 255).astype(np.uint8)
