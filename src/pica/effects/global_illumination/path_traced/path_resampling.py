"""Paths resampled from earlier frames and neighbours: ReSTIR GI (Ouyang et al. 2021)."""

import slangpy as spy

from pica.frame.context import FrameContext
from pica.frame.gbuffer import GBuffer
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, update
from pica.rhi.device import Device
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/global_illumination/path_traced"


class PathResampling:
    """Replaces the light of each pixel's own path by that of resampled paths."""

    def __init__(self, device: Device, tracer: Tracer | None) -> None:
        modules = {"reuse_in_time": "ReuseInTime", "reuse_of_neighbours": "ReuseOfNeighbours"}
        self._in_time, self._of_neighbours = (
            ray_effect(device, f"{_FOLDER}/{module}.slang", effect, "hit", tracer) for module, effect in modules.items()
        )

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        path_light: Texture,
        directions: Texture,
        packed_hits: Texture,
    ) -> None:
        """Replace the light of the candidate paths (indirect_rays.slang) by that of the resampled ones."""
        formats = dict.fromkeys(("visiblePoints", "samplePoints", "reservoirState"), spy.Format.rgba32_uint)
        reservoirs = graph.history("reservoirs", formats, graph.half_size)
        state = reservoirs.state
        shared = {**gbuffer.half_blocks(graph), "pathLight": update(path_light)}

        def known(frame: FrameContext) -> int:
            return int(not (state.empty or frame.changed_lights))  # the light of paths is that of their frame

        fresh = {"packedHits": packed_hits, "known": known}
        graph.add(self._in_time, graph.half_size, **shared, **reservoirs.swap(), **fresh)
        graph.add(self._of_neighbours, graph.half_size, directions=update(directions), **shared, **reservoirs.textures)
