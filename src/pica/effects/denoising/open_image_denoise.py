"""Open Image Denoise on arrays, by the wheel of Mitsuba's authors (the extra pica[denoise])."""

from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.text import first_line

Picture = NDArray[np.float32]

_LEAST = 32
"""Pixels each way, below which its network finds too little around a pixel: 0.02 of a single pixel of 0.5."""


def is_installed() -> bool:
    """Whether there is something to denoise with."""
    return find_spec("mitsuba_oidn") is not None


def check_installed() -> None:
    """Raises PicaError where there is not."""
    if not is_installed():
        raise PicaError('denoise: Open Image Denoise is not installed; `pip install "pica[denoise]"` installs it')


def denoised(color: Picture, albedo: Picture, normal: Picture) -> Picture:
    """(height, width, 3) linear radiance without its noise, from noisy radiance and what is seen in each pixel.

    `albedo`: 0 to 1. `normal`: -1 to 1, 0 where there is no surface. Raises PicaError where it is not installed, or
    cannot do it.
    """
    check_installed()
    height, width = color.shape[:2]
    pictures = [_large_enough(picture) for picture in (np.maximum(color, 0), albedo, normal)]
    try:
        import mitsuba_oidn as oidn

        # As measured (docs/denoising.md): Balanced has High's mean FLIP in two fifths of the time, and what is seen is
        # clean enough from the first sample on to be taken as it is.
        result: Any = oidn.denoise(*pictures, hdr=True, clean_aux=True, quality=oidn.Quality.Balanced)
    except (ImportError, OSError, RuntimeError) as error:
        raise PicaError(f"denoise: Open Image Denoise cannot be used here ({first_line(error)})") from error
    return np.asarray(result)[:height, :width]


def _large_enough(picture: Picture) -> Picture:
    """The picture, mirrored at its right and lower sides until it has the least size."""
    height, width = (max(_LEAST - length, 0) for length in picture.shape[:2])
    return np.ascontiguousarray(np.pad(picture, ((0, height), (0, width), (0, 0)), mode="symmetric"))
