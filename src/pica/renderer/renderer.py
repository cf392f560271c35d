"""The hybrid renderer, as users have it."""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, overload

import slangpy as spy

from pica.denoising.denoiser import Denoise, Denoiser, denoiser_of
from pica.errors import DeviceError, PicaError, SettingsError
from pica.frame.context import Size
from pica.graph.plan import Capture, Plan
from pica.images.frame_batch import FrameBatch
from pica.images.lut import Lut
from pica.images.output import Frame
from pica.light_map.light_map import LightMap
from pica.many_views.merged_plans import MergedFrames
from pica.programs.preparation import expect as expect_programs
from pica.renderer.gathered import Gathered, labels_frame, names_of, whole_array, whole_tensor
from pica.renderer.picking import Picked, Picker
from pica.renderer.renderer_frames import RendererFrames
from pica.renderer.together import begin_together, replay_together
from pica.renderer.view import Select, View
from pica.rendering.arguments import (
    Progress,
    check_made_with,
    check_progress,
    checked_aovs,
    checked_camera,
    checked_cameras,
    checked_count,
    checked_pixel,
    checked_scenes,
    checked_size,
    primary_and_others,
)
from pica.rendering.black_pictures import BlackPictures
from pica.rendering.closing import synchronized
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.values import checked, flag, instance, number, optional, whole
from pica.settings import Settings
from pica.tracing.fallbacks import runnable
from pica.tracing.shared_tracer import pays

_FIRST_SAMPLES = 8
"""Frames of a first picture on graphics cards: as many as it takes to have the error of the picture in motion."""
_LATEST = (1 << 31) - 1
"""Number of a frame; shaders count in 32 bits."""


