"""How far a picture is from its reference: FLIP, PSNR and relative mean squared error."""

from pica.quality.metrics import flip, psnr, relative_mse
from pica.quality.picture_errors import Errors, compare, exposed, exposure_for
from pica.quality.sheet import sheet

__all__ = ["Errors", "compare", "exposed", "exposure_for", "flip", "psnr", "relative_mse", "sheet"]
