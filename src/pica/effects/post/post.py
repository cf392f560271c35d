"""Exposure and tone mapping."""

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.rhi.device import Device
from pica.settings import PostSettings

_BINS = 128  # histogram.slang: binCount


class Post:
    """Scene radiance in, sRGB for the display out (width, height, rgba8_unorm)."""

    def __init__(self, device: Device, size: Size, settings: PostSettings) -> None:
        self._settings = settings
        self._bins = device.structured("histogram", np.zeros(_BINS, np.uint32))
        self._exposure = device.structured("exposure", np.ones(1, np.float32))
        self._display = device.texture("display", spy.Format.rgba8_unorm, size)
        self._histogram = device.compute("effects/post/histogram.slang")
        self._expose = device.compute("effects/post/exposure.slang")
        self._tone_map = device.compute("effects/post/tone_map.slang")

    def __call__(self, frame: FrameContext, radiance: spy.Texture) -> spy.Texture:
        """The picture to show."""
        size = spy.uint2(*frame.size)
        if self._settings.auto_exposure:
            self._histogram(frame, frame.grid, radiance=radiance, bins=self._bins, size=size)
        self._expose(
            frame,
            (1, 1, 1),
            bins=self._bins,
            exposure=self._exposure,
            stops=self._settings.exposure,
            automatic=int(self._settings.auto_exposure),
        )
        self._tone_map(frame, frame.grid, radiance=radiance, exposure=self._exposure, display=self._display, size=size)
        return self._display
