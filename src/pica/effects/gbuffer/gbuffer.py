"""The G-buffer effect: which triangle each pixel sees, by raster or by rays, then what it is made of."""

from typing import Any, Literal

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.draws import CULL, FRONT, DrawKind, Facing
from pica.gpu_scene.scene import GpuScene
from pica.rhi.device import Device
from pica.rhi.passes import RasterPass, RasterState
from pica.rhi.programs import ForTypes
from pica.rhi.schedulers import Tracer, ray_effect

_FOLDER = "effects/gbuffer"
_BOXES = Facing.BOXES, Facing.BOXES_MIRRORED


class RasterVisibility:
    """Writes which triangle each pixel sees, by rasterization. One indirect draw per kind of section."""

    def __init__(self, device: Device, size: Size) -> None:
        self._passes = {
            kind: self._pass(device, kind)
            for kind in (DrawKind(opaque, facing) for opaque in (True, False) for facing in Facing)
        }
        self._depth = device.texture(
            "raster depth",
            spy.Format.d32_float,
            size,
            spy.TextureUsage.depth_stencil | spy.TextureUsage.shader_resource,
        )
        self._state = spy.RenderState(
            {"viewports": [spy.Viewport.from_size(*size)], "scissor_rects": [spy.ScissorRect.from_size(*size)]}
        )
        self._state.index_format = spy.IndexFormat.uint32
        self._targets: dict[spy.Texture, spy.RenderPassDesc] = {}
        self._views: list[spy.TextureView] = []

    def __call__(self, frame: FrameContext, scene: GpuScene, visibility: spy.Texture) -> None:
        """Fill `visibility` (width, height, rg32_uint)."""
        if visibility not in self._targets:
            self._targets[visibility] = self._render_targets(visibility)
        self._state.index_buffer = scene.geometry.indices
        for kind, for_types in self._passes.items():
            if kind.facing not in _BOXES:  # so that the first triangles of a kind find its pipeline made
                for_types(scene.material_types)
        frame.profiler.begin(frame.encoder, "raster")
        with frame.encoder.begin_render_pass(self._targets[visibility]) as encoder:
            for draws in scene.draws:
                self._passes[draws.kind](scene.material_types).bind(encoder, scene=scene, frame=frame)
                encoder.set_render_state(self._state)
                encoder.draw_indexed_indirect(draws.count, draws.arguments)
        frame.profiler.end(frame.encoder)

    def _render_targets(self, visibility: spy.Texture) -> spy.RenderPassDesc:
        target, depth = visibility.create_view(), self._depth.create_view()
        self._views += target, depth
        return spy.RenderPassDesc(
            {
                "color_attachments": [{"view": target, "load_op": spy.LoadOp.clear, "clear_value": [0, 0, 0, 0]}],
                "depth_stencil_attachment": {
                    "view": depth,
                    "depth_load_op": spy.LoadOp.clear,
                    "depth_clear_value": 0.0,
                },
            }
        )

    def _pass(self, device: Device, kind: DrawKind) -> ForTypes[Any, RasterPass]:
        file, shaders = "raster.slang", ("vertexMain", "opaqueMain" if kind.opaque else "coveredMain")
        if kind.facing in _BOXES:
            file, shaders = "raster_primitives.slang", ("vertexMain", "fragmentMain")
        state = RasterState((spy.Format.rg32_uint,), CULL[kind.facing], FRONT[kind.facing])
        return device.raster_for_types(f"{_FOLDER}/{file}", shaders, state)


class GBufferEffect:
    """Fills a GBuffer once a frame."""

    def __init__(
        self,
        device: Device,
        size: Size,
        primary: Literal["auto", "raster", "rays"],
        tracer: Tracer | None = None,
    ) -> None:
        """`primary`: "auto" rasterizes on the CPU and traces on GPUs, as measured in docs/performance.md."""
        self._buffer = GBuffer(device, size)
        self.primary = primary if primary != "auto" else ("raster" if device.is_software else "rays")
        self._raster = RasterVisibility(device, size) if self.primary == "raster" else None
        self._rays = (
            ray_effect(device, f"{_FOLDER}/primary_rays.slang", "PrimaryRays", "hit", tracer)
            if self.primary == "rays"
            else None
        )
        self._resolve = device.compute_for_types(f"{_FOLDER}/resolve.slang")

    @property
    def names(self) -> list[str]:
        """What the textures of the G-buffer are called."""
        return list(self._buffer.textures)

    def __call__(self, frame: FrameContext, scene: GpuScene) -> GBuffer:
        """The G-buffer of this frame."""
        self._buffer.turn()
        textures = self._buffer.textures
        if self._raster is not None:
            self._raster(frame, scene, textures["visibility"])
        if self._rays is not None:
            self._rays(frame, frame.size, scene=scene, frame=frame, visibility=textures["visibility"])
        self._resolve(scene.material_types)(frame, frame.grid, scene=scene, frame=frame, **textures)
        return self._buffer
