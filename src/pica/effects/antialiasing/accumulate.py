"""Accumulation: the mean of all frames in which nothing moved."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.rhi.device import Device


class Accumulation:
    """The mean picture since the camera or the scene moved (width, height, rgba32_float)."""

    def __init__(self, device: Device, size: Size) -> None:
        self._history = device.texture("accumulated", spy.Format.rgba32_float, size)
        self._accumulate = device.compute("effects/antialiasing/accumulate.slang")
        self._count = 0

    def reset(self) -> None:
        """Drop the history."""
        self._count = 0

    def __call__(self, frame: FrameContext, radiance: spy.Texture, moved: bool) -> spy.Texture:
        """Add this frame; `moved` starts the mean anew."""
        self._count = 0 if moved else self._count
        self._accumulate(frame, frame.grid, frame=frame, radiance=radiance, history=self._history, count=self._count)
        self._count += 1
        return self._history
