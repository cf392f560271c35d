"""The G-buffer effect: the visible triangle of each pixel, by raster or by rays, then its surface."""

from typing import Any, Literal

import slangpy as spy

from pica.frame.aovs import gbuffer_aovs
from pica.frame.context import FrameContext
from pica.frame.effect import Effect
from pica.frame.gbuffer import VISIBILITY_USAGE, GBuffer
from pica.gpu_scene.draws import CULL, FRONT, DrawKind, Facing
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Lifetime, Texture, write
from pica.programs.library import programs
from pica.programs.recipes import ForTypes, MaterialPass
from pica.programs.scene_features import COATS, LOBES, supported_features
from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device
from pica.rhi.passes import RasterPass, RasterState
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect

_FOLDER = "effects/gbuffer"
_BOXES = Facing.BOXES, Facing.BOXES_MIRRORED
_MARKED, _SEEN, _BY_CHANCE = range(3)
"""raster_glass.slang: LAYERS_MARKED and so on."""


class RasterVisibility:
    """Rasterizes the visible triangle of each pixel. One indirect draw per kind of section.

    `glass`: of transmissive and blended sections in front of the surfaces that the G-buffer has; else of the latter.
    """

    def __init__(self, device: Device, glass: bool = False) -> None:
        self._device, self._glass = device, glass
        self._passes = {
            kind: self._pass(*kind)
            for kind in ((opaque, facing) for opaque in (True, False) for facing in Facing)
            if kind[1] not in _BOXES
        }
        self._state = spy.RenderState()
        self._state.index_format = spy.IndexFormat.uint32
        self._targets: dict[spy.Texture, spy.RenderPassDesc] = {}
        self._views: list[spy.TextureView] = []

    def __call__(
        self,
        graph: FrameGraph,
        scene: SceneView,
        gbuffer: GBuffer,
        glass: Texture | None = None,
        nearer: Texture | None = None,
        layers: int = _MARKED,
    ) -> Texture:
        """Fill the visibility of `gbuffer`, or `glass` with what is farther than the depth `nearer`. Returns the depth.
        `layers`: which points of blended surfaces are drawn there.

        Layer by layer that is depth peeling (Everitt 2001, "Interactive Order-Independent Transparency").
        """
        if nearer is None:
            self._targets, self._views = {}, []
        width, height = graph.size
        self._state.viewports = [spy.Viewport.from_size(width, height)]
        self._state.scissor_rects = [spy.ScissorRect.from_size(width, height)]
        usage = spy.TextureUsage.depth_stencil | spy.TextureUsage.shader_resource
        name = "raster_glass" if self._glass else "raster"
        of = glass.name if glass else name
        depth = graph.texture(f"{of} depth", spy.Format.d32_float, usage=usage)
        inputs: dict[str, Any] = {"scene": scene, "constants": graph.frame, "depth": write(depth)}
        if glass is not None:
            inputs |= {"layers": layers, "opaque": gbuffer.textures["depth"]} | ({"nearer": nearer} if nearer else {})
        graph.record(name, self._draw, **inputs, visibility=write(glass or gbuffer.textures["visibility"]))
        return depth

    def _draw(
        self,
        frame: FrameContext,
        scene: SceneView,
        constants: ParameterBlock,
        visibility: spy.Texture,
        depth: spy.Texture,
        opaque: spy.Texture | None = None,
        nearer: spy.Texture | None = None,
        layers: int = _MARKED,
    ) -> None:
        if visibility not in self._targets:
            self._targets[visibility] = self._render_targets(visibility, depth)
        self._state.index_buffer = scene.geometry.triangles
        for for_types in self._passes.values():  # so that the first triangles of a kind find its pipeline made
            for_types.of(scene.material_types)
        draw_lists = scene.draws(frame)
        if scene.glass_apart:
            # Points of blended sections that are nearly opaque are in the G-buffer.
            blended = self._glass and scene.shows_layers
            draw_lists = [
                draws
                for draws in draw_lists
                if draws.kind.glass is self._glass
                or (blended and draws.kind.blends and draws.kind.facing not in _BOXES)
            ]
        for draws in draw_lists:
            if _key(draws.kind) not in self._passes:
                self._passes[_key(draws.kind)] = self._pass(*_key(draws.kind))
        name, apart = "raster", {}
        if opaque is not None:
            name = "raster_glass"
            apart = {"opaqueDepth": opaque, "nearerDepth": nearer or opaque, "peels": int(nearer is not None)}
        frame.profiler.begin(frame.encoder, name)
        for draws in draw_lists:  # Slang-RHI would place its barrier within the render pass, which Vulkan forbids
            for buffer in (draws.arguments, draws.counts):
                frame.encoder.set_buffer_state(buffer, spy.ResourceState.indirect_argument)
        for read in (opaque, nearer):
            if read is not None:
                frame.encoder.set_texture_state(read, spy.ResourceState.shader_resource)
        with frame.encoder.begin_render_pass(self._targets[visibility]) as encoder:
            for draws in draw_lists:
                step = self._passes[_key(draws.kind)].of(scene.material_types)
                drawn = {"layers": layers} if apart and draws.kind.facing not in _BOXES else {}
                step.bind(encoder, scene=scene, frame=constants, **apart, **drawn)
                encoder.set_render_state(self._state)
                encoder.draw_indexed_indirect(draws.count, draws.arguments, draws.counts)
        frame.profiler.end(frame.encoder)

    def _render_targets(self, visibility: spy.Texture, raster_depth: spy.Texture) -> spy.RenderPassDesc:
        target, depth = visibility.create_view(), raster_depth.create_view()
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

    def _pass(self, opaque: bool, facing: Facing) -> ForTypes[Any, RasterPass]:
        file = ("raster_glass" if self._glass else "raster") + ("_primitives" if facing in _BOXES else "")
        shader = "fragmentMain" if facing in _BOXES else "opaqueMain" if opaque else "coveredMain"
        state = RasterState((spy.Format.rg32_uint,), CULL[facing], FRONT[facing])
        shaders = "vertexMain", "glassMain" if self._glass else shader
        return programs(self._device).raster(f"{_FOLDER}/{file}.slang", shaders, state)


