"""Light of the surroundings: a latitude-longitude picture of radiance."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError, shown
from pica.names import checked_names
from pica.scene.arrays import floats, picture
from pica.scene.checked_field import CheckedField, ReadOnlyCopies, check_again, described
from pica.scene.values import BRIGHTEST, UnfitError, number, text

_RADIANCE = picture(floats("height", "width", 3, low=0))


def _radiance(values: Any) -> NDArray[np.float32]:
    kind = getattr(values, "dtype", None)
    if kind is not None and kind.kind in "iu":
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

    def check(self) -> None:
        """Raises SceneError if the radiance is invalid after writes into it."""
        check_again(self)
        self.__post_init__()
