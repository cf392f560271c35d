"""Pictures without a background: the surroundings are taken out, and alpha says how much of a pixel surfaces cover."""

from typing import Any

import numpy as np
import slangpy as spy

from pica.effects.antialiasing.antialiasing import Antialiasing
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect
from pica.frame.gbuffer import GBuffer
from pica.rhi.device import Device
from pica.settings import AntialiasingSettings

_FOLDER = "effects/antialiasing"


class Coverage(Effect):
    """Alpha, antialiased as the picture is: by the same samples and the same kind of history (Porter and Duff 1984,
    "Compositing Digital Images", section 3)."""

    name = "coverage"
    at_output = True

    def __init__(self, device: Device, size: Size, settings: AntialiasingSettings) -> None:
        """`size`: of the output."""
        self._device = device
        self._mask = device.compute(f"{_FOLDER}/mask_background.slang")
        self._antialiasing = Antialiasing(device, size, settings)
        self._one = device.structured("one", np.ones(1, np.float32))
        self._straight = StraightRadiance(device, size)
        self._covered: spy.Texture | None = None
        self._alpha: spy.Texture | None = None

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._antialiasing.resize(size)
        self._straight.resize(size)
        self._give_back()

    def reset(self) -> None:
        """Drop the history."""
        self._antialiasing.reset()

    def aovs(self) -> dict[str, Aov]:
        """alpha: (height, width) the share of each pixel that surfaces cover, 0 to 1."""
        return {} if self._alpha is None else {"alpha": alpha_aov(self._alpha, 0)}

    def mask(self, frame: FrameContext, gbuffer: GBuffer, radiance: spy.Texture) -> None:
        """Take the surroundings out of this frame's radiance (render size), before it is antialiased."""
        if self._covered is None or (self._covered.width, self._covered.height) != frame.size:
            self._give_back()
            self._covered = self._device.texture("covered", spy.Format.rgba16_float, frame.size)
        self._mask(frame, frame.grid, frame=frame, gbuffer=gbuffer, radiance=radiance, covered=self._covered)

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, picture: spy.Texture) -> spy.Texture:
        """The picture to be displayed, of what `picture` has premultiplied by alpha."""
        assert self._covered is not None  # after mask
        self._alpha = self._antialiasing(frame, gbuffer, self._covered, self._one)
        return self._straight(frame, picture, self._alpha, 0)

    def _give_back(self) -> None:
        if self._covered is not None:
            self._device.give_back(self._covered)
            self._covered = None


class StraightRadiance:
    """Divides a picture by its alpha, for what is not to be premultiplied: exposure, tone mapping, PNG."""

    def __init__(self, device: Device, size: Size) -> None:
        self._device = device
        self._pass = device.compute(f"{_FOLDER}/straighten.slang")
        self.resize(size)

    def resize(self, size: Size) -> None:
        """Pictures of another size from now on."""
        self._texture = self._device.texture("straight", spy.Format.rgba32_float, size)

    def __call__(self, frame: FrameContext, picture: spy.Texture, alpha: spy.Texture, channel: int) -> spy.Texture:
        """`channel`: that of the texture `alpha` which has it."""
        size = spy.uint2(*frame.output_size)
        textures: dict[str, Any] = {"picture": picture, "alpha": alpha, "straight": self._texture}
        self._pass(frame, frame.output_grid, size=size, channel=channel, **textures)
        return self._texture


def alpha_aov(texture: spy.Texture, channel: int) -> Aov:
    """The AOV "alpha" of a texture that has it in a channel."""
    return Aov((texture,), lambda values: np.clip(values[..., channel], 0, 1))