class Renderer(RendererFrames):
    """The hybrid renderer: one frame a call from about one ray per pixel and effect.

    `size`: (width, height) in pixels. `device`: a Device, a SlangPy device that is open already, part of a device's
    name, or None for the best one. Without ray tracing, stages that need it fall back, each with a warning
    (docs/guide/devices.md); `settings` has the result.
    `light_map`: for global_illumination.mode "light_map", which the preset "raster" has; paths end in it too.
    `lut`: changes the colours of the display (docs/guide/viewing.md). `views`: cameras in each call, each with noise,
    exposure and histories of its own (docs/guide/scaling.md). Their `scene` is one for all, or one for each, as
    pica.SceneViews or a list:

        renderer = pica.Renderer(scene, size=(128, 128), views=64)
        batch = renderer.render(4, camera=cameras)  # a pica.FrameBatch; batch.color is (64, 128, 128, 3)

    `devices`: in place of `device`, several that trace rays of each frame, as names, numbers in the order of
    `pica doctor`, or open devices. The first makes the picture, and copies part of the rays to the others; not with
    `views`. Where that is slower, as on graphics cards unless `rays.scheduler` is `buffers`, the first renders alone,
    with a warning.

    Raises DeviceError without a usable device, SceneError for an invalid scene or one that is not the light
    map's, and PicaError for an impossible size or number of views.
    """

    _views_are_alike = False
    """Whether all views have the noise of the first, and nothing is traced once for all: each picture has the bits of
    a renderer of one view."""

    _merges_views = False
    """Whether software devices too record all views' frames together: tests do, but there it is not faster."""

    def __init__(
        self,
        scene: Scene | Sequence[Scene],
        *,
        size: Size = (1280, 720),
        settings: Settings | None = None,
        device: Device | spy.Device | str | None = None,
        devices: Sequence[Device | spy.Device | str | int] | None = None,
        light_map: LightMap | None = None,
        lut: Lut | None = None,
        views: int | None = None,
    ) -> None:
        scenes = checked_scenes(type(self).__name__, scene, views)
        for each in {id(each): each for each in scenes}.values():
            check_made_with(type(self).__name__, each, settings, device)
            if light_map is not None:
                checked(f"{type(self).__name__}: light_map", instance(LightMap), light_map).check_scene(each)
        checked(f"{type(self).__name__}: lut", optional(instance(Lut)), lut)
        size = checked_size(size)
        first, self._others = primary_and_others(type(self).__name__, device, devices)
        super().__init__(first, scenes[0], size)
        expect_programs(self.device)
        self._makes_batches = views is not None or scenes[0] is not scene
        """Whether it takes and gives one camera and picture for each view, instead of one."""
        if self._makes_batches and self._others:
            raise PicaError("Renderer: views and several devices do not go together; make a renderer for each device")
        self._settings = self._runnable(settings or Settings())
        if self._others and not pays(first, self.settings.rays):
            self._others = []
        merges = len(scenes) > 1 and (self._merges_views or not self.device.is_software)
        self._merged = MergedFrames(self.device, len(scenes)) if merges else None
        with self._lock:
            of_each = size, self.settings, light_map, lut
            self._views, leaders = list[View](), dict[int, View]()
            for number, each in enumerate(scenes):
                own = 0 if self._views_are_alike else number
                view = View(self.device, each, *of_each, own, leaders.get(id(each)), self._others, self._merged)
                if not self._views_are_alike:
                    leaders.setdefault(id(each), view)
                self._views.append(view)
        self.view = self._views[0].scene
        """The first view's data of the scene."""
        self.effect_inputs: dict[str, Any] = {}
        """Inputs of the newest frame's effects, by their names in shaders; of the first view."""
        self.debug = False
        """Whether `render` also keeps intermediate results of effects, as AOVs of the last frame with the prefix
        "debug.": `[name for name in frame.aov_names if name.startswith("debug.")]` (docs/guide/labels.md)."""
        self.captured: dict[str, Capture] = {}
        """Functions that fetch the captures of the newest `advance`, by name."""
        self._running = False
        self._picker = Picker(self.device, self.tracer)
        self._black_pictures = BlackPictures()

    @synchronized
    def reset(self, frame: int = 0) -> None:
        """Discard all history: the next frame is frame 0 again, as a new renderer's.

        `frame`: its number instead, on which noise and jitter depend, so that a film that is begun in its middle has
        the samples of one that is rendered from its start. Raises PicaError for a number below 0.
        """
        frame = checked("reset: frame", whole(0, _LATEST), frame, PicaError)
        for view in self._views:
            view.reset(frame)

    @synchronized
    def resize(self, size: Size) -> None:
        """Render at another (width, height) from the next frame on, without history. Raises PicaError."""
        self._size = checked_size(size)
        with self._lock:
            for view in self._views:
                view.resize(self.size)

    @synchronized
    def configure(self, settings: Settings) -> None:
        """Apply other settings from the next frame on. Unaffected stages keep their histories."""
        checked("configure: settings", instance(Settings), settings, SettingsError)
        settings = self._runnable(settings)
        with self._lock:
            changed = self.settings.changed_groups(settings)
            self._settings = settings
            for view in self._views:
                view.configure(settings)
            if "rays" in changed:
                self._picker = Picker(self.device, self.tracer)

    @synchronized
    def prepare(self) -> None:
        """Compile the programs for the first picture of the current scene, and store them in the caches.

        Renders no picture and leaves no history. Raises as `render`.
        """
        with self._lock:
            self._advance([self._default_camera(view.scene.source) for view in self._views], wait=True)
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
        once, for a type with a fault; the next call goes on without it. Raises PicaError for an unknown name, and if
        the renderer has `views`.
        """

        def select(plan: Plan) -> frozenset[str]:
            names = capture() if callable(capture) else capture
            return checked_aovs("advance", names, plan.offers) or frozenset()

        self._check_one_view("advance")
        elapsed = checked("advance: seconds", optional(number(0)), seconds, PicaError)
        cameras = [checked_camera("render", camera)]
        with self._lock:
            unshown = self._unshown_frames()
            for done in range(unshown):
                self._advance(cameras, not self._running, jittered, continues=done > 0)
            self._advance(cameras, not self._running, jittered, continues=unshown > 0, seconds=elapsed, select=[select])
            return self._views[0].textures()

    def _unshown_frames(self) -> int:
        """Before the next one, whose histories they begin."""
        first = self.settings.antialiasing.first_samples or (1 if self.device.is_software else _FIRST_SAMPLES)
        return first - 1 if self._views[0].frames.is_first else 0

    @synchronized
    def count_rays(self, camera: Camera) -> dict[str, int]:
        """Rays by pass of one more frame. Waits for the device. Raises PicaError if the renderer has `views`."""
        self._check_one_view("count_rays")
        cameras = [checked_camera("render", camera)]
        with self._lock:
            self._advance(cameras, not self._running, select=[lambda plan: plan.names_of("rays")])
        return {name.removeprefix("rays."): int(fetch()) for name, fetch in self.captured.items()}

    def _advance(
        self,
        cameras: Sequence[Camera],
        wait: bool,
        jittered: bool = True,
        denoisers: Sequence[Denoiser | None] | None = None,
        last: bool = False,
        continues: bool = False,
        seconds: float | None = None,
        select: Sequence[Select] | None = None,
    ) -> list[dict[str, Capture]]:
        """A frame of each view, with its captures. `last`: the denoisers finish their pictures. `continues`: it is one
        more of the same pictures. `seconds`: as in `render`. `select`: each view's captures, of what it offers."""
        self.check_open()  # a callback after a frame may have closed it
        frames = begin_together(self.device, self._views, cameras, wait, jittered, self._merged)
        for frame in frames:
            frame.continues = continues
            frame.seconds = 0.0 if continues and seconds is not None else seconds
        self._running = True
        of_each = zip(
            self._views, frames, select or [_nothing] * self.views, denoisers or [None] * self.views, strict=True
        )
        plans = [view.plan_for(frame, choose, denoiser, last) for view, frame, choose, denoiser in of_each]
        try:
            captured = replay_together(self.device, self._views, frames, plans, self._merged)
        except DeviceError:
            for view in self._views:  # nothing of half a frame stays
                view.reset()
            raise
        self._views[0].frames.end(frames[0])
        self.captured, self.effect_inputs = captured[0], self._views[0].inputs()
        return captured

    @overload
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
    ) -> Frame: ...

    @overload
    @synchronized
    def render(
        self,
        frames: int = 16,
        *,
        camera: Sequence[Camera],
        cut: bool = False,
        progress: Progress | None = None,
        denoise: Denoise = False,
        aovs: Collection[str] | None = None,
        seconds: float | None = None,
    ) -> FrameBatch: ...

    @synchronized
    def render(
        self,
        frames: int = 16,
        *,
        camera: Camera | Sequence[Camera] | None = None,
        cut: bool = False,
        progress: Progress | None = None,
        denoise: Denoise = False,
        aovs: Collection[str] | None = None,
        seconds: float | None = None,
    ) -> Frame | FrameBatch:
        """Render `frames` frames and return the last, which holds the mean of all since the last change.

        The whole scene is shown: new material types are compiled before the frame that needs them.
        The G-buffer's AOVs are those of the first of these frames, with motion since the previous call; all
        others are the last's (Frame.aov_info).

        `camera` None takes Scene.default_camera; a renderer with `views` takes a camera for each, and returns a
        FrameBatch. `cut`: histories of earlier calls are discarded, as after `reset`;
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
        denoisers = [denoiser_of(self.device, self.size, denoise) for _ in self._views]
        cameras = self._cameras_of("render", camera)
        if checked("render: cut", flag, cut, PicaError):
            self.reset()
        unshown, timings, views = self._unshown_frames(), {}, self._views
        gathered = [Gathered(frames, unshown, requested, self.debug) for _ in views]
        for done in gathered[0].numbers:
            with self._lock:
                last, continues = gathered[0].is_last(done), not gathered[0].is_first(done)
                select = [partial(each.names, number=done) for each in gathered]
                captured = self._advance(cameras, True, True, denoisers, last, continues, elapsed, select)
                names = names_of([view.scene for view in views])
                for each, captures, of_scene in zip(gathered, captured, names, strict=True):
                    each.add(done, captures, of_scene)
                if last:
                    timings = self.device.profiler.flush()
                    if denoise:
                        for view in views:
                            view.without_denoiser()
            if progress is not None and done > 0:
                progress(done, frames)
        watch = partial(self._black_pictures.watched, settings=self.settings)
        makers = [
            partial(each.frame, self.device, self.size, timings, partial(watch, scene=view.scene.source))
            for each, view in zip(gathered, views, strict=True)
        ]
        return self._result(makers, [each.captures for each in gathered])

    @overload
    @synchronized
    def labels(self, *, camera: Camera | None = None, aovs: Collection[str] | None = None) -> Frame: ...

    @overload
    @synchronized
    def labels(self, *, camera: Sequence[Camera], aovs: Collection[str] | None = None) -> FrameBatch: ...

    @synchronized
    def labels(
        self, *, camera: Camera | Sequence[Camera] | None = None, aovs: Collection[str] | None = None
    ) -> Frame | FrameBatch:
        """The G-buffer's AOVs, without any light, for a fraction of a picture's cost.

        They equal the first frame of `render` after `reset`, bit for bit, except that motion is since the previous
        call. Its colour and display raise PicaError. The next `render` begins a new picture, as after `reset`.
        `camera`, `aovs` and errors as in `render`; PicaError too for AOVs that only a picture has.
        """
        requested = checked_aovs("labels", aovs, self._stages.gbuffer.aov_names)
        cameras = self._cameras_of("labels", camera)
        with self._lock:
            for view in self._views:
                view.frames.rewind()
            frames = begin_together(self.device, self._views, cameras, True, False, self._merged)
            select: Select = lambda plan: frozenset(plan.names("gbuffer", requested))  # noqa: E731
            plans = [view.gbuffer_plan_for(frame, select) for view, frame in zip(self._views, frames, strict=True)]
            captured = replay_together(self.device, self._views, frames, plans, self._merged, only="gbuffer")
            self._views[0].frames.end(frames[0])
            for view in self._views:
                view.frames.rewind()
                view.drop_histories()
            timings = self.device.profiler.flush()
            made = partial(labels_frame, self.device, self.size, timings)
            labelled = zip(captured, names_of([view.scene for view in self._views]), strict=True)
            return self._result([partial(made, each, names.of(each)) for each, names in labelled], captured)

    @synchronized
    def pick(self, x: int, y: int, *, through_glass: bool = False) -> Picked | None:
        """What pixel (x, y) of the last frame shows: the first surface on the camera ray through the pixel's centre;
        None for the background.

        `x`, `y`: in pixels of the picture, from its upper left corner, right and down. `through_glass`: transmissive
        surfaces, and points of blended ones that are not nearly opaque, are passed. Points of masks count where they
        are opaque, points of blended surfaces wherever they show at all. Changes of the scene count from the next frame
        on, this renderer's or another one's of the scene. Waits for the device; the first call compiles a program.
        Raises PicaError before the first frame, after `resize` until the next one, and for a pixel outside of the
        picture, and if the renderer has `views`; DeviceError if nothing traces rays on the device.
        """
        self._check_one_view("pick")
        pixel = checked_pixel("pick", (x, y), self.size)
        passes = checked("pick: through_glass", flag, through_glass, PicaError)
        with self._lock:
            return self._picker(self._views[0].frames, self.view, pixel, passes)

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

    def _cameras_of(self, caller: str, camera: Any) -> list[Camera]:
        """A camera for each view. Raises PicaError for another number of them, SceneError for what is none."""
        if self._makes_batches:
            return checked_cameras(caller, camera, self.views)
        return [self._default_camera(self.scene) if camera is None else checked_camera(caller, camera)]

    def _default_camera(self, scene: Scene) -> Camera:
        return scene.default_camera(self.size[0] / self.size[1])

    def _check_one_view(self, caller: str) -> None:
        if self._makes_batches:
            raise PicaError(f"{caller}: this renderer has views={self.views}, whose cameras render and labels take")

    def _result(
        self, frames: Sequence[Callable[[], Frame]], captured: Sequence[Mapping[str, Capture]]
    ) -> Frame | FrameBatch:
        """`frames`: as FrameBatch. `captured`: of each."""
        if not self._makes_batches:
            return frames[0]()
        given = self.device, self.size, captured
        return FrameBatch(frames, partial(whole_array, *given), partial(whole_tensor, *given))

    def _runnable(self, settings: Settings) -> Settings:
        """As they run on the devices. Raises SettingsError for a scheduler that several cannot have."""
        if self._others and settings.rays.scheduler == "pipeline":
            raise SettingsError("setting rays.scheduler: must be auto or buffers, as several devices share buffers")
        return runnable(self.device, settings)

    def _release(self) -> None:
        for view in self._views:
            view.scene.close()


def _nothing(_plan: Plan) -> frozenset[str]:
    """No captures."""
    return frozenset()
