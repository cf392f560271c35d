"""The whole frame, top to bottom."""

from typing import Any

import slangpy as spy

from pica.denoising.denoiser import Denoise, Denoiser, denoiser_of
from pica.frame.aovs import at_size
from pica.frame.arguments import Progress, check_progress, checked_camera, checked_count
from pica.frame.closing import alone
from pica.frame.context import Size
from pica.frame.effect import Aov, kept
from pica.light_map.light_map import LightMap
from pica.output import Frame
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings
from pica.stages import Stages


class Renderer(Stages):
    """The hybrid renderer: one frame a call from about one ray per pixel and effect.

    `size`: (width, height) in pixels. `device`: a Device, part of a device's name, or None for the best there is. On
    one without ray tracing, stages that need it fall back, each with a warning (docs/tiers.md); `settings` tells how.
    `light_map`: for global_illumination.mode "light_map", which the preset "raster" has; paths end in it too.
    Raises DeviceError without a usable device, SceneError for a scene that cannot be shown or that is not the light
    map's, and PicaError for an impossible size.
    """

    def __init__(
        self,
        scene: Scene,
        size: Size = (1280, 720),
        settings: Settings | None = None,
        device: Device | str | None = None,
        light_map: LightMap | None = None,
    ) -> None:
        super().__init__(scene, size, settings, device, light_map)
        self.effect_inputs: dict[str, Any] = {}
        """What the effects of the newest frame were given, by the names that shaders have for it."""
        self.debug = False
        """Whether `render` also keeps what effects have in between, as AOVs whose names begin with "debug."."""
        self._running = False

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
            self._advance(self.scene.default_camera(self.size[0] / self.size[1]), wait=True)
        self.reset()
        self._running = False

    @alone
    def advance(self, camera: Camera, jittered: bool = True) -> dict[str, spy.Texture]:
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
    ) -> dict[str, spy.Texture]:
        self.check_open()  # what is called after each frame may close it
        camera = checked_camera("render", camera)
        scene, slots = self.view, self._slots
        scene.admit(wait)
        self._running = True
        frame = self._frames.begin(camera, jittered)
        frame.changed |= scene.update(frame, camera)
        frame.changed_lights = scene.lights_changed
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
        display = self.post(frame, picture)
        self._frames.end(frame)
        return {**gbuffer.textures, "color": picture, "display": display}

    @alone
    def render(
        self,
        frames: int = 16,
        camera: Camera | None = None,
        progress: Progress | None = None,
        denoise: Denoise = False,
    ) -> Frame:
        """Render `frames` frames and return the last, which holds the mean of all since something moved.

        All that is in the scene is shown: material types that are new are compiled before the frame that meets them.
        The G-buffer's AOVs are those of the first of these frames, when motion is that since the call before.
        `camera` None takes the scene's first, or one that shows the whole scene. `progress(done, frames)` is called
        after each frame. `denoise`: as PathTracer's, at the end. Raises SceneError for what cannot be shown as it is
        now: in each call, until it is mended.
        """
        frames = checked_count("render: frames", frames)
        check_progress("render", progress)
        denoiser = denoiser_of(self.device, self.size, denoise)
        if camera is None:
            camera = self.scene.default_camera(self.size[0] / self.size[1])
        for done in range(1, frames + 1):
            with self.device.turn:
                buffers = self._advance(camera, wait=True, denoiser=denoiser, last=done == frames)
                if done == 1:
                    seen = kept(self.device, self.gbuffer.aovs())
                if done == frames:
                    pictures = {n: Aov((buffers[n],), lambda values: values[..., :3]) for n in ("color", "display")}
                    found = kept(self.device, {**pictures, **self._last_aovs()})
                    timings = self.device.profiler.flush()
            if progress is not None:
                progress(done, frames)
        return Frame(found.pop("color"), found.pop("display"), at_size(self.size, seen | found), timings)

    def _last_aovs(self) -> dict[str, Aov]:
        """What the effects after the G-buffer show of the newest frame."""
        found: dict[str, Aov] = {}
        for effect in self.effects[1:]:
            found |= effect.aovs()
            if self.debug:
                found |= {f"debug.{effect.name}.{name}": aov for name, aov in effect.debug_aovs().items()}
        return found
