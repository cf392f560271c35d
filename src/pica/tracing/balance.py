"""How many rays each of several devices traces."""

import numpy as np
from numpy.typing import NDArray

TRIAL = 12
"""Frames after which it is decided whether several devices are faster than the first alone."""
_SETTLING = 4
"""Frames before, in which shares are far from what they become."""
_LEAST = 1 / 64
"""Share of a device: enough to time it."""


class Balance:
    """The devices' shares of rays, in proportion to how fast each was in the frame before, copies included."""

    def __init__(self, devices: int) -> None:
        self.shares = np.full(devices, 1 / devices)
        self._frames = 0
        self._together = self._alone = 0.0
        """Seconds that rays have taken, and that the first device would have taken."""
        self._begin()

    def _begin(self) -> None:
        self._rays, self._seconds, self._elapsed = np.zeros(len(self.shares)), np.zeros(len(self.shares)), 0.0

    def split(self, count: int) -> list[int]:
        """How many of so many rays each device traces."""
        ends = np.rint(count * np.cumsum(self.shares)).astype(int)
        return [int(each) for each in np.diff(ends, prepend=0)]

    def note(self, rays: NDArray[np.float64], seconds: NDArray[np.float64], elapsed: float) -> None:
        """Each device has traced so many rays in so many seconds, (devices,); `elapsed`: until the last was done."""
        self._rays += rays
        self._seconds += seconds
        self._elapsed += elapsed

    def end_frame(self) -> None:
        """Change the shares for the next frame, unless a device had no rays."""
        if self._rays.all() and self._seconds.all():
            rates = self._rays / self._seconds
            self._frames += 1
            if self._frames > _SETTLING:
                self._together += self._elapsed
                self._alone += float(self._rays.sum() / rates[0])
            shares = np.maximum(rates / rates.sum(), _LEAST)
            self.shares = shares / shares.sum()
        self._begin()

    @property
    def pays(self) -> bool:
        """Whether several devices trace the rays faster than the first alone; true until `TRIAL` frames have shown."""
        return self._frames < TRIAL or self._together < self._alone
