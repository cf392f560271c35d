"""The reference path tracer: slow, unbiased, progressive."""

from collections.abc import Collection, Sequence
from functools import partial
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.denoising.denoiser import Denoise, Denoiser, denoiser_of
from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.effects.post.post import Post
from pica.errors import DeviceError, SettingsError, plain, shown
from pica.frame.aovs import alpha_of, texels
from pica.frame.context import FrameContext, FrameSequence, Size
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Capture, Plan
from pica.graph.resources import write
from pica.images.labels import NUMBERED, Labels
from pica.images.lut import Lut
from pica.images.output import Frame
from pica.path_tracer.shared_samples import SharedSamples
from pica.programs.preparation import expect as expect_programs
from pica.rendering.arguments import (
    Progress,
    check_made_with,
    check_progress,
    checked_aovs,
    checked_camera,
    checked_count,
    checked_size,
    primary_and_others,
)
from pica.rendering.black_pictures import BlackPictures
from pica.rendering.closing import Closing, synchronized
from pica.rendering.tensors import cuda_tensors
from pica.rhi.device import Device
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

    `max_depth` counts path edges: 1 shows emission only, 2 adds direct light, None sets no limit. `devices`: in place
    of `device`, several that share the samples of each picture, as names, numbers in the order of `pica doctor`, or
    open devices. The first finishes the picture and makes the AOVs; the others' sums of samples come to it through the
    host, once a picture. Other parameters and errors as Renderer's; SettingsError for a depth below 1, DeviceError
    where nothing traces rays, and for a device that fails while it shares a picture.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        size: Size = (1280, 720),
        max_depth: int | None = None,
        settings: Settings | None = None,
        device: Device | spy.Device | str | None = None,
        devices: Sequence[Device | spy.Device | str | int] | None = None,
        lut: Lut | None = None,
    ) -> None:
        check_made_with(type(self).__name__, scene, settings, device)
        first, others = primary_and_others(type(self).__name__, device, devices)
        checked(f"{type(self).__name__}: lut", optional(instance(Lut)), lut)
        max_depth = plain(max_depth)
        if max_depth is not None and not (isinstance(max_depth, int) and 1 <= max_depth < 1 << 31):
            raise SettingsError(f"max_depth {shown(max_depth)}: must be 1 or more, or None for no limit")
        size = checked_size(size)
        super().__init__(first, scene, size)
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
            self._total = device.texture("sum of samples", _LIGHT, self.size)
            self._received = device.texture("sum of other devices", _LIGHT, self.size if others else (1, 1))
        self._others = [
            PathTracer(scene, size=self.size, max_depth=max_depth, settings=settings, device=other) for other in others
        ]
        self._samples, self._shared = 1, SharedSamples(1)
        """Of the picture, by all devices."""
        self._first = self._last = False
        """Whether the sample that is being recorded is the first or the last of its picture."""

    def __repr__(self) -> str:
        limited = not self.closed and self._max_depth != NO_LIMIT
        return f"{super().__repr__()[:-1]}, max_depth={self._max_depth}>" if limited else super().__repr__()

    @property
    def device_name(self) -> str:
        """The adapter that renders; several with " and " between them."""
        return " and ".join(each.device.name for each in (self, *self._others))

    def _release(self) -> None:
        self._shared.end()  # the callback after a sample may close it while other devices are at work
        for other in self._others:
            other.close()
        super()._release()

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
        """A picture of `samples` paths a pixel. `progress(done, samples)` is called after each; of several devices'
        samples, after those of the first.

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
        self._samples = samples
        self._shared = shared = SharedSamples(samples)
        plan: Plan | None = None
        images: dict[str, Capture] = {}
        labels: Labels | None = None
        timings: dict[str, float] = {}
        with shared.beside([partial(other.sum_of, camera=camera) for other in self._others]) as sums:
            for index in shared.finishing():
                self._first, self._last = index == 0, index == samples - 1
                received = sums() if self._last else []
                with self.device.lock:
                    frame = self._begin(camera, index)
                    plan = plan or self._declare(denoiser, requested)
                    captured = plan.names("gbuffer", requested) if self._first else set()
                    if self._last:
                        self._receive(received)
                        captured |= {"color", "display"} | ({"alpha"} if self._transparent else set())
                    frame.requested = frozenset(captured)
                    images |= plan.replay(frame)
                    self._frames.end(frame)
                    if self._first and images.keys() & NUMBERED:
                        labels = self.view.name_labels()
                    if self._last:
                        timings = self.device.profiler.flush()
                        if denoiser is not None:  # the denoiser's inputs belong to the picture
                            self._declare()
                if progress is not None:
                    progress(shared.taken, samples)
        color, display = self._black_pictures.watched(images, self.scene, self.settings)
        pixels = {name: fetch for name, fetch in images.items() if name not in ("color", "display")}
        tensors = cuda_tensors(self.device, self.size, images)
        return Frame(self.size, color, display, pixels, timings, labels, self.device_name, tensors)

    @synchronized
    def sum_of(self, shared: SharedSamples, camera: Camera) -> NDArray[np.float32] | None:
        """The sum of samples that another device's tracer shares, and of their coverage: (height, width, 4); None if
        none was left. Raises DeviceError, which ends the picture."""
        plan: Plan | None = None
        try:
            while (index := shared.take()) is not None:
                with self.device.lock:
                    self._first = plan is None
                    frame = self._begin(camera, index)
                    plan = plan or self._declare()
                    plan.replay(frame)
                    self._frames.end(frame)
            if plan is None:
                return None
            with self.device.lock:
                return np.asarray(self._total.to_numpy(), np.float32)
        except Exception as error:
            shared.end()
            raise DeviceError(f"device {self.device.name!r} failed while it shared a picture: {error}") from error

    def _receive(self, sums: list[NDArray[np.float32] | None]) -> None:
        """Upload what the other devices have found."""
        found = [each for each in sums if each is not None]
        if self._others:
            nothing = np.zeros((*self.size[::-1], 4), np.float32)
            self._received.copy_from_numpy(sum(found, start=nothing))

    def _begin(self, camera: Camera, index: int) -> FrameContext:
        self.check_open()  # the callback after a sample may have closed it
        self.view.sync()
        if self._first:
            self._frames.rewind()
        self._frames.skip_to(index)
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
                with graph.when(lambda frame: self._first):
                    graph.record("clear", lambda frame: frame.encoder.clear_texture_float(self._total))
                self._add_sample(graph, denoiser)
                with graph.when(lambda frame: self._last):
                    self._finish(graph, denoiser)
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

    def _add_sample(self, graph: FrameGraph, denoiser: Denoiser | None) -> None:
        """Add a path a pixel to the sum."""
        nothing = graph.nothing(_LIGHT)
        features: dict[str, Any] = {"albedos": nothing, "normals": nothing} if denoiser is None else denoiser.sums
        graph.add(
            self._trace,
            graph.size,
            accumulated=self._total,
            maxDepth=self._max_depth,
            gathersFeatures=int(denoiser is not None),
            hidesBackground=int(self._transparent),
            apertureRadius=lambda frame: frame.camera.aperture_radius,
            apertureBlades=lambda frame: frame.camera.aperture_blades,
            focusDistance=lambda frame: frame.camera.focus_distance or 0.0,
            **features,
        )

    def _finish(self, graph: FrameGraph, denoiser: Denoiser | None) -> None:
        """The mean of all samples, and the display."""
        mean = graph.texture("radiance", _LIGHT)
        graph.add(
            self._average,
            graph.grid,
            accumulated=self._total,
            received=self._received,
            isShared=int(bool(self._others)),
            samples=lambda frame: self._samples,
            radiance=write(mean),
        )
        picture = mean if denoiser is None else denoiser.finish(graph, mean)
        alpha = mean if self._transparent else None
        display = self._post(graph, picture, self._post.exposure(graph), alpha, channel=3)
        graph.offer("color", (picture,), texels(3))
        graph.offer("display", (display,), texels(3))
        if alpha is not None:
            graph.offer("alpha", (alpha,), partial(alpha_of, 3))
