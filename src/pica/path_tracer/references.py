"""Ground truth of single effects, by many rays a pixel from the effect's own G-buffer."""

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
"""A long dispatch would trigger the driver's timeout."""


class ManySamples:
    """Accumulates a ray effect over many rays a pixel, in a texture that is cleared at `firstSample` 0."""

    def __init__(
        self,
        device: Device,
        size: Size,
        module: str,
        effect: str,
        detail: HitDetail,
        tracer: Tracer | None,
        is_light: bool = False,
    ) -> None:
        """`is_light`: it sums radiance and samples (`sums`, width, height, rgba32); otherwise it counts rays and
        unoccluded ones (`sums`, rg32)."""
        self._device, self._size, self._is_light = device, size, is_light
        texture_format = spy.Format.rgba32_float if is_light else spy.Format.rg32_float
        self._sums = device.texture("sums of many samples", texture_format, size)
        self._trace = ray_effect(device, module, effect, detail, tracer)

    def __call__(self, samples: int, **inputs: Any) -> NDArray[np.float32]:
        """Visibility (height, width), or mean radiance (height, width, 3), of `samples` rays a pixel; NaN
        for pixels without rays. Waits for the device."""
        for first in range(0, samples, _SAMPLES_PER_RUN):
            with self._device.record() as recording:
                count = min(_SAMPLES_PER_RUN, samples - first)
                self._trace(recording, self._size, firstSample=first, samples=count, sums=self._sums, **inputs)
        sums = np.asarray(self._sums.to_numpy())
        arrived, rays = (sums[..., :3], sums[..., 3:]) if self._is_light else (sums[..., 1], sums[..., 0])
        return np.where(rays > 0, arrived / np.maximum(rays, 1e-9), np.nan).astype(np.float32)
