"""The share of each pixel that surfaces cover: alpha, where the background is transparent."""

import numpy as np
import slangpy as spy

from pica.effects.antialiasing.temporal_resolve import TemporalResolve
from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.rhi.device import Device


class Coverage:
    """Alpha, antialiased as the picture is: by the same samples and the same kind of history (Porter and Duff 1984,
    "Compositing Digital Images", section 3)."""

    def __init__(self, device: Device, size: Size) -> None:
        """`size`: of the output."""
        self._device = device
        self.resolve = TemporalResolve(device, "coverage", size)
        self._mask = device.compute("effects/antialiasing/mask_background.slang")
        self._one = device.structured("one", np.ones(1, np.float32))
        self._covered: spy.Texture | None = None

    def resize(self, size: Size) -> None:
        """Work at another size of the output; drops the history."""
        self.resolve.resize(size)
        if self._covered is not None:
            self._device.give_back(self._covered)
            self._covered = None

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, radiance: spy.Texture) -> spy.Texture:
        """Alpha in each of r, g and b (output size). Takes the surroundings out of this frame's `radiance`."""
        if self._covered is None:
            self._covered = self._device.texture("covered", spy.Format.rgba16_float, frame.size)
        self._mask(frame, frame.grid, frame=frame, gbuffer=gbuffer, radiance=radiance, covered=self._covered)
        return self.resolve(frame, gbuffer, self._covered, self._one)
