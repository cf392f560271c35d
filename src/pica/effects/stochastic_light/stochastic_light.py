"""Light of slots shared by many sources, from one noisy sample a pixel and frame."""

import numpy as np
import slangpy as spy

from pica.effects.stochastic_light.debug_aovs import offer_stochastic_light_aovs
from pica.filtering.accumulation import accumulate_grid
from pica.filtering.convergence import COMPLETE_FROM, NOISY_PICTURE, QUIET_FROM, UNFILTERED_FROM
from pica.filtering.reprojection import Reprojection
from pica.frame.context import FrameContext
from pica.frame.effect import Effect
from pica.frame.signals.light import BOTH_PARTS, NoisyLight
from pica.graph.graph import FrameGraph
from pica.graph.resources import History, Texture, update, write
from pica.programs.library import programs
from pica.rhi.device import Device

_FOLDER = "effects/stochastic_light"
_LIGHT = spy.Format.rgba32_float  # radiance in nits leaves the range of half precision
_PARTS = 2
"""demodulation.slang: PARTS."""
_STEPS = (1, 3, 9)
"""Pixels between the taps of the filter's passes; docs/measurements/tried.md compares others."""


class StochasticLightDenoiser(Effect):
    """Filters noisy light: a temporal filter, then an a-trous filter whose width depends on the variance."""

    name = "stochastic_light"

    def __init__(self, device: Device) -> None:
        self._accumulate = programs(device).compute(f"{_FOLDER}/stochastic_light_history.slang")
        # A pass whose parameters differ between dispatches would be bound again each time.
        self._passes = [device.compute(f"{_FOLDER}/stochastic_light_filter.slang") for _ in _STEPS]
        self._modulate = device.compute(f"{_FOLDER}/stochastic_light_modulate.slang")
        self._remembers = self._smooths = True
        self._unfiltered_from = QUIET_FROM

    def light(self, graph: FrameGraph) -> NoisyLight:
        """What this frame's lighting is to fill."""
        with graph.scope(self.name):
            return NoisyLight(graph.texture("samples", _LIGHT, layers=_PARTS), graph.texture("albedo", BOTH_PARTS))

    def __call__(
        self,
        graph: FrameGraph,
        noisy: NoisyLight,
        reprojection: Reprojection,
        picture: History,
    ) -> Texture:
        """This light, filtered, both parts as frame/signals/light.py has them.

        `picture`: Antialiasing.history's.
        """
        with graph.scope(self.name):
            history = graph.history("history", {"history": spy.Format.rgba32_uint}, layers=_PARTS)
            state = history.state
            filtered = [
                graph.texture(f"filtered {i}", spy.Format.rgba32_uint, layers=_PARTS, scratch=True) for i in range(2)
            ]
            lobes = graph.texture("mirror lobes", spy.Format.rgba32_uint, scratch=True)
            width, height = graph.size
            noisy_pixels = graph.buffer("noisy pixels", data=np.zeros(1, np.uint32))

            def decide(frame: FrameContext) -> None:
                unchanged = reprojection.unchanged
                if unchanged == QUIET_FROM:
                    # This waits for the frame before, once.
                    is_noisy = noisy_pixels.physical.to_numpy().view(np.uint32)[0] > NOISY_PICTURE * width * height
                    self._unfiltered_from = UNFILTERED_FROM if is_noisy else QUIET_FROM
                elif unchanged < QUIET_FROM:
                    self._unfiltered_from = QUIET_FROM
                complete = max(self._unfiltered_from, COMPLETE_FROM)
                self._remembers = unchanged < complete or not state.stays(frame, complete)
                self._smooths = unchanged < self._unfiltered_from

            graph.record("decide", decide)
            graph.add(
                self._accumulate,
                accumulate_grid(graph.size, _PARTS),
                when=self._remembering,
                samples=noisy.samples,
                signal=write(filtered[0]),
                lobes=write(lobes),
                known=history.known,
                **history.swap(),
            )
            for number, (step, smooth) in enumerate(zip(_STEPS, self._passes, strict=True)):
                source, target = filtered[number % 2], filtered[1 - number % 2]
                graph.add(
                    smooth,
                    graph.grid,
                    when=self._smoothing,
                    signal=source,
                    lobes=lobes,
                    filtered=update(target) if number else write(target),
                    step=step,
                )
            result, shared = filtered[len(_STEPS) % 2], graph.texture("shared", BOTH_PARTS)
            graph.add(
                self._modulate,
                graph.grid,
                filtered=result,
                samples=noisy.samples,
                albedo=noisy.albedo,
                history=history["history"],
                previousPicture=picture.textures["picture"].previous,
                pictureKnown=picture.known,
                smoothed=lambda frame: int(self._smooths),
                noisy=update(noisy_pixels),
                counting=lambda frame: {QUIET_FROM - 2: 1, QUIET_FROM - 1: 2}.get(reprojection.unchanged, 0),
                shared=write(shared),
            )
            offer_stochastic_light_aovs(graph, noisy.samples, result, history["history"])
        return shared

    def _remembering(self, frame: FrameContext) -> bool:
        return self._remembers

    def _smoothing(self, frame: FrameContext) -> bool:
        return self._smooths
