"""Removes the bias of spatial reuse from the reflections of a still picture."""

import slangpy as spy

from pica.effects.reflections.ray_grid import ray_size
from pica.filtering.convergence import CORRECTION_FROM
from pica.filtering.reprojection import Reprojection
from pica.frame.context import FrameContext
from pica.graph.graph import FrameGraph
from pica.graph.resources import Lifetime, Texture, update, write
from pica.programs.library import programs
from pica.rhi.device import Device

_FOLDER = "effects/reflections"


class ConvergenceCorrection:
    """Lets reconstructed reflections converge to the mean of each pixel's own rays while nothing changes."""

    def __init__(self, device: Device) -> None:
        self._accumulate = programs(device).compute(f"{_FOLDER}/convergence_correction.slang")
        self._apply = device.compute(f"{_FOLDER}/apply_correction.slang")
        self._last_frame = -1

    def reset(self) -> None:
        """Discard the history."""
        self._last_frame = -1

    def __call__(
        self,
        graph: FrameGraph,
        reprojection: Reprojection,
        hit_position_and_pdf: Texture,
        light: Texture,
        reflected: Texture,
        dense: bool,
    ) -> None:
        """Correct `reflected` in place once the picture is at rest.

        `hit_position_and_pdf` and `light`: of this frame's rays, as reflected.slang has them. `dense`: as in
        ray_grid.slang.
        """
        correction = graph.texture("correction", spy.Format.rgba32_float, lifetime=Lifetime.KEPT)
        second_moments = graph.texture("correction second moments", spy.Format.r32_float, lifetime=Lifetime.KEPT)

        def at_rest(frame: FrameContext) -> bool:
            return reprojection.unchanged >= CORRECTION_FROM

        def begins(frame: FrameContext) -> bool:
            continues = reprojection.unchanged > CORRECTION_FROM and self._last_frame + 1 == frame.index
            if at_rest(frame):
                self._last_frame = frame.index
            return at_rest(frame) and not continues

        graph.record(
            "clear correction",
            lambda frame, correction: frame.encoder.clear_texture_float(correction),
            when=begins,
            correction=write(correction),
        )
        graph.add(
            self._accumulate,
            (*ray_size(graph, dense), 1),
            when=at_rest,
            dense=int(dense),
            hitPositionAndPdf=hit_position_and_pdf,
            light=light,
            reflected=reflected,
            correction=update(correction),
            secondMoments=update(second_moments),
        )
        graph.add(
            self._apply,
            graph.grid,
            when=at_rest,
            correction=correction,
            secondMoments=second_moments,
            reflected=update(reflected),
        )
