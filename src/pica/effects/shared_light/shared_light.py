"""Light of the slots that many sources share, from one noisy sample a pixel and frame."""

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.scene import GpuScene
from pica.rhi.device import Device

_FOLDER = "effects/shared_light"
_PARTS = 2
"""reflected_parts.slang: PARTS."""
_STEPS = (1, 2, 4, 8, 16)
"""Pixels between the taps of the filter's passes."""
_STILL = 256.0
"""Samples that the history holds while nothing moves."""
_MOVING = 16.0
"""And while something does."""
_CLAMP_WIDTH = 2.0
"""Standard errors of a frame's 5x5 mean by which the history may differ while something moves."""
_HANDED_OVER = (8, 40)
"""Frames after the last motion between which the picture turns from the filtered light to that of single frames, whose
mean `Accumulation` then makes: it is noisier than the filter's and has none of its errors."""


class SharedLight:
    """Filters noisy light: a history in time, then an a-trous filter as wide as its variance asks for."""

    def __init__(self, device: Device, size: Size) -> None:
        def make(label: str, texture_format: spy.Format) -> spy.Texture:
            return device.texture(label, texture_format, size, layers=_PARTS)

        color = spy.Format.rgba32_float  # radiance in nits leaves the range of half precision
        self.samples = make("noisy light", color)
        """(width, height, 2, rgba32_float) what the next call filters: reflected light over albedo, diffuse and
        specular; alpha 1, or 0 where nothing is reflected."""
        self._history = [make("shared light", color) for _ in range(2)]
        self._moments = [make("shared light moments", spy.Format.rg32_float) for _ in range(2)]
        self._filtered = [make("filtered light", color) for _ in range(2)]
        self._deviation = [make("shared light deviation", spy.Format.r32_float) for _ in range(2)]
        self._accumulate = device.compute(f"{_FOLDER}/shared_light_history.slang")
        # A pass whose parameters differ from dispatch to dispatch would be bound anew each time.
        self._passes = [device.compute(f"{_FOLDER}/shared_light_filter.slang") for _ in _STEPS]
        self._add = device.compute(f"{_FOLDER}/shared_light_add.slang")
        self._empty = True
        self._still = 0

    def reset(self) -> None:
        """Drop the history."""
        self._empty = True
        self._still = 0

    def debug_views(self) -> dict[str, spy.Texture]:
        """What the newest frame left behind, by name: see views.py; "filtered" of the newest that needed it."""
        last = len(_STEPS) % 2
        return {
            "samples": self.samples,
            "filtered": self._filtered[last],
            "moments": self._moments[0],
            "deviation": self._deviation[last],
        }

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, scene: GpuScene, radiance: spy.Texture, moved: bool
    ) -> None:
        """Add the filtered `samples` to `radiance`. `moved`: something differs from the frame before."""
        self._history.reverse()
        self._moments.reverse()
        self._accumulate(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            samples=self.samples,
            previousHistory=self._history[1],
            previousMoments=self._moments[1],
            history=self._history[0],
            moments=self._moments[0],
            signal=self._filtered[0],
            deviation=self._deviation[0],
            remembered=1.0 if self._empty else (_MOVING if moved else _STILL),
            clampWidth=_CLAMP_WIDTH if moved else 0.0,
        )
        self._empty = False
        self._still = 0 if moved else self._still + 1
        first, last = _HANDED_OVER
        unfiltered = min(max((self._still - first) / (last - first), 0.0), 1.0)
        if unfiltered < 1:
            self._smooth(frame, gbuffer, scene)
        self._add(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            filtered=self._filtered[len(_STEPS) % 2],
            samples=self.samples,
            unfiltered=unfiltered,
            radiance=radiance,
        )

    def _smooth(self, frame: FrameContext, gbuffer: GBuffer, scene: GpuScene) -> None:
        for number, (step, smooth) in enumerate(zip(_STEPS, self._passes, strict=True)):
            source, target = number % 2, 1 - number % 2
            smooth(
                frame,
                frame.grid,
                frame=frame,
                gbuffer=gbuffer,
                scene=scene,
                signal=self._filtered[source],
                deviation=self._deviation[source],
                filtered=self._filtered[target],
                filteredDeviation=self._deviation[target],
                step=step,
            )
