"""Temporal antialiasing and upscaling: jittered frames of the render size make one picture of the output size."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.effect import Effect
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History
from pica.rhi.device import Device
from pica.settings import AntialiasingSettings

_FOLDER = "effects/antialiasing"


class Antialiasing(Effect):
    """The picture since the first frame (width, height, rgba32_float): the plain mean where nothing changes, a history
    that follows the motion elsewhere (RTG 25, 25.1, last step)."""

    name = "antialiasing"
    at_output = True

    def __init__(self, device: Device, size: Size, settings: AntialiasingSettings) -> None:
        """`size`: of the output."""
        self._device, self._settings = device, settings
        self._history = History(
            device, "antialiasing", {"picture": spy.Format.rgba32_float, "deviation": spy.Format.rgba16_float}, size
        )
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)
        self._resolve = device.compute(f"{_FOLDER}/temporal_resolve.slang")
        if settings.sharpness > 0:
            self._sharpen = device.compute(f"{_FOLDER}/sharpen.slang")
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        self._moving = self._device.texture("moving picture", spy.Format.rgba16_float, size)
        self._sharpened: spy.Texture | None = None
        if self._settings.sharpness > 0:
            self._sharpened = self._device.texture("sharpened", spy.Format.rgba32_float, size)

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._history.resize(size)
        self._device.give_back(*(texture for texture in (self._moving, self._sharpened) if texture))
        self._allocate(size)

    def reset(self) -> None:
        """Drop the history."""
        self._history.reset()

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, radiance: spy.Texture, exposure: spy.Buffer
    ) -> spy.Texture:
        """The picture with this frame's `radiance`. `exposure`: of the frame before (Post.exposure)."""
        if frame.changed and self._settings.mode == "accumulate":
            self._history.reset()
        textures = self._history.turn(frame)
        self._resolve(
            frame,
            frame.output_grid,
            frame=frame,
            gbuffer=gbuffer,
            radiance=radiance,
            exposure=exposure,
            linearSampler=self._linear,
            movingPicture=self._moving,
            known=int(not self._history.empty),
            changed=int(frame.changed),
            **textures,
        )
        picture = textures["picture"]
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
