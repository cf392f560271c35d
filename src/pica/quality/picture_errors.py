"""All errors of a linear picture against a linear reference at once."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.color import luminance, srgb_encode
from pica.quality.metrics import Picture, check, flip, psnr, relative_mse


@dataclass(frozen=True)
class Errors:
    """How far one picture is from its reference."""

    flip: float
    """Mean LDR-FLIP, 0 to 1."""
    psnr: float
    """dB, of the exposed and sRGB encoded pictures."""
    relmse: float
    """Relative mean squared error, of the linear pictures."""
    exposure: float = field(repr=False)
    """The factor on both linear pictures before FLIP and PSNR."""
    flip_map: NDArray[np.float32] = field(repr=False, compare=False)
    """(height, width) FLIP of every pixel."""

    def numbers(self) -> dict[str, Any]:
        """The three errors by name, for JSON."""
        return {"flip": self.flip, "psnr": self.psnr, "relmse": self.relmse}


def compare(reference: Picture, test: Picture, exposure: float | None = None) -> Errors:
    """Errors of `test` against `reference`, both (height, width, 3) linear.

    FLIP and PSNR compare both as displayed: `exposed` with `exposure`, or `exposure_for(reference)` when
    None. Raises PicaError when sizes differ or values are not finite.
    """
    check(reference, test)
    chosen = exposure_for(reference) if exposure is None else exposure
    pair = exposed(reference, chosen), exposed(test, chosen)
    mean, error_map = flip(*pair)
    return Errors(mean, psnr(*pair), relative_mse(reference, test), chosen, error_map)


def exposed(picture: Picture, exposure: float) -> NDArray[np.float32]:
    """A linear picture as displayed, for FLIP and PSNR: times `exposure`, sRGB encoded, 0 to 1."""
    return srgb_encode(picture * exposure)


def exposure_for(reference: Picture) -> float:
    """The exposure at which the 90th percentile of the reference's luminance, black pixels left out, is 0.8.

    A percentile is robust against fireflies and small bright lamps, and without black pixels it is independent of
    the amount of empty background; about nine tenths of the rest stay unclipped.
    1 for a black picture.
    """
    brightness = luminance(reference)
    lit = brightness[brightness > 0]
    return 0.8 / float(np.percentile(lit, 90)) if lit.size else 1.0
