"""The three errors, each of one picture against a reference. Arrays are (height, width, 3)."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError

Picture = NDArray[np.floating[Any]]


def flip(reference: Picture, test: Picture) -> tuple[float, NDArray[np.float32]]:
    """The mean of LDR-FLIP, 0 (same) to 1, and its map (height, width).

    Both pictures are sRGB values, 0 to 1, viewed at FLIP's usual 67 pixels per degree
    (Andersson et al., FLIP: A Difference Evaluator for Alternating Images, HPG 2020).
    """
    import flip_evaluator

    check(reference, test)
    first, second = (np.ascontiguousarray(np.clip(picture, 0, 1), np.float32) for picture in (reference, test))
    error, mean, _ = flip_evaluator.evaluate(first, second, "LDR", inputsRGB=True, applyMagma=False)
    return float(mean), error[..., 0]


def psnr(reference: Picture, test: Picture) -> float:
    """Peak signal to noise ratio in dB of pictures from 0 to 1; equal pictures have 120 dB.

    10 log10(1 / mean squared error), the error being at least 1e-12 so that it stays a number.
    """
    check(reference, test)
    error = float(np.mean((reference.astype(np.float64) - test) ** 2))
    return -10.0 * math.log10(max(error, 1e-12))


def relative_mse(reference: Picture, test: Picture) -> float:
    """Mean of the squared error over the squared reference plus 0.01, of linear pictures.

    Rousselle et al., Adaptive Sampling and Reconstruction using Greedy Error Minimization, 2011, section 5.
    """
    check(reference, test)
    expected = reference.astype(np.float64)
    return float(np.mean((test - expected) ** 2 / (expected**2 + 0.01)))


def check(reference: Picture, test: Picture) -> None:
    """Raise PicaError unless both are finite colour pictures of one size."""
    if reference.shape != test.shape or reference.ndim != 3 or reference.shape[2] != 3:
        raise PicaError(
            f"cannot compare pictures of shapes {reference.shape} and {test.shape}: both must be (height, width, 3)"
        )
    for name, picture in (("reference", reference), ("test", test)):
        bad = picture.size - int(np.isfinite(picture).sum())
        if bad:
            raise PicaError(f"cannot compare: {bad} values of the {name} picture are not finite")
