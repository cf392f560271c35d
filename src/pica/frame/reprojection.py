"""Where each pixel was in the previous frame, found once a frame for all effects."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History
from pica.rhi.device import Device

_SETTLED = 16
"""Frames without a change after which histories are no longer tested: what they may have missed has come to light."""

_NEVER = 1e9


class Reprojection:
    """The block `reprojection` of frame/temporal.slang."""

    def __init__(self, device: Device, size: Size) -> None:
        self._history = History(device, "reprojection", {"found": spy.Format.r32_uint}, size)
        self._find_cut = device.compute("frame/cut.slang")
        self._find = device.compute("frame/reprojection.slang")
        self._cut = device.texture("cut", spy.Format.r32_uint, (1, 1))
        self.block = device.parameter_block("frame/temporal.slang", "reprojection")
        self.unchanged = 0
        """Frames since anything has changed."""

    @property
    def found(self) -> spy.Texture:
        """(width, height, r32_uint) the newest frame's words, as frame/previous_surface.slang has them."""
        return self._history.current["found"]

    def reset(self) -> None:
        """Drop the history: in the next frame nothing is found."""
        self._history.reset()

    def resize(self, size: Size) -> None:
        """Work at another size, without a history."""
        self._history.resize(size)

    def __call__(self, frame: FrameContext, gbuffer: GBuffer) -> "Reprojection":
        """Look for all that `gbuffer` shows."""
        textures = self._history.turn(frame)
        self.unchanged = 0 if frame.changed else self.unchanged + 1
        moved = frame.camera_moved and not self._history.empty
        if moved:
            self._find_cut(frame, (1, 1, 1), frame=frame, gbuffer=gbuffer, cut=self._cut)
        self._find(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            unknown=int(self._history.empty),
            cut=self._cut,
            moved=int(moved),
            unsettled=int(frame.changed_lights),
            **textures,
        )
        self.block.bind(
            found=textures["found"], unchanged=float(self.unchanged if self.unchanged < _SETTLED else _NEVER)
        )
        return self
