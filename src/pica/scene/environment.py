"""The light that comes from all around: a latitude-longitude picture of radiance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError


@dataclass(frozen=True, eq=False)
class Environment:
    """Radiance from every direction.

    The centre column looks towards +X, to its right +Z; the top row is +Y (as three.js):
    u = 0.5 + atan2(z, x) / (2 pi), v = acos(y) / pi.
    """

    radiance: NDArray[np.float32]
    """(height, width, 3) linear Rec. 709, nits."""
    strength: float = 1.0
    """Multiplies the radiance."""
    rotation: float = 0.0
    """Radians about +Y by which the surroundings are turned, from +Z towards +X."""
    name: str = ""

    def __post_init__(self) -> None:
        shape = self.radiance.shape
        if len(shape) != 3 or shape[2] != 3 or min(shape) < 1:
            raise SceneError(f"environment {self.name!r}: expected pixels (height, width, 3), got {shape}")
        if not (np.isfinite(self.radiance).all() and self.radiance.min() >= 0):
            raise SceneError(f"environment {self.name!r}: radiance must be finite and not negative")
