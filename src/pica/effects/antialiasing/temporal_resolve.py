"""One picture of many jittered frames."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History
from pica.rhi.device import Device


class TemporalResolve:
    """The mean of all samples where nothing changes, a history that follows the motion elsewhere."""

    def __init__(self, device: Device, name: str, size: Size) -> None:
        """`size`: of the output."""
        self._device = device
        self.history = History(
            device, name, {"picture": spy.Format.rgba32_float, "deviation": spy.Format.rgba16_float}, size
        )
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)
        self._pass = device.compute("effects/antialiasing/temporal_resolve.slang")
        self._moving = self._make(size)

    def _make(self, size: Size) -> spy.Texture:
        return self._device.texture("moving picture", spy.Format.rgba16_float, size)

    def resize(self, size: Size) -> None:
        """Work at another size of the output; drops the history."""
        self.history.resize(size)
        self._device.give_back(self._moving)
        self._moving = self._make(size)

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, samples: spy.Texture, exposure: spy.Buffer
    ) -> spy.Texture:
        """The picture with this frame's `samples` (render size). `exposure`: of the frame before."""
        textures = self.history.turn(frame)
        self._pass(
            frame,
            frame.output_grid,
            frame=frame,
            gbuffer=gbuffer,
            radiance=samples,
            exposure=exposure,
            linearSampler=self._linear,
            movingPicture=self._moving,
            known=int(not self.history.empty),
            changed=int(frame.changed),
            **textures,
        )
        return textures["picture"]
