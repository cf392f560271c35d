"""The reference path tracer: slow, unbiased, progressive."""

from collections.abc import Callable, Collection, Mapping

import slangpy as spy

from pica.denoising.denoiser import Denoise, Denoiser, denoiser_of
from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.effects.post.post import Post
from pica.errors import SettingsError, plain, shown
from pica.frame.aovs import alpha_aov
from pica.frame.arguments import (
    Progress,
    check_made_with,
    check_progress,
    checked_aovs,
    checked_camera,
    checked_count,
)
from pica.frame.black_pictures import BlackPictures
from pica.frame.closing import Closing, alone
from pica.frame.context import FrameContext, FrameSequence, Size
from pica.frame.effect import Aov, chosen, kept, picture_aov
from pica.gpu_scene.view import SceneView
from pica.labels import NUMBERED, Labels
from pica.output import Frame, Lazy
from pica.programs.preparation import expect as expect_programs
from pica.rhi.device import Device, open_device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings
from pica.tracing.fallbacks import check_traces, runnable
from pica.tracing.ray_effect import PATHS, ray_effect
from pica.tracing.tracers import choose_tracer

NO_LIMIT = 0


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
        device: Device | str | None = None,
    ) -> None:
        check_made_with(type(self).__name__, scene, settings, device)
        max_depth = plain(max_depth)
        if max_depth is not None and not (isinstance(max_depth, int) and 1 <= max_depth < 1 << 31):
            raise SettingsError(f"max_depth {shown(max_depth)}: must be 1 or more, or None for no limit")
        self.size = checked_size(size)
        super().__init__(open_device(device))
        expect_programs(self.device)
        device = self.device.part()
        check_traces(device, "path tracing")
        self.settings = runnable(device, settings or Settings())
        self.scene = scene
        self._max_depth = max_depth or NO_LIMIT
        self._black_pictures = BlackPictures()
        with device.turn:
            self._make(device)

    def _make(self, device: Device) -> None:
        """What it has on a part of the device."""
        scene, size, settings = self.scene, self.size, self.settings
        self.view = SceneView(device, scene, settings)
        tracer = choose_tracer(device, settings.rays, self.view)
        self._frames = FrameSequence(device, size, settings.seed)
        self._sum = device.texture("radiance sum", spy.Format.rgba32_float, size)
        self._mean = device.texture("radiance", spy.Format.rgba32_float, size)
        self._no_features = device.texture("no features", spy.Format.rgba32_float, (1, 1))
        self._trace = ray_effect(device, "path_tracer/path_tracer.slang", "PathTracer", "surface", tracer, parts=PATHS)
        self._average = device.compute("path_tracer/average.slang")
        self._gbuffer = GBufferEffect(device, size, settings.visibility.primary, tracer)
        self._transparent = settings.visibility.background == "transparent"
        self._post = Post(device, size, settings.post)

    def __repr__(self) -> str:
        limited = not self.closed and self._max_depth != NO_LIMIT
        return f"{super().__repr__()[:-1]}, max_depth={self._max_depth}>" if limited else super().__repr__()

    @property
    def device_name(self) -> str:
        """The adapter that renders."""
        return self.device.name

    @alone
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

        `denoise`: Open Image Denoise takes out the noise that is left, less well and in an eighth of the time with
        "fast"; PicaError where it is not installed. `aovs`: as Renderer's, of the G-buffer; they are the first
        sample's, through the pixels' centres.
        """
        samples = checked_count("render: samples", samples)
        check_progress("render", progress)
        wanted = checked_aovs("render", aovs, self._gbuffer.aov_names)
        denoiser = denoiser_of(self.device, self.size, denoise)
        if camera is None:
            camera = self.scene.default_camera(self.size[0] / self.size[1])
        camera = checked_camera("render", camera)
        self._frames.rewind()
        found: dict[str, Lazy] = {}
        labels: Labels | None = None
        timings: dict[str, float] = {}

        def keep(frame: FrameContext, aovs: Mapping[str, Aov]) -> None:
            found.update(kept(self.device, frame.encoder, aovs if "color" in aovs else chosen(aovs, wanted)))

        for done in range(1, samples + 1):
            with self.device.turn:
                self._sample(camera, done == 1, done == samples, denoiser, keep)
                if done == 1 and found.keys() & NUMBERED:
                    labels = self.view.name_labels()
                if done == samples:
                    timings = self.device.profiler.flush()
            if progress is not None:
                progress(done, samples)
        color, display = self._black_pictures.watched(found, self.scene, self.settings)
        pixels = {name: fetch for name, fetch in found.items() if name not in ("color", "display")}
        return Frame(self.size, color, display, pixels, timings, labels, self.device_name)

    def _sample(
        self,
        camera: Camera,
        first: bool,
        last: bool,
        denoiser: Denoiser | None,
        keep: Callable[[FrameContext, Mapping[str, Aov]], None],
    ) -> None:
        """Record and submit a path a pixel. `keep` records copies: of the G-buffer with the first, of the picture with
        the last."""
        self.check_open()  # what is called after each sample may close it
        self.view.admit()
        frame = self._frames.begin(camera, jittered=False)
        self.view.update(frame, frame.camera)
        if first:
            self.view.make_programs()
            frame.encoder.clear_texture_float(self._sum)
            self._gbuffer(frame, self.view)
            keep(frame, self._gbuffer.aovs())
        features = {"albedos": self._no_features, "normals": self._no_features} if denoiser is None else denoiser.sums
        self._trace(
            frame,
            frame.size,
            frame=frame,
            scene=self.view,
            accumulated=self._sum,
            maxDepth=self._max_depth,
            gathersFeatures=int(denoiser is not None),
            hidesBackground=int(self._transparent),
            **features,
        )
        if last:
            self._average(frame, frame.grid, frame=frame, accumulated=self._sum, radiance=self._mean)
            picture = self._mean if denoiser is None else denoiser(frame, self._mean)
            display = self._post(frame, picture, self._mean if self._transparent else None, channel=3)
            pictures = {"color": picture_aov(picture), "display": picture_aov(display)}
            keep(frame, pictures | ({"alpha": alpha_aov(self._mean, 3)} if self._transparent else {}))
        self._frames.end(frame)
