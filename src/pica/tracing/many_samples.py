"""Sums of a ray effect over many rays per pixel, for references."""

from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.graph.resources import Size
from pica.rhi.device import Device
from pica.tracing.hit_groups import HitDetail
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect

_SAMPLES_PER_RUN = 256
"""A longer dispatch could run into a driver's time limit."""


class ManySamples:
    """Estimate of a quantity per pixel by a ray effect that adds its samples to a texture `sums`, which begins again
    with `firstSample` 0."""

    def __init__(
        self,
        device: Device,
        module: str,
        effect: str,
        detail: HitDetail,
        tracer: Tracer | None,
        is_light: bool = False,
    ) -> None:
        """Nothing is compiled before the first call.

        `is_light`: the effect sums light, and samples in alpha (`sums`, rgba32); else it sums weights of rays, and of
        those that arrive (`sums`, rg32).
        """
        self.is_light = is_light
        self._device, self._source = device, (module, effect, detail, tracer)
        self._trace: RayEffect | None = None
        self._sums: spy.Texture | None = None

    def __call__(self, size: Size, samples: int, **inputs: Any) -> NDArray[np.float32]:
        """The fraction that arrives (height, width), or the mean light (height, width, 3), of `samples` rays per pixel;
        NaN where a pixel has none. Waits for the device."""
        self._trace = self._trace or ray_effect(self._device, *self._source)
        texture = self._texture(size)
        for first in range(0, samples, _SAMPLES_PER_RUN):
            with self._device.record() as recording:
                count = min(_SAMPLES_PER_RUN, samples - first)
                self._trace(recording, size, firstSample=first, samples=count, sums=texture, **inputs)
        sums = np.asarray(texture.to_numpy())
        arrived, rays = (sums[..., :3], sums[..., 3:]) if self.is_light else (sums[..., 1], sums[..., 0])
        return np.where(rays > 0, arrived / np.maximum(rays, 1e-9), np.nan).astype(np.float32)

    def _texture(self, size: Size) -> spy.Texture:
        if self._sums is None or (self._sums.width, self._sums.height) != size:
            texture_format = spy.Format.rgba32_float if self.is_light else spy.Format.rg32_float
            self._sums = self._device.texture("sums of many samples", texture_format, size)
        return self._sums
