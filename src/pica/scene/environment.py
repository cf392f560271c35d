"""Light of the surroundings: a latitude-longitude picture of radiance."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError, shown
from pica.names import checked_names
from pica.scene.arrays import as_array, floats, picture
from pica.scene.checked_field import CheckedField, ReadOnlyCopies, check_again, described
from pica.scene.values import BRIGHTEST, UnfitError, checked, number, text

_STEPS, _FINE = 4, 16 * math.pi
"""Of a blur: how many in turns along both axes, as one would be no circle near the poles; and pi times the texels of
its width from which on half of the texels are enough."""
_RADIANCE = picture(floats("height", "width", 3, low=0))


def _radiance(values: Any) -> NDArray[np.float32]:
    kind = as_array(values, (), "fiu", "numbers").dtype
    if hasattr(values, "dtype") and kind.kind in "iu":
        hint = "give floats in nits; of a picture, pica.color.srgb_decode(picture / 255)"
        raise UnfitError(f"an array of {kind.name} is not radiance; {hint}")
    return _RADIANCE(values)


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Environment(ReadOnlyCopies):
    """Radiance from every direction.

    The centre column looks towards +X, to its right +Z; the top row is +Y (as three.js):
    u = 0.5 + atan2(z, x) / (2 pi), v = acos(y) / pi.
    Raises SceneError for other shapes, and for numbers that are not finite or negative.
    """

    radiance: CheckedField[NDArray[np.float32]] = CheckedField(_radiance)
    """(height, width, 3) linear Rec. 709, nits; floats, as integers look like a picture's pixels."""
    strength: CheckedField[float] = CheckedField(number(0), 1.0)
    """Multiplies the radiance."""
    rotation: CheckedField[float] = CheckedField(number(), 0.0)
    """Radians about +Y by which the surroundings are turned, from +Z towards +X."""
    name: CheckedField[str] = CheckedField(text, "")

    def __post_init__(self) -> None:
        if not float(self.radiance.max()) * self.strength <= BRIGHTEST:
            fault = f"{shown(self.strength)} times the radiance is more than {BRIGHTEST:g} nits"
            raise SceneError(f"{described(self)}: strength: {fault}")

    def blurred(self, angle: float) -> "Environment":
        """Another one, blurred by about a Gaussian with this standard deviation in radians, such as 0.1: for
        Scene.background. Raises SceneError for a negative angle."""
        angle = checked("blurred: angle", number(0), angle)
        radiance = self.radiance.astype(np.float64)
        while (
            min(radiance.shape[:2]) > 2 and not any(n % 2 for n in radiance.shape[:2]) and angle > _FINE / len(radiance)
        ):
            radiance = (radiance[::2] + radiance[1::2]) / 2
            radiance = (radiance[:, ::2] + radiance[:, 1::2]) / 2
        for _ in range(_STEPS):
            radiance = _smooth(radiance, angle / math.sqrt(_STEPS))
        return replace(self, radiance=np.maximum(radiance, 0).astype(np.float32))

    def check(self) -> None:
        """Raises SceneError if the radiance is invalid after writes into it."""
        check_again(self)
        self.__post_init__()


def _smooth(radiance: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Blur along circles of longitude, which go over both poles to the other side, and of latitude, which are shorter
    towards the poles."""
    height, width, _ = radiance.shape
    sines = np.sin((np.arange(height) + 0.5) / height * np.pi)
    # The Laplacian along longitudes is r'' + r' s' / s, and so that of r sqrt(s) over sqrt(s), where s is the sine.
    weight = np.sqrt(sines)[:, None, None]
    both = np.concatenate([radiance * weight, np.broadcast_to(weight, (height, width, 1))], axis=2)
    circles = np.concatenate([both, np.roll(both, width // 2, axis=1)[::-1]])
    both = _gaussian(circles, np.full(width, angle * height / np.pi), axis=0)[:height]
    return _gaussian(both[..., :3] / both[..., 3:], angle * width / (2 * np.pi) / sines, axis=1)


def _gaussian(values: NDArray[np.float64], widths: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Blur of periodic values (n, m, k) along an axis; a standard deviation, in samples, for each line."""
    count = values.shape[axis]
    turns = 2 * np.pi * np.fft.rfftfreq(count)
    kept = np.exp(-0.5 * np.square(np.multiply.outer(turns, widths)))
    kept = kept[..., None] if axis == 0 else kept.T[..., None]
    smooth: NDArray[np.float64] = np.fft.irfft(np.fft.rfft(values, axis=axis) * kept, n=count, axis=axis)
    return smooth
