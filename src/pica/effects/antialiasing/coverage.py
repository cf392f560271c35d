"""The fraction of each pixel that surfaces cover: alpha, where the background is transparent."""

from collections.abc import Callable
from typing import Any

import numpy as np
import slangpy as spy

from pica.effects.antialiasing.temporal_resolve import TemporalResolve
from pica.frame.gbuffer import GBuffer
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, update, write
from pica.rhi.device import Device


class Coverage:
    """Alpha, antialiased as the picture is: by the same samples and the same kind of history (Porter and Duff 1984,
    "Compositing Digital Images", section 3)."""

    def __init__(self, device: Device) -> None:
        self._resolve = TemporalResolve(device, "coverage")
        self._mask = device.compute("effects/antialiasing/mask_background.slang")

    def __call__(
        self, graph: FrameGraph, gbuffer: GBuffer, radiance: Texture, restarts: Callable[[Any], bool] | None
    ) -> Texture:
        """Alpha in each of r, g and b (output size). Takes the surroundings out of this frame's `radiance`."""
        covered = graph.texture("covered", spy.Format.rgba16_float)
        inputs = {"frame": graph.frame, "gbuffer": gbuffer, "radiance": update(radiance), "covered": write(covered)}
        graph.add(self._mask, graph.grid, **inputs)
        one = graph.buffer("exposure of coverage", data=np.ones(1, np.float32))
        return self._resolve(graph, gbuffer, covered, one, restarts)
