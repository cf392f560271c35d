"""Open Image Denoise on arrays, by the wheel of Mitsuba's authors (the extra pica[denoise])."""

from functools import cache
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
    """Whether the denoiser is installed."""
    return find_spec("mitsuba_oidn") is not None


def check_installed() -> None:
    """Raises PicaError if it is not."""
    if not is_installed():
        raise PicaError('denoise: Open Image Denoise is not installed; `pip install "pica[denoise]"` installs it')


def denoised(color: Picture, albedo: Picture, normal: Picture, fast: bool = False) -> Picture:
    """(height, width, 3) denoised linear radiance, from noisy radiance and the features of visible surfaces.

    `albedo`: 0 to 1. `normal`: -1 to 1, 0 without a surface. `fast`: by a smaller network. Raises PicaError
    if it is not installed, or fails.
    """
    check_installed()
    height, width = color.shape[:2]
    noisy, albedo, normal = (_large_enough(picture) for picture in (np.maximum(color, 0), albedo, normal))
    try:
        import mitsuba_oidn as oidn

        device = _device()
        quality = oidn.Quality.Fast if fast else oidn.Quality.High
        if not fast:
            # Few samples leave noise in the features at edges and partial coverage, which would show.
            albedo, normal = _prefiltered("albedo", albedo), _prefiltered("normal", normal)
        result = oidn.denoise(noisy, albedo, normal, hdr=True, clean_aux=not fast, quality=quality, device=device)
    except (ImportError, OSError, RuntimeError) as error:
        raise PicaError(f"denoise: Open Image Denoise cannot be used here ({first_line(error)})") from error
    return np.asarray(result)[:height, :width]


@cache
def _device() -> Any:
    """The processor, which can do it everywhere alike."""
    import mitsuba_oidn as oidn

    return oidn.Device(oidn.DeviceType.CPU)


def _prefiltered(name: str, picture: Picture) -> Picture:
    """The features, denoised themselves (Open Image Denoise's documentation, "Denoising with Prefiltering")."""
    import mitsuba_oidn as oidn

    step, output = _device().new_filter("RT"), np.empty_like(picture)
    step.set_image(name, picture)
    step.set_image("output", output)
    step.quality = oidn.Quality.Fast  # as good a picture as High, in half of the time
    step.execute()
    return output


def _large_enough(picture: Picture) -> Picture:
    """The picture, mirrored at its right and lower sides until it has the least size."""
    height, width = (max(_LEAST - length, 0) for length in picture.shape[:2])
    return np.ascontiguousarray(np.pad(picture, ((0, height), (0, width), (0, 0)), mode="symmetric"))
