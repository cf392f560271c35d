"""The filters of ambient occlusion: a history in time, and a mean over neighbours in the picture."""

import slangpy as spy

from pica.filtering.accumulation import accumulate_grid
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.rhi.device import Device

_FOLDER = "effects/ambient_occlusion"
_HORIZON_RAYS = 8
"""Rays of which a mean is as exact as that of a pixel's horizons over 4x4 pixels."""


class _Mean:
    """The accumulated mean of the frames."""

    def __init__(self, device: Device, rays: int, smoothed: bool) -> None:
        self._rays, self._smoothed = rays, smoothed
        self._accumulate = device.compute(f"{_FOLDER}/occlusion_history.slang")

    def __call__(self, graph: FrameGraph, occlusion: Texture) -> tuple[Texture, Texture]:
        """The history, and the mean with this frame's `occlusion`, as occlusion_history.slang's `signal`."""
        history = graph.history("occlusion", {"mean": spy.Format.rgba16_float}, layers=1)
        signal = graph.texture("signal", spy.Format.rg16_float)
        graph.add(
            self._accumulate,
            accumulate_grid(graph.size),
            occlusion=occlusion,
            signal=write(signal),
            smoothed=int(self._smoothed),
            known=history.known,
            rayCount=float(self._rays),
            **history.swap(),
        )
        return history["mean"], signal


class RayFilter:
    """A temporal filter, then a spatial one whose width depends on the remaining variance."""

    def __init__(self, device: Device, rays: int, max_distance: float) -> None:
        self._max_distance = max_distance
        self._mean = _Mean(device, rays, smoothed=False)
        self._smooth = device.compute(f"{_FOLDER}/occlusion_filter.slang")

    def __call__(self, graph: FrameGraph, occlusion: Texture) -> tuple[Texture, Texture]:
        """The history, and (width, height, rg16_float) visibility and its variance."""
        history, signal = self._mean(graph, occlusion)
        filtered = graph.texture("filtered", spy.Format.rg16_float)
        graph.add(
            self._smooth,
            graph.grid,
            signal=signal,
            filtered=write(filtered),
            maxDistance=self._max_distance,
        )
        return history, filtered


class HorizonFilter:
    """Temporal only; horizons.slang has already averaged over 4x4 pixels (Jimenez et al. 2016, section 4.3)."""

    def __init__(self, device: Device) -> None:
        self._mean = _Mean(device, _HORIZON_RAYS, smoothed=True)

    def __call__(self, graph: FrameGraph, occlusion: Texture) -> tuple[Texture, Texture]:
        """The history, and (width, height, rg16_float) visibility and its variance."""
        return self._mean(graph, occlusion)
