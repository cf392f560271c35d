"""What single effects should give, by many rays a pixel from the very G-buffer that the effect saw."""

from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.context import Size
from pica.rhi.device import Device
from pica.tracing.hit_groups import HitDetail
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_SAMPLES_PER_RUN = 256
"""No single dispatch may take so long that a driver stops it."""


class CountedShare:
    """The share of a pixel's rays that arrive: a ray effect that counts both (width, height, rg32)."""

    def __init__(
        self, device: Device, size: Size, module: str, effect: str, detail: HitDetail, tracer: Tracer | None
    ) -> None:
        self._device, self._size = device, size
        self._counted = device.texture("counted rays", spy.Format.rg32_float, size)
        self._trace = ray_effect(device, module, effect, detail, tracer)

    def __call__(self, samples: int, **inputs: Any) -> NDArray[np.float32]:
        """(height, width) from `samples` rays a pixel, NaN where a pixel has none. Waits for the device."""
        for taken in range(0, samples, _SAMPLES_PER_RUN):
            with self._device.record() as recording:
                count = min(_SAMPLES_PER_RUN, samples - taken)
                self._trace(recording, self._size, counted=self._counted, taken=taken, samples=count, **inputs)
        counted = np.asarray(self._counted.to_numpy())
        rays, misses = counted[..., 0], counted[..., 1]
        return np.where(rays > 0, misses / np.maximum(rays, 1e-9), np.nan).astype(np.float32)
