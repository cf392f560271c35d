"""The filters of ambient occlusion: a history in time, and a mean over neighbours in the picture."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.rhi.device import Device

_FOLDER = "effects/ambient_occlusion"
_STILL = 256.0
"""Frames that the history holds while nothing moves."""
_MOVING = 32.0
"""And while something does."""
_CHANGE_WIDTH = 2.0
"""Standard errors of the 5x5 neighbours' change from which on it counts while something moves."""
_HORIZONS_WORTH = 8
"""Rays that a pixel's horizons tell as much as, after their mean over 4x4 pixels."""


class _History:
    """The mean of the frames so far."""

    def __init__(self, device: Device, size: Size, rays: int, smoothed: bool) -> None:
        self.means = [device.texture("occlusion history", spy.Format.rg16_float, size) for _ in range(2)]
        self.signal = device.texture("occlusion signal", spy.Format.rg16_float, size)
        self._rays, self._smoothed = rays, smoothed
        self._accumulate = device.compute(f"{_FOLDER}/occlusion_history.slang")
        self.empty = True

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, occlusion: spy.Texture, moved: bool) -> spy.Texture:
        """The mean with this frame's `occlusion`, as occlusion_history.slang's `signal`."""
        self.means.reverse()
        self._accumulate(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            occlusion=occlusion,
            previousHistory=self.means[1],
            history=self.means[0],
            signal=self.signal,
            smoothed=int(self._smoothed),
            remembered=1.0 if self.empty else (_MOVING if moved else _STILL),
            changeWidth=_CHANGE_WIDTH if moved else 0.0,
            rayCount=float(self._rays),
        )
        self.empty = False
        return self.signal


class RayFilter:
    """First in time, then in the picture, as wide as what the history does not know yet asks for."""

    def __init__(self, device: Device, size: Size, rays: int, max_distance: float) -> None:
        self._max_distance = max_distance
        self._history = _History(device, size, rays, smoothed=False)
        self._filtered = device.texture("filtered occlusion", spy.Format.rg16_float, size)
        self._smooth = device.compute(f"{_FOLDER}/occlusion_filter.slang")

    def reset(self) -> None:
        """Drop the history."""
        self._history.empty = True

    def debug_views(self) -> dict[str, spy.Texture]:
        """See views.py."""
        return {"history": self._history.means[0], "filtered": self._filtered}

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, occlusion: spy.Texture, moved: bool) -> spy.Texture:
        """(width, height, rg16_float): the open share and its variance."""
        signal = self._history(frame, gbuffer, occlusion, moved)
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
    """First in the picture, over 4x4 pixels, then in time (Jimenez et al. 2016, section 4.3)."""

    def __init__(self, device: Device, size: Size) -> None:
        self._history = _History(device, size, _HORIZONS_WORTH, smoothed=True)

    def reset(self) -> None:
        """Drop the history."""
        self._history.empty = True

    def debug_views(self) -> dict[str, spy.Texture]:
        """See views.py."""
        return {"history": self._history.means[0], "filtered": self._history.signal}

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, occlusion: spy.Texture, moved: bool) -> spy.Texture:
        """(width, height, rg16_float): the open share and its variance."""
        return self._history(frame, gbuffer, occlusion, moved)
