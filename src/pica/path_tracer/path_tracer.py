"""The reference path tracer: slow, unbiased, progressive."""

from collections.abc import Collection
from functools import partial
from typing import Any

import slangpy as spy

from pica.denoising.denoiser import Denoise, Denoiser, denoiser_of
from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.effects.post.post import Post
from pica.errors import SettingsError, plain, shown
from pica.frame.aovs import alpha_of, texels
from pica.frame.context import FrameContext, FrameSequence, Size
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Capture, Plan
from pica.graph.resources import Lifetime, Texture, update, write
from pica.images.labels import NUMBERED, Labels
from pica.images.lut import Lut
from pica.images.output import Frame
from pica.programs.preparation import expect as expect_programs
from pica.rendering.arguments import (
    Progress,
    check_made_with,
    check_progress,
    checked_aovs,
    checked_camera,
    checked_count,
    checked_size,
)
from pica.rendering.black_pictures import BlackPictures
from pica.rendering.closing import Closing, synchronized
from pica.rendering.tensors import cuda_tensors
from pica.rhi.device import Device, open_device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.values import checked, instance, optional
from pica.settings import Settings
from pica.tracing.fallbacks import check_traces, runnable
from pica.tracing.ray_effect import PATHS, ray_effect
from pica.tracing.tracers import choose_tracer

NO_LIMIT = 0
_LIGHT = spy.Format.rgba32_float


