"""The whole frame, top to bottom."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

import slangpy as spy

from pica.denoising.denoiser import Denoise, Denoiser, denoiser_of
from pica.errors import PicaError
from pica.frame.aovs import at_size
from pica.frame.arguments import Progress, check_progress, checked_aovs, checked_camera, checked_count
from pica.frame.black_pictures import BlackPictures
from pica.frame.closing import alone
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, chosen, kept, picture_aov
from pica.labels import NUMBERED, Labels
from pica.light_map.light_map import LightMap
from pica.output import Frame, Lazy
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.values import checked, flag
from pica.settings import Settings
from pica.stages import Stages


class Renderer(Stages):
    """The hybrid renderer: one frame a call from about one ray per pixel and effect.

    `size`: (width, height) in pixels. `device`: a Device, part of a device's name, or None for the best there is. On
    one without ray tracing, stages that need it fall back, each with a warning (docs/guide/devices.md);
    `settings` tells how.
    `light_map`: for global_illumination.mode "light_map", which the preset "raster" has; paths end in it too.
    Raises DeviceError without a usable device, SceneError for a scene that cannot be shown or that is not the light
    map's, and PicaError for an impossible size.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        size: Size = (1280, 720),
        settings: Settings | None = None,
        device: Device | str | None = None,
        light_map: LightMap | None = None,
    ) -> None:
        super().__init__(scene, size, settings, device, light_map)
        self.effect_inputs: dict[str, Any] = {}
        """What the effects of the newest frame were given, by the names that shaders have for it."""
        self.debug = False
        """Whether `render` also keeps what effects have in between, as AOVs of the last frame whose names begin with
        "debug.": `[name for name in frame.aov_names if name.startswith("debug.")]` (docs/guide/labels.md)."""
        self._running = False
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
        return self._slots.single_lights

    @property
    def host_seconds(self) -> float:
        """What the newest frame took the host to record and submit."""
        return self._frames.host_seconds

    @alone
    def prepare(self) -> None:
        """Compile what the first picture of the scene as it is now takes, and leave it in the caches for later starts.

        No picture and no history comes of it. Raises as `render`.
        """
        with self.device.turn:
            self._advance(self._default_camera(), wait=True)
        self.reset()
        self._running = False

    @alone
    def advance(self, camera: Camera, *, jittered: bool = True) -> dict[str, spy.Texture]:
        """Record and submit one frame. Returns its buffers, which the next frame overwrites.

        `jittered`: False looks through the pixels' centres in every frame, which tells effects and antialiasing apart.
        After the first frame, material types that come or are replaced are compiled in the background: until they are
        ready, objects of new types are not shown, and those of replaced ones as they were. Raises MaterialTypeError,
        once, for a type with a fault; the next call goes on without it.
        """
        with self.device.turn:
            return self._advance(camera, not self._running, jittered)

    def _advance(
        self,
        camera: Camera,
        wait: bool,
        jittered: bool = True,
        denoiser: Denoiser | None = None,
        last: bool = False,
        keep: Callable[[FrameContext, Mapping[str, spy.Texture]], None] | None = None,
    ) -> dict[str, spy.Texture]:
        """`keep` may record copies of what the frame gives."""
        scene, slots = self.view, self._slots
        frame = self._begin(camera, wait, jittered)
        self._running = True
        slots.update(scene.lights)
        if not self._prepared:
            self._prepare()
        gbuffer = self.gbuffer(frame, scene)
        if denoiser is not None:
            denoiser.gather(frame, gbuffer, scene)
        reprojection = self.reprojection(frame, gbuffer)
        light = self._light_sampler(frame, gbuffer, scene, slots)
        self.effect_inputs = {"frame": frame, "gbuffer": gbuffer, "scene": scene, "lightSlots": slots}
        shadows = self.shadows(frame, gbuffer, scene, light, reprojection) if self.shadows else None
        occlusion = self.ambient_occlusion(frame, gbuffer, scene, reprojection) if self.ambient_occlusion else None
        noisy = self.stochastic_light.samples() if slots.noisy else None
        mirrored = self.reflections.surroundings() if self.reflections else None
        radiance = self.lighting(frame, gbuffer, scene, light, shadows, occlusion, noisy, mirrored)
        if noisy is not None:
            self.stochastic_light(frame, gbuffer, scene, radiance, reprojection)
        indirect = None
        if self.global_illumination is not None:
            exposure = self.post.exposure
            inputs = light, reprojection, occlusion, exposure
            indirect = self.global_illumination(frame, gbuffer, scene, *inputs, radiance)
        if self.reflections is not None:
            self.reflections(frame, gbuffer, scene, light, reprojection, indirect, radiance)
        picture = self.antialiasing(frame, gbuffer, radiance, self.post.exposure)
        if denoiser is not None and last:
            picture = denoiser(frame, picture)
        display = self.post(frame, picture, self.antialiasing.alpha)
        buffers = {**gbuffer.textures, "color": picture, "display": display}
        if keep is not None:
            keep(frame, buffers)
        self._frames.end(frame)
        return buffers

    def _begin(self, camera: Camera, wait: bool, jittered: bool) -> FrameContext:
        """A frame in which the scene is up to date."""
        self.check_open()  # what is called after each frame may close it
        camera = checked_camera("render", camera)
        self.view.admit(wait)
        frame = self._frames.begin(camera, jittered)
        frame.changed |= self.view.update(frame, camera)
        frame.changed_lights = self.view.lights_changed
        return frame

    @alone
    def render(
        self,
        frames: int = 16,
        *,
        camera: Camera | None = None,
        cut: bool = False,
        progress: Progress | None = None,
        denoise: Denoise = False,
        aovs: Collection[str] | None = None,
    ) -> Frame:
        """Render `frames` frames and return the last, which holds the mean of all since something moved.

        All that is in the scene is shown: material types that are new are compiled before the frame that meets them.
        The G-buffer's AOVs are those of the first of these frames, when motion is that since the call before; all
        others are the last's (Frame.aov_info).

        `camera` None takes Scene.default_camera. `cut`: nothing is taken along from earlier calls, as after `reset`;
        a camera that shows mostly what the frame before did not is found to be a cut without it. `progress(done,
        frames)` is called after each frame. `denoise`: as PathTracer's, at the end. `aovs`: names of the AOVs to keep,
        () for none, None for all but "uv", which costs a pass; each is a copy, which costs memory and time.

        Raises SceneError for what cannot be shown as it is now: in each call, until it is mended; PicaError for an
        unknown AOV, and for one of an effect that is off.
        """
        frames = checked_count("render: frames", frames)
        check_progress("render", progress)
        wanted = self._wanted(aovs)
        denoiser = denoiser_of(self.device, self.size, denoise)
        camera = self._default_camera() if camera is None else camera
        if checked("render: cut", flag, cut, PicaError):
            self.reset()
        found: dict[str, Lazy] = {}
        labels: Labels | None = None
        timings: dict[str, float] = {}

        def keep(frame: FrameContext, buffers: Mapping[str, spy.Texture]) -> None:
            keeping = self.gbuffer.aovs() if done == 1 else {}
            if done == frames:
                for effect in self.effects[1:]:
                    keeping |= effect.aovs()
            keeping = chosen(keeping, wanted)
            if done == frames:
                keeping |= {name: picture_aov(buffers[name]) for name in ("color", "display")}
            found.update(kept(self.device, frame.encoder, keeping))

        for done in range(1, frames + 1):
            with self.device.turn:
                self._advance(camera, wait=True, denoiser=denoiser, last=done == frames, keep=keep)
                if done == 1 and found.keys() & NUMBERED:
                    labels = self.view.name_labels()
                if done == frames:
                    if self.debug:
                        with self.device.record() as recording:
                            found |= kept(self.device, recording.encoder, chosen(self._debug_aovs(), wanted))
                    timings = self.device.profiler.flush()
            if progress is not None:
                progress(done, frames)
        color, display = found.pop("color"), found.pop("display")
        checked_aovs("render", wanted, found)  # of what is there for debugging, no more is known before
        pixels = at_size(self.size, found)
        looked_at = {"color": color, "display": display, **pixels}
        color, display = self._black_pictures.watched(looked_at, self.scene, self.settings)
        return Frame(self.size, color, display, pixels, timings, labels, self.device_name)

    @alone
    def labels(self, *, camera: Camera | None = None, aovs: Collection[str] | None = None) -> Frame:
        """What each pixel shows, without any light: AOVs of the G-buffer, for a fraction of what a picture costs.

        They are what `render` gives in the first frame after `reset`, bit for bit, but that motion is since the call
        before. Its colour and display raise PicaError. The next `render` begins a new picture, as after `reset`.
        `camera`, `aovs` and errors as in `render`; PicaError too for AOVs that only a picture has.
        """
        wanted = checked_aovs("labels", aovs, self.gbuffer.aov_names)
        camera = self._default_camera() if camera is None else camera
        with self.device.turn:
            self._frames.rewind()
            frame = self._begin(camera, wait=True, jittered=False)
            self.gbuffer(frame, self.view)
            found = kept(self.device, frame.encoder, chosen(self.gbuffer.aovs(), wanted))
            self._frames.end(frame)
            self._frames.rewind()
            self._drop_histories()
            labels = self.view.name_labels() if found.keys() & NUMBERED else None
            timings = self.device.profiler.flush()
        return Frame(self.size, None, None, at_size(self.size, found), timings, labels, self.device_name)

    def _wanted(self, aovs: Any) -> frozenset[str] | None:
        """The AOVs that `render` is asked for; None for all. Those for debugging are known only after a frame."""
        known = None if self.debug else [name for effect in self.effects for name in effect.aov_names]
        wanted = checked_aovs("render", aovs, known, self.missing_aovs)
        # Pictures without their alpha could not be saved.
        transparent = self.settings.visibility.background == "transparent"
        return wanted | {"alpha"} if transparent and wanted is not None else wanted

    def _default_camera(self) -> Camera:
        return self.scene.default_camera(self.size[0] / self.size[1])

    def _debug_aovs(self) -> dict[str, Aov]:
        """What effects have in between, once the newest frame is submitted: some of it takes passes of its own."""
        return {
            f"debug.{effect.name}.{name}": aov
            for effect in self.effects[1:]
            for name, aov in effect.debug_aovs().items()
        }
