"""The filters of ambient occlusion: a history in time, and a mean over neighbours in the picture."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History, accumulate_grid
from pica.frame.reprojection import Reprojection
from pica.rhi.device import Device

_FOLDER = "effects/ambient_occlusion"
_HORIZONS_WORTH = 8
"""Rays that a pixel's horizons tell as much as, after their mean over 4x4 pixels."""


class _Mean:
    """The mean of the frames so far."""

    def __init__(self, device: Device, size: Size, rays: int, smoothed: bool) -> None:
        self._device = device
        self.history = History(device, "occlusion", {"mean": spy.Format.rgba16_float}, size, layers=1)
        self.signal = device.texture("occlusion signal", spy.Format.rg16_float, size)
        self._rays, self._smoothed = rays, smoothed
        self._accumulate = device.compute(f"{_FOLDER}/occlusion_history.slang")

    def give_back(self) -> None:
        """Nobody needs these textures any more."""
        self.history.give_back()
        self._device.give_back(self.signal)

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, occlusion: spy.Texture, reprojection: Reprojection
    ) -> spy.Texture:
        """The mean with this frame's `occlusion`, as occlusion_history.slang's `signal`."""
        textures = self.history.turn(frame)
        self._accumulate(
            frame,
            accumulate_grid(frame.size),
            frame=frame,
            gbuffer=gbuffer,
            reprojection=reprojection,
            occlusion=occlusion,
            signal=self.signal,
            smoothed=int(self._smoothed),
            known=int(not self.history.empty),
            rayCount=float(self._rays),
            **textures,
        )
        return self.signal


class RayFilter:
    """First in time, then in the picture, as wide as what the history does not know yet asks for."""

    def __init__(self, device: Device, size: Size, rays: int, max_distance: float) -> None:
        self._device, self._max_distance = device, max_distance
        self._mean = _Mean(device, size, rays, smoothed=False)
        self._filtered = device.texture("filtered occlusion", spy.Format.rg16_float, size)
        self._smooth = device.compute(f"{_FOLDER}/occlusion_filter.slang")

    def reset(self) -> None:
        """Drop the history."""
        self._mean.history.reset()

    def give_back(self) -> None:
        """Nobody needs these textures any more."""
        self._mean.give_back()
        self._device.give_back(self._filtered)

    def debug_textures(self) -> dict[str, spy.Texture]:
        """What views.py shows."""
        return {"history": self._mean.history.current["mean"], "filtered": self._filtered}

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, occlusion: spy.Texture, reprojection: Reprojection
    ) -> spy.Texture:
        """(width, height, rg16_float): the open share and its variance."""
        signal = self._mean(frame, gbuffer, occlusion, reprojection)
        self._smooth(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            signal=signal,
            filtered=self._filtered,
            maxDistance=self._max_distance,
        )
        return self._filtered


class HorizonFilter:
    """In time; horizons.slang has already taken the mean over 4x4 pixels (Jimenez et al. 2016, section 4.3)."""

    def __init__(self, device: Device, size: Size) -> None:
        self._mean = _Mean(device, size, _HORIZONS_WORTH, smoothed=True)

    def reset(self) -> None:
        """Drop the history."""
        self._mean.history.reset()

    def give_back(self) -> None:
        """Nobody needs these textures any more."""
        self._mean.give_back()

    def debug_textures(self) -> dict[str, spy.Texture]:
        """What views.py shows."""
        return {"history": self._mean.history.current["mean"], "filtered": self._mean.signal}

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, occlusion: spy.Texture, reprojection: Reprojection
    ) -> spy.Texture:
        """(width, height, rg16_float): the open share and its variance."""
        return self._mean(frame, gbuffer, occlusion, reprojection)
