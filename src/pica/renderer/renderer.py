"""The hybrid renderer, as users have it."""

from collections.abc import Callable, Collection
from functools import partial
from typing import Any
from weakref import ref

import slangpy as spy

from pica.denoising.denoiser import Denoise, Denoiser, denoiser_of
from pica.errors import PicaError, SettingsError
from pica.frame.aovs import at_size
from pica.frame.context import FrameContext, FrameSequence, Size
from pica.frame.effect import Effect
from pica.frame.relighting import Relighting
from pica.gpu_scene.view import SceneView
from pica.graph.description import GraphDescription
from pica.graph.plan import Capture, Plan, newest
from pica.images.labels import NUMBERED
from pica.images.lut import Lut
from pica.images.output import Frame
from pica.light_map.light_map import LightMap
from pica.programs.preparation import expect as expect_programs
from pica.renderer.frame_plan import FramePlan
from pica.renderer.gathered import Gathered
from pica.renderer.insertion import Declare, Insertion, checked_insertion
from pica.renderer.picking import Picked, Picker
from pica.renderer.stages import EVERY_GROUP, Stages
from pica.rendering.arguments import (
    Progress,
    check_made_with,
    check_progress,
    checked_aovs,
    checked_camera,
    checked_count,
    checked_pixel,
    checked_size,
)
from pica.rendering.black_pictures import BlackPictures
from pica.rendering.closing import Closing, synchronized
from pica.rendering.tensors import cuda_tensors
from pica.rhi.device import Device, open_device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.values import checked, flag, instance, number, optional, whole
from pica.settings import Settings
from pica.tracing.fallbacks import runnable
from pica.tracing.ray_buffers import Tracer

_FIRST_SAMPLES = 8
"""Frames of a first picture on graphics cards: as many as it takes to have the error of the picture in motion."""
_LATEST = (1 << 31) - 1
"""Number of a frame; shaders count in 32 bits."""


