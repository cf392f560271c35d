"""The G-buffer effect: which triangle each pixel sees, by raster or by rays, then what it is made of."""

from typing import Any, Literal

import slangpy as spy

from pica.frame.aovs import gbuffer_aovs
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.draws import CULL, FRONT, DrawKind, Facing
from pica.gpu_scene.view import SceneView
from pica.programs.library import programs
from pica.programs.recipes import ForTypes
from pica.programs.scene_features import COATS, LOBES, known_features
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass, RasterPass, RasterState
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/gbuffer"
_BOXES = Facing.BOXES, Facing.BOXES_MIRRORED


class RasterVisibility:
    """Writes which triangle each pixel sees, by rasterization. One indirect draw per kind of section."""

    def __init__(self, device: Device, size: Size) -> None:
        self._passes = {
            kind: self._pass(device, kind)
            for kind in (DrawKind(opaque, facing) for opaque in (True, False) for facing in Facing)
            if kind.facing not in _BOXES
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
        self._device = device
        self._targets: dict[spy.Texture, spy.RenderPassDesc] = {}
        self._views: list[spy.TextureView] = []

    def __call__(self, frame: FrameContext, scene: SceneView, visibility: spy.Texture) -> None:
        """Fill `visibility` (width, height, rg32_uint)."""
        if visibility not in self._targets:
            self._targets[visibility] = self._render_targets(visibility)
        self._state.index_buffer = scene.geometry.indices
        for for_types in self._passes.values():  # so that the first triangles of a kind find its pipeline made
            for_types(scene.material_types)
        drawn = scene.draws(frame)
        for draws in drawn:
            if draws.kind not in self._passes:
                self._passes[draws.kind] = self._pass(self._device, draws.kind)
        frame.profiler.begin(frame.encoder, "raster")
        for draws in drawn:  # Slang-RHI's own barrier would come within the render pass, which Vulkan does not allow
            frame.encoder.set_buffer_state(draws.arguments, spy.ResourceState.indirect_argument)
        with frame.encoder.begin_render_pass(self._targets[visibility]) as encoder:
            for draws in drawn:
                self._passes[draws.kind](scene.material_types).bind(encoder, scene=scene, frame=frame)
                encoder.set_render_state(self._state)
                encoder.draw_indexed_indirect(draws.count, draws.arguments)
        frame.profiler.end(frame.encoder)

    def give_back(self) -> None:
        """Nobody needs the depth buffer any more."""
        self._device.give_back(self._depth)

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
        return programs(device).raster(f"{_FOLDER}/{file}", shaders, state)


class GBufferEffect(Effect):
    """Fills a GBuffer once a frame."""

    name = "gbuffer"
    aov_names = (
        "depth",
        "position",
        "normal",
        "geometric_normal",
        "albedo",
        "metallic",
        "roughness",
        "emission",
        "motion",
        "instance",
        "material",
        "uv",
    )

    def __init__(
        self,
        device: Device,
        size: Size,
        primary: Literal["auto", "raster", "rays"],
        tracer: Tracer | None = None,
    ) -> None:
        """`primary`: "auto" rasterizes on the CPU and traces on GPUs that can (docs/measurements/performance.md)."""
        self._device = device
        self.primary = primary
        if primary == "auto":
            self.primary = "rays" if device.traces_rays and not device.is_software else "raster"
        self._rays = (
            ray_effect(device, f"{_FOLDER}/primary_rays.slang", "PrimaryRays", "hit", tracer)
            if self.primary == "rays"
            else None
        )
        self._coordinates: ForTypes[Any, ComputePass] | None = None
        self._resolve = programs(device).compute(f"{_FOLDER}/resolve.slang")
        self._shown: tuple[SceneView, FrameContext] | None = None
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        self._buffer = GBuffer(self._device, size)
        self._raster = RasterVisibility(self._device, size) if self.primary == "raster" else None
        self._uv: spy.Texture | None = None

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._buffer.give_back()
        if self._uv is not None:
            self._device.give_back(self._uv)
        if self._raster is not None:
            self._raster.give_back()
        self._allocate(size)

    def aovs(self) -> dict[str, Aov]:
        """See gbuffer_aovs."""
        if self._shown is None:
            return {}
        return gbuffer_aovs(self._buffer.textures, *self._shown, self._texture_coordinates)

    def _texture_coordinates(self) -> spy.Texture:
        """The newest frame's texture coordinates, by a pass of its own, which nothing compiles before."""
        assert self._shown is not None
        scene, frame = self._shown
        seen = {name: self._buffer.textures[name] for name in ("visibility", "depth")}
        if self._coordinates is None:
            self._coordinates = programs(self._device).compute(f"{_FOLDER}/texture_coordinates.slang")
        if self._uv is None:
            self._uv = self._device.texture("texture coordinates", spy.Format.rg32_float, frame.size)
        self._coordinates(scene.material_types)(frame, frame.grid, scene=scene, frame=frame, uv=self._uv, **seen)
        return self._uv

    def ray_counts(self) -> dict[str, int]:
        """One a pixel, where rays find what the camera sees."""
        depth = self._buffer.textures["depth"]
        return {} if self._rays is None else {"primary_rays": depth.width * depth.height}

    def __call__(self, frame: FrameContext, scene: SceneView) -> GBuffer:
        """The G-buffer of this frame."""
        self._shown = scene, frame
        known = known_features(scene.material_types)
        for feature in known & {COATS, LOBES}:
            self._buffer.make_room_for(feature.word)
        self._buffer.turn()
        textures = self._buffer.textures
        if self._raster is not None:
            self._raster(frame, scene, textures["visibility"])
        if self._rays is not None:
            self._rays(frame, frame.size, scene=scene, frame=frame, visibility=textures["visibility"])
        self._resolve(scene.material_types)(frame, frame.grid, scene=scene, frame=frame, **textures)
        return self._buffer
