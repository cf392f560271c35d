"""Draws shadow maps: a compute pass lists the casters of each view, then one or two indirect draws a view."""

from dataclasses import dataclass

import numpy as np
import slangpy as spy

from pica.effects.shadow_maps.map_array import MapArray
from pica.frame.context import FrameContext
from pica.gpu_scene.draws import DRAW_SIZE, DrawList
from pica.gpu_scene.view import SceneView
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.rhi.passes import RasterPass, RasterState

_FOLDER = "effects/shadow_maps"
_INDIRECT = spy.BufferUsage.indirect_argument | spy.BufferUsage.unordered_access | spy.BufferUsage.shader_resource


@dataclass(frozen=True)
class StaleMap:
    """A map to draw."""

    view: int
    """Its place in the buffer of views."""
    maps: MapArray
    layer: int
    mask: int
    """The shadow bits of the light's channels (gpu_scene/masks.py): instances without them cast no shadow."""


class MapDrawing:
    """Casters are drawn double-sided: a wall casts a shadow from either side."""

    def __init__(self, device: Device, view_count: int) -> None:
        """`view_count`: the most views that are drawn in one frame."""
        self._device, self._view_count = device, view_count
        self._cull = device.compute(f"{_FOLDER}/cull_casters.slang", name="shadow map culling")
        state = RasterState((), spy.CullMode.none)
        module = f"{_FOLDER}/casters.slang"
        self._opaque = device.raster(module, ("vertexMain",), state)
        self._covered = programs(device).raster(module, ("vertexMain", "coveredMain"), state)
        self._stale = device.structured("stale views", np.zeros((max(view_count, 1), 2), np.uint32))
        self.counts = device.structured(
            "shadow map draw counts", np.zeros(2 * max(view_count, 1), np.uint32), _INDIRECT
        )
        """uint32, two of each map that was last drawn: how many opaque sections it was given, how many others."""
        self._arguments = device.buffer("shadow map draws", size=DRAW_SIZE, usage=_INDIRECT)

    def give_back(self) -> None:
        """Book the buffers as released."""
        self._device.give_back(self._stale, self.counts, self._arguments)

    def __call__(self, frame: FrameContext, scene: SceneView, views: spy.Buffer, stale: list[StaleMap]) -> None:
        """Record the drawing of these maps."""
        casters = scene.casters(frame)
        totals = [sum(draws.count for draws in casters if draws.kind.opaque is opaque) for opaque in (True, False)]
        self._list_draws(frame, scene, casters, views, stale, totals)
        frame.profiler.begin(frame.encoder, "shadow maps")
        for buffer in (self._arguments, self.counts):  # Vulkan allows no barrier within a render pass
            frame.encoder.set_buffer_state(buffer, spy.ResourceState.indirect_argument)
        for place, target in enumerate(stale):
            target.maps.state.index_buffer = scene.geometry.triangles
            with frame.encoder.begin_render_pass(target.maps.targets[target.layer]) as encoder:
                for covered, total in enumerate(totals):
                    if not total:
                        continue
                    self._pass(scene, covered).bind(
                        encoder, scene=scene, frame=frame, views=views, view=target.view, mapSize=target.maps.size
                    )
                    encoder.set_render_state(target.maps.state)
                    start = place * sum(totals) + covered * totals[0]
                    encoder.draw_indexed_indirect(
                        total,
                        spy.BufferOffsetPair(self._arguments, DRAW_SIZE * start),
                        spy.BufferOffsetPair(self.counts, 4 * (2 * place + covered)),
                    )
        frame.profiler.end(frame.encoder)

    def _pass(self, scene: SceneView, covered: int) -> RasterPass:
        return self._covered.of(scene.material_types) if covered else self._opaque

    def _list_draws(
        self,
        frame: FrameContext,
        scene: SceneView,
        casters: list[DrawList],
        views: spy.Buffer,
        stale: list[StaleMap],
        totals: list[int],
    ) -> None:
        size = DRAW_SIZE * sum(totals) * self._view_count
        if size > self._arguments.size:
            self._device.give_back(self._arguments)
            self._arguments = self._device.buffer("shadow map draws", size=2 * size, usage=_INDIRECT)
        rows = np.array([(target.view, target.mask) for target in stale], np.uint32)
        frame.encoder.upload_buffer_data(self._stale, 0, rows)
        frame.encoder.clear_buffer(self.counts)
        starts = [0, totals[0]]
        for draws in casters:
            covered = int(not draws.kind.opaque)
            self._cull(
                frame,
                (draws.count, len(stale), 1),
                scene=scene,
                draws=draws.arguments,
                drawCount=draws.count,
                views=views,
                stale=self._stale,
                staleCount=len(stale),
                covered=covered,
                listStart=starts[covered],
                drawsPerView=sum(totals),
                arguments=self._arguments,
                counts=self.counts,
            )
