"""The filter of ray traced occlusion: a history in time, then a wavelet in the picture."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.rhi.device import Device

_FOLDER = "effects/ambient_occlusion"
_STEPS = (1, 2, 4)
"""Pixels between the taps of each spatial pass."""
_STILL = 256.0
"""Frames that the history holds while nothing moves."""
_MOVING = 32.0
"""And while something does."""
_CLAMP_WIDTH = 2.0
"""Standard errors of a frame's 5x5 mean by which the history may differ while something moves."""


class OcclusionHistory:
    """The mean of the frames so far."""

    def __init__(self, device: Device, size: Size) -> None:
        self._history = [device.texture("occlusion history", spy.Format.rg16_float, size) for _ in range(2)]
        self._signal = device.texture("occlusion signal", spy.Format.rg16_float, size)
        self._accumulate = device.compute(f"{_FOLDER}/occlusion_history.slang")
        self._empty = True

    def reset(self) -> None:
        """Drop the history."""
        self._empty = True

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, occlusion: spy.Texture, rays: int, moved: bool
    ) -> spy.Texture:
        """(width, height, rg16_float): the mean with this frame's `occlusion`, and its standard error."""
        remembered = _MOVING if moved else _STILL
        self._history.reverse()
        self._accumulate(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            occlusion=occlusion,
            previousHistory=self._history[1],
            history=self._history[0],
            signal=self._signal,
            remembered=1.0 if self._empty else remembered,
            clampWidth=_CLAMP_WIDTH if moved else 0.0,
            rayCount=float(rays),
        )
        self._empty = False
        return self._signal


class OcclusionFilter:
    """Smooths each surface, as wide as the standard error asks for."""

    def __init__(self, device: Device, size: Size) -> None:
        self._filtered = [device.texture("filtered occlusion", spy.Format.rg16_float, size) for _ in range(2)]
        # A pass whose parameters differ from dispatch to dispatch would be bound anew each time.
        self._passes = [device.compute(f"{_FOLDER}/occlusion_filter.slang") for _ in _STEPS]

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, signal: spy.Texture) -> spy.Texture:
        """(width, height, rg16_float): the filtered `signal` of OcclusionHistory."""
        for number, step in enumerate(_STEPS):
            target = self._filtered[number % 2]
            self._passes[number](
                frame, frame.grid, frame=frame, gbuffer=gbuffer, signal=signal, filtered=target, step=step
            )
            signal = target
        return signal
