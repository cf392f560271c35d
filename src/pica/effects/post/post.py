"""Exposure and tone mapping."""

from functools import cached_property

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.effect import Effect
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.settings import PostSettings

_BINS = 128  # histogram.slang: binCount


class Post(Effect):
    """Scene radiance in, sRGB for the display out (width, height, rgba8_unorm)."""

    name = "post"
    at_output = True

    def __init__(self, device: Device, size: Size, settings: PostSettings) -> None:
        self._device, self._settings = device, settings
        self._bins = device.structured("histogram", np.zeros(_BINS, np.uint32))
        self.exposure = device.structured("exposure", np.ones(1, np.float32))
        """The newest frame's factor from radiance to the display, one float."""
        self._display = device.texture("display", spy.Format.rgba8_unorm, size)
        self._histogram = device.compute("effects/post/histogram.slang")
        self._expose = device.compute("effects/post/exposure.slang")
        self._straight: spy.Texture | None = None
        self._tone_map = device.compute("effects/post/tone_map.slang")

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(self._display, *([self._straight] if self._straight else []))
        self._straight = None
        self._display = self._device.texture("display", spy.Format.rgba8_unorm, size)

    def __call__(
        self, frame: FrameContext, radiance: spy.Texture, alpha: spy.Texture | None = None, channel: int = 0
    ) -> spy.Texture:
        """The picture to show. `alpha`: that by which the radiance is premultiplied, in a channel of a texture."""
        size = spy.uint2(*frame.output_size)
        if alpha is not None:
            radiance = self._straightened(frame, radiance, alpha, channel)
        if self._settings.auto_exposure:
            self._histogram(frame, frame.output_grid, radiance=radiance, bins=self._bins, size=size)
        self._expose(
            frame,
            (1, 1, 1),
            bins=self._bins,
            exposure=self.exposure,
            stops=self._settings.exposure,
            automatic=int(self._settings.auto_exposure),
        )
        shown = {"exposure": self.exposure, "display": self._display}
        self._tone_map(frame, frame.output_grid, radiance=radiance, size=size, **shown)
        return self._display

    @cached_property
    def _straighten(self) -> ComputePass:
        return self._device.compute("effects/post/straighten.slang")

    def _straightened(self, frame: FrameContext, picture: spy.Texture, alpha: spy.Texture, channel: int) -> spy.Texture:
        """What is exposed and tone mapped is the radiance of what covers a pixel, however much of it."""
        if self._straight is None:
            self._straight = self._device.texture("straight", spy.Format.rgba32_float, frame.output_size)
        textures = {"picture": picture, "alpha": alpha, "straight": self._straight}
        self._straighten(frame, frame.output_grid, size=spy.uint2(*frame.output_size), channel=channel, **textures)
        return self._straight