def _key(kind: DrawKind) -> tuple[bool, Facing]:
    return kind.opaque, kind.facing


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
        primary: Literal["auto", "raster", "rays"],
        tracer: Tracer | None = None,
        glass_layers: int = 0,
    ) -> None:
        """`primary`: "auto" rasterizes on the CPU and traces on GPUs that can (docs/measurements/performance.md).
        `glass_layers`: of transmissive surfaces to rasterize, as GBuffer.glass_layers; 0: only where there are any."""
        self._device = device
        self.primary = primary
        if primary == "auto":
            self.primary = "rays" if device.traces_rays and not device.is_software else "raster"
        self._rays: RayEffect | None = None
        # Any-hit shaders of a pipeline see what rays go through: a raster pass would take half a millisecond on a card.
        self._marks_glass = self.primary == "rays" and tracer is None and glass_layers == 0
        self._glass_layers = glass_layers
        self._raster: RasterVisibility | None = None
        if self.primary == "rays":
            self._rays = ray_effect(device, f"{_FOLDER}/primary_rays.slang", "PrimaryRays", "hit", tracer)
        else:
            self._raster = RasterVisibility(device)
        self._raster_glass: RasterVisibility | None = None
        self._coordinates: MaterialPass | None = None
        self._resolve = programs(device).compute(f"{_FOLDER}/resolve.slang")

    def __call__(self, graph: FrameGraph, scene: SceneView) -> GBuffer:
        """The G-buffer of this frame."""
        with graph.scope(self.name):
            features = supported_features(scene.material_types)
            optional = [feature.word for feature in features & {COATS, LOBES}]
            # Callers of `advance` read them after the frame.
            gbuffer = GBuffer(graph, graph.size, optional, Lifetime.KEPT)
            if self._raster is not None:
                self._raster(graph, scene, gbuffer)
            marks = scene.glass_apart and self._marks_glass
            layered = self._glass_layers > 0
            if scene.glass_apart:
                gbuffer.glass_layers = [
                    graph.texture(f"glass {layer}", spy.Format.rg32_uint, usage=VISIBILITY_USAGE)
                    for layer in range(max(self._glass_layers + (layered and scene.shows_layers), 1))
                ]
            if self._rays is not None:
                unused = graph.texture("unused glass", spy.Format.rg32_uint, (1, 1))
                glass = write(gbuffer.glass if marks and gbuffer.glass else unused)
                graph.add(self._rays, graph.size, scene=scene, glass=glass, **gbuffer.written("visibility"))
            rest = gbuffer.written(*(name for name in gbuffer.textures if name != "visibility"))
            visibility = gbuffer.textures["visibility"]
            graph.add(self._resolve, graph.grid, scene=scene, visibility=visibility, **rest)
            gbuffer.filled(graph)
            self._offer(graph, scene, gbuffer)
        if scene.glass_apart and not marks:
            with graph.scope("transparency"):  # labels do without
                self._raster_glass = self._raster_glass or RasterVisibility(self._device, glass=True)
                nearer = None
                for number, texture in enumerate(gbuffer.glass_layers):
                    # Behind those that are seen one by one, one further layer is met by chance.
                    layers = _MARKED if not layered else _SEEN if number < self._glass_layers else _BY_CHANCE
                    nearer = self._raster_glass(graph, scene, gbuffer, texture, nearer, layers)
        return gbuffer

    def _offer(self, graph: FrameGraph, scene: SceneView, gbuffer: GBuffer) -> None:
        for name, (sources, read) in gbuffer_aovs(scene).items():
            graph.offer(name, tuple(gbuffer.textures[source] for source in sources), prepare=read)
        if graph.wants("uv"):
            uv = graph.texture("texture coordinates", spy.Format.rg32_float)
            graph.record(
                "texture_coordinates",
                self._find_coordinates,
                scene=scene,
                constants=graph.frame,
                visibility=gbuffer.textures["visibility"],
                depth=gbuffer.textures["depth"],
                uv=write(uv),
            )
            graph.offer("uv", (uv,), lambda coordinates: coordinates)
        if self._rays is not None:
            pixels = graph.size[0] * graph.size[1]
            graph.offer("rays.primary_rays", (), lambda: pixels, on_request=True)

    def _find_coordinates(self, frame: FrameContext, constants: ParameterBlock, **inputs: Any) -> None:
        """By a pass that is compiled only on request."""
        if self._coordinates is None:
            self._coordinates = programs(self._device).compute(f"{_FOLDER}/texture_coordinates.slang")
        self._coordinates(frame, frame.grid, frame=constants, **inputs)