class PathTracer(Closing):
    """Unidirectional path tracing with next-event estimation; box pixel filter, no clamping.

    `max_depth` counts path edges: 1 shows emission only, 2 adds direct light, None sets no limit. Other parameters
    and errors as Renderer's; SettingsError for a depth below 1, DeviceError where nothing traces rays.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        size: Size = (1280, 720),
        max_depth: int | None = None,
        settings: Settings | None = None,
        device: Device | spy.Device | str | None = None,
        lut: Lut | None = None,
    ) -> None:
        check_made_with(type(self).__name__, scene, settings, device)
        checked(f"{type(self).__name__}: lut", optional(instance(Lut)), lut)
        max_depth = plain(max_depth)
        if max_depth is not None and not (isinstance(max_depth, int) and 1 <= max_depth < 1 << 31):
            raise SettingsError(f"max_depth {shown(max_depth)}: must be 1 or more, or None for no limit")
        size = checked_size(size)
        super().__init__(open_device(device), scene, size)
        expect_programs(self.device)
        device = self.device.memory_scope()
        check_traces(device, "path tracing")
        self._settings = runnable(device, settings or Settings())
        self._max_depth = max_depth or NO_LIMIT
        self._black_pictures = BlackPictures()
        with device.lock:
            self.view = SceneView(device, scene, self.settings)
            tracer = choose_tracer(device, self.settings.rays, self.view)
            self._frames = FrameSequence(device, self.size, self.settings.seed)
            self._trace = ray_effect(
                device, "path_tracer/path_tracer.slang", "PathTracer", "surface", tracer, parts=PATHS
            )
            self._average = device.compute("path_tracer/average.slang")
            self._gbuffer = GBufferEffect(device, self.settings.visibility.primary, tracer)
            self._transparent = self.settings.visibility.background == "transparent"
            self._post = Post(device, self.settings.post, lut)
            self._memory = Memory(device)
        self._first = self._last = False
        """Whether the sample that is being recorded is the first or the last of its picture."""

    def __repr__(self) -> str:
        limited = not self.closed and self._max_depth != NO_LIMIT
        return f"{super().__repr__()[:-1]}, max_depth={self._max_depth}>" if limited else super().__repr__()

    @property
    def device_name(self) -> str:
        """The adapter that renders."""
        return self.device.name

    @synchronized
    def render(
        self,
        samples: int = 1024,
        *,
        camera: Camera | None = None,
        progress: Progress | None = None,
        denoise: Denoise = False,
        aovs: Collection[str] | None = None,
    ) -> Frame:
        """A picture of `samples` paths a pixel. `progress(done, samples)` is called after each.

        `denoise`: Open Image Denoise removes the remaining noise, with "fast" less well and in an eighth of the time;
        PicaError if it is not installed. `aovs`: as Renderer's, of the G-buffer; they are the first
        sample's, through the pixels' centres.
        """
        samples = checked_count("render: samples", samples)
        check_progress("render", progress)
        requested = checked_aovs("render", aovs, self._gbuffer.aov_names)
        denoiser = denoiser_of(self.device, self.size, denoise)
        if camera is None:
            camera = self.scene.default_camera(self.size[0] / self.size[1])
        camera = checked_camera("render", camera)
        self._frames.rewind()
        plan: Plan | None = None
        images: dict[str, Capture] = {}
        labels: Labels | None = None
        timings: dict[str, float] = {}
        for done in range(1, samples + 1):
            self._first, self._last = done == 1, done == samples
            with self.device.lock:
                frame = self._begin(camera)
                plan = plan or self._declare(denoiser, requested)
                captured = plan.names("gbuffer", requested) if self._first else set()
                if self._last:
                    captured |= {"color", "display"} | ({"alpha"} if self._transparent else set())
                frame.requested = frozenset(captured)
                images |= plan.replay(frame)
                self._frames.end(frame)
                if done == 1 and images.keys() & NUMBERED:
                    labels = self.view.name_labels()
                if done == samples:
                    timings = self.device.profiler.flush()
                    if denoiser is not None:  # the denoiser's inputs belong to the picture
                        self._declare()
            if progress is not None:
                progress(done, samples)
        color, display = self._black_pictures.watched(images, self.scene, self.settings)
        pixels = {name: fetch for name, fetch in images.items() if name not in ("color", "display")}
        tensors = cuda_tensors(self.device, self.size, images)
        return Frame(self.size, color, display, pixels, timings, labels, self.device_name, tensors)

    def _begin(self, camera: Camera) -> FrameContext:
        self.check_open()  # the callback after a sample may have closed it
        self.view.sync()
        frame = self._frames.begin(camera, jittered=False)
        self.view.update(frame, frame.camera)
        return frame

    def _declare(self, denoiser: Denoiser | None = None, requested: frozenset[str] | None = None) -> Plan:
        """A sample; the first and the last of a picture do more."""
        while True:
            types, graph = self.view.material_types, self._graph(requested or frozenset())
            with graph.when(lambda frame: self._first):
                gbuffer = self._gbuffer(graph, self.view)
            with graph.scope("path_tracer"):
                total = graph.texture("sum of samples", _LIGHT, lifetime=Lifetime.KEPT)
                with graph.when(lambda frame: self._first):
                    graph.record(
                        "clear", lambda frame, total: frame.encoder.clear_texture_float(total), total=write(total)
                    )
                self._add_sample(graph, total, denoiser)
                with graph.when(lambda frame: self._last):
                    self._finish(graph, total, denoiser)
            assert gbuffer is not None
            plan = Plan(graph)
            self.view.make_programs()
            if self.view.material_types == types:  # otherwise cached programs with more features were chosen
                return plan

    def _graph(self, requested: frozenset[str]) -> FrameGraph:
        blocks = self._frames.block, self._frames.half_block
        graph = FrameGraph(self._memory, self.size, self.size, *blocks, requested)
        graph.provide(scene=self.view)
        return graph

    def _add_sample(self, graph: FrameGraph, total: Texture, denoiser: Denoiser | None) -> None:
        """Add a path a pixel to `total`."""
        nothing = graph.nothing(_LIGHT)
        features: dict[str, Any] = {"albedos": nothing, "normals": nothing} if denoiser is None else denoiser.sums
        graph.add(
            self._trace,
            graph.size,
            accumulated=update(total),
            maxDepth=self._max_depth,
            gathersFeatures=int(denoiser is not None),
            hidesBackground=int(self._transparent),
            apertureRadius=lambda frame: frame.camera.aperture_radius,
            apertureBlades=lambda frame: frame.camera.aperture_blades,
            focusDistance=lambda frame: frame.camera.focus_distance or 0.0,
            **features,
        )

    def _finish(self, graph: FrameGraph, total: Texture, denoiser: Denoiser | None) -> None:
        """The mean of all samples, and the display."""
        mean = graph.texture("radiance", _LIGHT)
        graph.add(self._average, graph.grid, accumulated=total, radiance=write(mean))
        picture = mean if denoiser is None else denoiser.finish(graph, mean)
        alpha = mean if self._transparent else None
        display = self._post(graph, picture, self._post.exposure(graph), alpha, channel=3)
        graph.offer("color", (picture,), texels(3))
        graph.offer("display", (display,), texels(3))
        if alpha is not None:
            graph.offer("alpha", (alpha,), partial(alpha_of, 3))
