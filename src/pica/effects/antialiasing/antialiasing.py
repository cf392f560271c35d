"""Temporal antialiasing and upscaling: jittered frames of the render size make one picture of the output size."""

import slangpy as spy

from pica.effects.antialiasing.coverage import Coverage
from pica.effects.antialiasing.temporal_resolve import TemporalResolve
from pica.frame.aovs import alpha_aov
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect
from pica.frame.gbuffer import GBuffer
from pica.rhi.device import Device
from pica.settings import AntialiasingSettings


class Antialiasing(Effect):
    """The picture since the first frame (width, height, rgba32_float): the plain mean where nothing changes, a history
    that follows the motion elsewhere (RTG 25, 25.1, last step). Alpha likewise, where the background is transparent."""

    name = "antialiasing"
    at_output = True

    def __init__(self, device: Device, size: Size, settings: AntialiasingSettings, transparent: bool = False) -> None:
        """`size`: of the output. `transparent`: pictures have alpha, by which they are premultiplied."""
        self._device, self._settings = device, settings
        self._resolve = TemporalResolve(device, "antialiasing", size)
        self._coverage = Coverage(device, size) if transparent else None
        self.aov_names = ("alpha",) if transparent else ()
        self.alpha: spy.Texture | None = None
        """Of the newest frame (width, height), in r; None where the background is not transparent."""
        if settings.sharpness > 0:
            self._sharpen = device.compute("effects/antialiasing/sharpen.slang")
        self._sharpened = self._room_to_sharpen(size)

    def _room_to_sharpen(self, size: Size) -> spy.Texture | None:
        sharpens = self._settings.sharpness > 0
        return self._device.texture("sharpened", spy.Format.rgba32_float, size) if sharpens else None

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._resolve.resize(size)
        if self._coverage is not None:
            self._coverage.resize(size)
        if self._sharpened is not None:
            self._device.give_back(self._sharpened)
            self._sharpened = self._room_to_sharpen(size)

    def reset(self) -> None:
        """Drop the history."""
        self._resolve.history.reset()
        if self._coverage is not None:
            self._coverage.resolve.history.reset()

    def aovs(self) -> dict[str, Aov]:
        """alpha: (height, width) the share of each pixel that surfaces cover, where the background is transparent."""
        return {} if self.alpha is None else {"alpha": alpha_aov(self.alpha, 0)}

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, radiance: spy.Texture, exposure: spy.Buffer
    ) -> spy.Texture:
        """The picture with this frame's `radiance`. `exposure`: of the frame before (Post.exposure)."""
        if frame.changed and self._settings.mode == "accumulate":
            self.reset()
        if self._coverage is not None:
            self.alpha = self._coverage(frame, gbuffer, radiance)
        picture = self._resolve(frame, gbuffer, radiance, exposure)
        if self._sharpened is None:
            return picture
        self._sharpen(
            frame,
            frame.output_grid,
            frame=frame,
            picture=picture,
            exposure=exposure,
            sharpened=self._sharpened,
            sharpness=self._settings.sharpness,
        )
        return self._sharpened
