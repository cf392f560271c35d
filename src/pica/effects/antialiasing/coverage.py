"""The fraction of each pixel that surfaces cover: alpha, where the background is transparent."""

from collections.abc import Callable
from typing import Any

import numpy as np
import slangpy as spy

from pica.effects.antialiasing.temporal_resolve import TemporalResolve
from pica.graph.graph import FrameGraph
from pica.graph.resources import History, Texture, write
from pica.rhi.device import Device


class Coverage:
    """Alpha, antialiased as the picture is: by the same samples and the same kind of history (Porter and Duff 1984,
    "Compositing Digital Images", section 3)."""

    def __init__(self, device: Device) -> None:
        self._resolve = TemporalResolve(device, "coverage", is_light=False)
        self._cover = device.compute("effects/antialiasing/coverage.slang")

    def __call__(
        self,
        graph: FrameGraph,
        radiance: Texture,
        glass: History | None,
        restarts: Callable[[Any], bool] | None,
    ) -> Texture:
        """Alpha in each of r, g and b (output size). `radiance`: with what the G-buffer leaves out, by its
        alpha."""
        covered = graph.texture("covered", spy.Format.rgba16_float)
        graph.add(self._cover, graph.grid, radiance=radiance, covered=write(covered))
        one = graph.buffer("exposure of coverage", data=np.ones(1, np.float32))
        return self._resolve(graph, self._resolve.history(graph), covered, one, glass, restarts=restarts)