class Renderer(Closing):
    """The hybrid renderer: one frame a call from about one ray per pixel and effect.

    `size`: (width, height) in pixels. `device`: a Device, a SlangPy device that is open already, part of a device's
    name, or None for the best one. Without ray tracing, stages that need it fall back, each with a warning
    (docs/guide/devices.md); `settings` has the result.
    `light_map`: for global_illumination.mode "light_map", which the preset "raster" has; paths end in it too.
    `lut`: changes the colours of the display (docs/guide/viewing.md).
    Raises DeviceError without a usable device, SceneError for an invalid scene or one that is not the light
    map's, and PicaError for an impossible size.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        size: Size = (1280, 720),
        settings: Settings | None = None,
        device: Device | spy.Device | str | None = None,
        light_map: LightMap | None = None,
        lut: Lut | None = None,
    ) -> None:
        check_made_with(type(self).__name__, scene, settings, device)
        checked(f"{type(self).__name__}: lut", optional(instance(Lut)), lut)
        checked(f"{type(self).__name__}: light_map", optional(instance(LightMap)), light_map)
        if light_map is not None:
            light_map.check_scene(scene)
        size = checked_size(size)
        super().__init__(open_device(device), scene, size)
        expect_programs(self.device)
        self._settings = runnable(self.device, settings or Settings())
        with self.device.lock:
            self.view = SceneView(self.device, scene, self.settings)
            self._frames = self._make_frames()
            self._stages = Stages(self.device, self.settings, self.view, light_map, lut)
        self._frame_plan = FramePlan(self.device)
        self.effect_inputs: dict[str, Any] = {}
        """Inputs of the newest frame's effects, by their names in shaders."""
        self.debug = False
        """Whether `render` also keeps intermediate results of effects, as AOVs of the last frame with the prefix
        "debug.": `[name for name in frame.aov_names if name.startswith("debug.")]` (docs/guide/labels.md)."""
        self.captured: dict[str, Capture] = {}
        """Functions that fetch the captures of the newest `advance`, by name."""
        self._running = False
        self._picker = Picker(self.device, self.tracer)
        self._relighting = Relighting()
        self._black_pictures = BlackPictures()

    @property
    def device_name(self) -> str:
        """The adapter that renders."""
        return self.device.name

    @property
    def pending_shaders(self) -> int:
        """How many shader programs are still to be made, as of the newest frame, for material types that came."""
        return self.view.pending_programs

    @property
    def single_lights(self) -> list[str]:
        """Names of the lights that have a shadow ray of their own, strongest first."""
        return self._stages.slots.single_lights

    @property
    def host_seconds(self) -> float:
        """The host's time to record and submit the newest frame."""
        return self._frames.host_seconds

    @property
    def render_size(self) -> Size:
        """At which all up to antialiasing works; `size` is that of the pictures."""
        return self._frames.size

    @property
    def effects(self) -> list[Effect]:
        """The active stages, in the order of the frame."""
        return self._stages.effects

    @property
    def tracer(self) -> Tracer | None:
        """The tracer of ray buffers; None if ray tracing pipelines trace."""
        return self._stages.tracer

    @property
    def missing_aovs(self) -> dict[str, str]:
        """AOVs of effects that are off, with the effect's name."""
        return self._stages.missing_aovs

    @property
    def debug_aovs(self) -> tuple[str, ...]:
        """Names of the debug AOVs that `advance` can capture, as of the newest frame; none before the first."""
        return self._frame_plan.debug_aovs

    @property
    @synchronized
    def graph(self) -> GraphDescription:
        """The passes of the newest frame with what they read and write, their times and their memory. Waits for the
        device. Raises PicaError before the first frame."""
        with self.device.lock:
            return self._frame_plan.describe()

    @synchronized
    def insert(self, declare: Declare, after: str, *, name: str | None = None) -> Insertion:
        """Insert passes of your own into the frame, from the next one on (docs/guide/own-passes.md).

        `declare(graph, signals)` is called whenever the frame is declared, right after the stage `after`: "gbuffer",
        "shadows", "ambient_occlusion", "lighting", "global_illumination", "translucency", "reflections", "composite",
        "transparency", "antialiasing" or "post". It adds passes to the graph, and may replace the radiance, the picture
        or the display among the signals, or append to the parts of the light. `name`: of the effect, by default that
        of `declare`.
        Raises PicaError for an unknown stage, or a name in use.
        """
        taken = {"scene", "shared", *(effect.name for effect in self.effects)}
        taken.update(insertion.name for insertion in self._frame_plan.inserted)
        insertion = checked_insertion(declare, after, name, taken, ref(self))
        self._frame_plan.inserted.append(insertion)
        self.renew_frame()
        return insertion

    @synchronized
    def remove(self, insertion: Insertion) -> None:
        """Remove an `insert`. Does nothing if it is removed already."""
        if insertion in self._frame_plan.inserted:
            self._frame_plan.inserted.remove(insertion)
            self.renew_frame()

    @synchronized
    def renew_frame(self) -> None:
        """Declare the frame again, with a new picture: inserted passes are others. Histories of effects stay."""
        self._frame_plan.outdate()
        self._stages.antialiasing.restart()

    @synchronized
    def reset(self, frame: int = 0) -> None:
        """Discard all history: the next frame is frame 0 again, as a new renderer's.

        `frame`: its number instead, on which noise and jitter depend, so that a film that is begun in its middle has
        the samples of one that is rendered from its start. Raises PicaError for a number below 0.
        """
        self._frames.reset(checked("reset: frame", whole(0, _LATEST), frame, PicaError))
        self._drop_histories()

    def _drop_histories(self) -> None:
        self._frame_plan.memory.reset()
        self._stages.reset()

    @synchronized
    def resize(self, size: Size) -> None:
        """Render at another (width, height) from the next frame on, without history. Raises PicaError."""
        self._size = checked_size(size)
        with self.device.lock:
            self._frames.resize(self.size)
            self._drop_histories()

    @synchronized
    def configure(self, settings: Settings) -> None:
        """Apply other settings from the next frame on. Unaffected stages keep their histories."""
        checked("configure: settings", instance(Settings), settings, SettingsError)
        settings = runnable(self.device, settings)
        with self.device.lock:
            self.view.configure(settings)
            before, self._settings = self.settings, settings
            changed = before.changed_groups(settings)
            if before.antialiasing.upscale != settings.antialiasing.upscale:
                changed = EVERY_GROUP  # all works at another size
            if changed & {"seed", "antialiasing"}:
                self._frames = self._make_frames()
            self._frame_plan.memory.reset(self._stages.follow(settings, changed))
            if "rays" in changed:
                self._picker = Picker(self.device, self.tracer)
            self._frame_plan.outdate()
        if changed & {"seed", "rays", "visibility", "antialiasing"}:
            self.reset()  # the history of the G-buffer or the camera is invalid
        elif changed - {"geometry", "post"}:
            self._stages.antialiasing.restart()

    def _make_frames(self) -> FrameSequence:
        settings = self.settings
        return FrameSequence(self.device, self.size, settings.seed, settings.antialiasing.upscale)

    @synchronized
    def prepare(self) -> None:
        """Compile the programs for the first picture of the current scene, and store them in the caches.

        Renders no picture and leaves no history. Raises as `render`.
        """
        with self.device.lock:
            self._advance(self._default_camera(), wait=True)
        self.reset()
        self._running = False

    @synchronized
    def advance(
        self,
        camera: Camera,
        *,
        jittered: bool = True,
        capture: Collection[str] | Callable[[], Collection[str]] = (),
        seconds: float | None = None,
    ) -> dict[str, spy.Texture]:
        """Record and submit one frame. Returns its G-buffer and pictures, which the next frame overwrites.

        `jittered`: False samples pixel centres in every frame, which separates effects from antialiasing.
        `capture`: names of AOVs and debug AOVs that `captured` then has functions to fetch; or a function that returns
        such names once the frame's structure is known. `seconds`: as in `render`.
        After the first frame, new and replaced material types are compiled in the background: until they are
        ready, objects of new types are hidden, and those of replaced types are as before. Raises MaterialTypeError,
        once, for a type with a fault; the next call goes on without it. Raises PicaError for an unknown name.
        """

        def select(plan: Plan) -> frozenset[str]:
            names = capture() if callable(capture) else capture
            return checked_aovs("advance", names, plan.offers) or frozenset()

        elapsed = checked("advance: seconds", optional(number(0)), seconds, PicaError)
        with self.device.lock:
            unshown = self._unshown_frames()
            for done in range(unshown):
                self._advance(camera, not self._running, jittered, continues=done > 0)
            return self._advance(
                camera, not self._running, jittered, continues=unshown > 0, seconds=elapsed, select=select
            )

    def _unshown_frames(self) -> int:
        """Before the next one, whose histories they begin."""
        first = self.settings.antialiasing.first_samples or (1 if self.device.is_software else _FIRST_SAMPLES)
        return first - 1 if self._frames.is_first else 0

    @synchronized
    def count_rays(self, camera: Camera) -> dict[str, int]:
        """Rays by pass of one more frame. Waits for the device."""
        with self.device.lock:
            self._advance(camera, not self._running, select=lambda plan: plan.names_of("rays"))
        return {name.removeprefix("rays."): int(fetch()) for name, fetch in self.captured.items()}

    def _advance(
        self,
        camera: Camera,
        wait: bool,
        jittered: bool = True,
        denoiser: Denoiser | None = None,
        last: bool = False,
        continues: bool = False,
        seconds: float | None = None,
        select: Callable[[Plan], frozenset[str]] = lambda plan: frozenset(),
    ) -> dict[str, spy.Texture]:
        """One frame. `last`: `denoiser` finishes its picture. `continues`: it is one more of the same picture.
        `seconds`: as in `render`. `select`: the frame's captures, of what it offers."""
        frame = self._begin(camera, wait, jittered)
        frame.continues = continues
        frame.seconds = 0.0 if continues and seconds is not None else seconds
        self._running = True
        self._stages.slots.update(self.view.lights)
        plan, frame.requested = self._frame_plan.of(self._stages, self._frames, self.view, select, denoiser, last)
        self.captured = plan.replay(frame)
        self._frames.end(frame)
        signals = self._frame_plan.signals
        self.effect_inputs = {
            "frame": self._frames.block,
            "gbuffer": signals.gbuffer.block.parameters,
            "scene": self.view,
            "lightSlots": self._stages.slots,
        }
        buffers = {**signals.gbuffer.textures, "color": signals.picture, "display": signals.display}
        return {name: newest(texture) for name, texture in buffers.items()}

    def _begin(self, camera: Camera, wait: bool, jittered: bool) -> FrameContext:
        """A frame in which the scene is up to date."""
        self.check_open()  # a callback after a frame may have closed it
        camera = checked_camera("render", camera)
        self.view.sync(wait)
        frame = self._frames.begin(camera, jittered)
        frame.changed |= self.view.update(frame, camera)
        frame.changed_lights = self.view.lights_changed
        frame.since_relit = self._relighting.count(frame.changed_lights, frame.first)
        return frame

    @synchronized
    def render(
        self,
        frames: int = 16,
        *,
        camera: Camera | None = None,
        cut: bool = False,
        progress: Progress | None = None,
        denoise: Denoise = False,
        aovs: Collection[str] | None = None,
        seconds: float | None = None,
    ) -> Frame:
        """Render `frames` frames and return the last, which holds the mean of all since the last change.

        The whole scene is shown: new material types are compiled before the frame that needs them.
        The G-buffer's AOVs are those of the first of these frames, with motion since the previous call; all
        others are the last's (Frame.aov_info).

        `camera` None takes Scene.default_camera. `cut`: histories of earlier calls are discarded, as after `reset`;
        a camera whose picture overlaps little with the previous frame is detected as a cut without it. `progress(done,
        frames)` is called after each frame. `denoise`: as PathTracer's, at the end. `aovs`: names of the AOVs to keep,
        () for none, None for all but "uv", which costs a pass; each is a copy, which costs memory and time. `seconds`:
        since the picture before, for post.adaptation_up and post.adaptation_down; None: the exposure adapts at once.

        Raises SceneError for invalid content: in each call, until it is fixed; PicaError for an
        unknown AOV, and for one of an effect that is off.
        """
        frames = checked_count("render: frames", frames)
        check_progress("render", progress)
        requested = self._requested(aovs)
        elapsed = checked("render: seconds", optional(number(0)), seconds, PicaError)
        denoiser = denoiser_of(self.device, self.size, denoise)
        camera = self._default_camera() if camera is None else camera
        if checked("render: cut", flag, cut, PicaError):
            self.reset()
        gathered, timings = Gathered(frames, self._unshown_frames(), requested, self.debug), {}
        for done in gathered.numbers:
            with self.device.lock:
                last, continues = gathered.is_last(done), not gathered.is_first(done)
                select = partial(gathered.names, number=done)
                self._advance(camera, True, True, denoiser, last, continues, elapsed, select)
                gathered.add(done, self.captured, self.view)
                if last:
                    timings = self.device.profiler.flush()
                    if denoiser is not None:  # the denoiser's inputs belong to the picture
                        self._frame_plan.of(self._stages, self._frames, self.view, lambda plan: frozenset())
            if progress is not None and done > 0:
                progress(done, frames)
        watch = partial(self._black_pictures.watched, scene=self.scene, settings=self.settings)
        return gathered.frame(self.device, self.size, timings, watch)

    @synchronized
    def labels(self, *, camera: Camera | None = None, aovs: Collection[str] | None = None) -> Frame:
        """The G-buffer's AOVs, without any light, for a fraction of a picture's cost.

        They equal the first frame of `render` after `reset`, bit for bit, except that motion is since the previous
        call. Its colour and display raise PicaError. The next `render` begins a new picture, as after `reset`.
        `camera`, `aovs` and errors as in `render`; PicaError too for AOVs that only a picture has.
        """
        requested = checked_aovs("labels", aovs, self._stages.gbuffer.aov_names)
        camera = self._default_camera() if camera is None else camera
        with self.device.lock:
            self._frames.rewind()
            frame = self._begin(camera, wait=True, jittered=False)
            plan, frame.requested = self._frame_plan.of_gbuffer(
                self._stages, self._frames, self.view, lambda plan: frozenset(plan.names("gbuffer", requested))
            )
            images = plan.replay(frame, only="gbuffer")
            self._frames.end(frame)
            self._frames.rewind()
            self._drop_histories()
            labels = self.view.name_labels() if images.keys() & NUMBERED else None
            timings = self.device.profiler.flush()
        pixels, tensors = at_size(self.size, images), cuda_tensors(self.device, self.size, images)
        return Frame(self.size, None, None, pixels, timings, labels, self.device_name, tensors)

    @synchronized
    def pick(self, x: int, y: int, *, through_glass: bool = False) -> Picked | None:
        """What pixel (x, y) of the last frame shows: the first surface on the camera ray through the pixel's centre;
        None for the background.

        `x`, `y`: in pixels of the picture, from its upper left corner, right and down. `through_glass`: transmissive
        surfaces, and points of blended ones that are not nearly opaque, are passed. Points of masks count where they
        are opaque, points of blended surfaces wherever they show at all. Changes of the scene count from the next frame
        on, this renderer's or another one's of the scene. Waits for the device; the first call compiles a program.
        Raises PicaError before the first frame, after `resize` until the next one, and for a pixel outside of the
        picture; DeviceError if nothing traces rays on the device.
        """
        pixel = checked_pixel("pick", (x, y), self.size)
        passes = checked("pick: through_glass", flag, through_glass, PicaError)
        with self.device.lock:
            return self._picker(self._frames, self.view, pixel, passes)

    def _requested(self, aovs: Any) -> frozenset[str] | None:
        """The requested AOVs of `render`; None for all. Debug AOVs and those of
        inserted passes are known only after a frame."""
        available = (
            None
            if self.debug or self._frame_plan.inserted
            else [name for effect in self.effects for name in effect.aov_names]
        )
        requested = checked_aovs("render", aovs, available, self.missing_aovs)
        # Pictures without their alpha could not be saved.
        transparent = self.settings.visibility.background == "transparent"
        return requested | {"alpha"} if transparent and requested is not None else requested

    def _default_camera(self) -> Camera:
        return self.scene.default_camera(self.size[0] / self.size[1])
