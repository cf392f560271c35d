"""Ray effects that follow paths, as ray tracing pipelines in parts (tiers 2 and 3)."""

from typing import Any

import numpy as np
import slangpy as spy

from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.tracing.ray_buffers import RayBuffers
from pica.tracing.ray_pipeline import EffectCode, RayPipeline

_RAY_GENERATION = """
import tracing.path_pipeline;
import {module};
RWStructuredBuffer<Ray> rays;
RWStructuredBuffer<{effect}.State> states;
StructuredBuffer<uint> queue;
RWStructuredBuffer<uint> next;
RWStructuredBuffer<uint> counts;
uniform uint2 grid;
uniform uint part;
uniform uint most;
[shader("raygeneration")]
void main()
{{
    runPart<{effect}, HitDetail.{detail}>(
        DispatchRaysIndex().xy, grid, part, most, rays, states, queue, next, counts);
}}
"""
_ALL = 0xFFFFFFFF


class PathPipeline:
    """The effect as ray generation shaders that trace a few rays of each path, one shader after the other.

    A wave takes as long as its longest path, and few paths are long: between the parts, active paths are compacted,
    so that waves are full again.
    """

    def __init__(self, device: Device, code: EffectCode, parts: tuple[int, ...]) -> None:
        """`parts`: rays of a path in each part but the last, which has the rest."""
        self.name, self.blocks = code.name, code.blocks
        self.parts = (*parts, _ALL)
        generation = code.shaders("paths", _RAY_GENERATION)
        self.pipeline = RayPipeline(device, self.name, code.recipe(generation))
        self.buffers = RayBuffers(device, self.name, generation, shared=True)
        self._grid: tuple[int, int] | None = None
        self.counts = 2 * len(self.parts)
        """Numbers that shaders count in."""
        self._counts = device.buffer("path counts", data=np.zeros(self.counts, np.uint32), struct_size=4)

    def __call__(self, recording: Recording, grid: tuple[int, int], /, **values: Any) -> None:
        """Record the effect over a (width, height) grid with these parameters."""
        size = grid[0] * grid[1]
        if grid != self._grid:
            self._grid, self._size = grid, spy.uint2(*grid)
        recording.encoder.clear_buffer(self._counts)
        values |= {"counts": self._counts, "grid": self._size, **self.buffers.for_rays(size)}
        for part, most in enumerate(self.parts):
            threads = (size, 1) if part else grid
            self.pipeline(recording, threads, part=part, most=most, **values)
            values["queue"], values["next"] = values["next"], values["queue"]
