"""The whole frame, top to bottom."""

from collections.abc import Callable
from typing import Any

import slangpy as spy

from pica.effects.ambient_occlusion.ambient_occlusion import AmbientOcclusion
from pica.effects.ambient_occlusion.views import occlusion_views, open_share
from pica.effects.antialiasing.accumulate import Accumulation
from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.effects.lighting.light_slots import LightSlots
from pica.effects.lighting.lighting import DirectLighting
from pica.effects.post.post import Post
from pica.effects.shadows.shadow_maps import ShadowMaps
from pica.effects.shadows.shadows import Shadows, visibility_layers
from pica.effects.shadows.views import shadow_views
from pica.effects.shared_light.shared_light import SharedLight
from pica.effects.shared_light.views import shared_light_views
from pica.frame.aovs import gbuffer_aovs
from pica.frame.context import FrameSequence, Size
from pica.frame.snapshot import checked_size, copies, rgb
from pica.gpu_scene.scene import GpuScene
from pica.output import Frame
from pica.rhi.device import Device
from pica.rhi.schedulers import Tracer
from pica.rhi.tracers import choose_tracer
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings

Progress = Callable[[int, int], None]


class Renderer:
    """The hybrid renderer: one frame a call from about one ray per pixel and effect.

    `size`: (width, height) in pixels. `device`: a Device, part of a device's name, or None for the best there is.
    Raises DeviceError without a usable device and PicaError for an impossible size.
    """

    def __init__(
        self,
        scene: Scene,
        size: Size = (1280, 720),
        settings: Settings | None = None,
        device: Device | str | None = None,
    ) -> None:
        self.size = size = checked_size(size)
        self.settings = settings = settings or Settings()
        self.device = device = device if isinstance(device, Device) else Device(device)
        self.scene = scene
        self._gpu_scene = GpuScene(device, scene, settings.geometry.rebuild_at, settings.shadows.transparent)
        self.tracer = tracer = choose_tracer(device, settings.rays, self._gpu_scene)
        self._slots = LightSlots(device, size, settings)
        self._frames = FrameSequence(device, size, settings.seed)
        self.gbuffer = GBufferEffect(device, size, settings.visibility.primary, tracer)
        self.shadows = self._make_shadows(tracer) if settings.shadows.mode != "off" else None
        occlusion = settings.ambient_occlusion
        self.ambient_occlusion = AmbientOcclusion(device, size, occlusion, tracer) if occlusion.mode != "off" else None
        self.lighting = DirectLighting(device, size, self._gpu_scene, settings.lighting)
        self.shared_light: SharedLight | None = None
        """Made when there is noisy light for the first time."""
        self.antialiasing = Accumulation(device, size)
        self.post = Post(device, size, settings.post)
        self.seen: dict[str, Any] = {}
        """What the effects of the newest frame were given, by the names that shaders have for it."""
        self.debug = False
        """Whether `render` also keeps what effects have in between, as AOVs whose names begin with "debug."."""
        self._running = False

    def _make_shadows(self, tracer: Tracer | None) -> Shadows | ShadowMaps:
        if self.settings.shadows.method == "maps":
            return ShadowMaps(self.device, self.size, self.settings)
        return Shadows(self.device, self.size, self.settings.shadows, tracer)

    @property
    def device_name(self) -> str:
        """The adapter that renders."""
        return self.device.name

    def reset(self) -> None:
        """Drop all history: the next frame is frame 0 again."""
        self._frames.reset()
        self.antialiasing.reset()
        if self.shadows:
            self.shadows.reset()
        if self.ambient_occlusion:
            self.ambient_occlusion.reset()
        if self.shared_light:
            self.shared_light.reset()

    def advance(self, camera: Camera, jittered: bool = True) -> dict[str, spy.Texture]:
        """Record and submit one frame. Returns its buffers, which the next frame overwrites.

        `jittered`: False looks through the pixels' centres in every frame, which tells effects and antialiasing apart.
        After the first frame, material types that come or are replaced are compiled in the background: until they are
        ready, objects of new types are not shown, and those of replaced ones as they were. Raises MaterialTypeError,
        once, for a type with a fault; the next call goes on without it.
        """
        return self._advance(camera, not self._running, jittered)

    @property
    def pending_shaders(self) -> int:
        """How many shader programs are still to be made, as of the newest frame, for material types that came."""
        return self._gpu_scene.pending_programs

    def _advance(self, camera: Camera, wait: bool, jittered: bool = True) -> dict[str, spy.Texture]:
        scene = self._gpu_scene
        scene.admit(wait, camera)
        self._running = True
        frame = self._frames.begin(camera, jittered)
        moved = scene.update(frame) or frame.camera_moved
        self._slots.update(scene.lights)
        gbuffer = self.gbuffer(frame, scene)
        self._slots.choose(frame, gbuffer, scene)
        self.seen = {"frame": frame, "gbuffer": gbuffer, "scene": scene, "lightSlots": self._slots}
        shadows = self.shadows(frame, gbuffer, scene, self._slots, moved) if self.shadows else None
        occlusion = self.ambient_occlusion(frame, gbuffer, scene, moved) if self.ambient_occlusion else None
        shared = self._shared_light()
        noisy = shared.samples if shared else None
        radiance = self.lighting(frame, gbuffer, scene, self._slots, shadows, occlusion, noisy)
        if shared:
            shared(frame, gbuffer, scene, radiance, moved)
        picture = self.antialiasing(frame, radiance, moved)
        display = self.post(frame, picture)
        self._frames.end(frame)
        buffers = {**gbuffer.textures, "color": picture, "display": display}
        effects = {"shadows": shadows.bits if shadows else None, "ambient_occlusion": occlusion}
        return buffers | {name: texture for name, texture in effects.items() if texture is not None}

    def _shared_light(self) -> SharedLight | None:
        """The filter of noisy light, where there is such light."""
        if not self._slots.noisy:
            if self.shared_light:
                self.shared_light.reset()
            return None
        self.shared_light = self.shared_light or SharedLight(self.device, self.size)
        return self.shared_light

    @property
    def single_lights(self) -> list[str]:
        """Names of the lights that have a shadow ray of their own, strongest first."""
        return self._slots.single_lights

    @property
    def host_seconds(self) -> float:
        """What the newest frame took the host to record and submit."""
        return self._frames.host_seconds

    def render(self, frames: int = 16, camera: Camera | None = None, progress: Progress | None = None) -> Frame:
        """Render `frames` frames and return the last, which holds the mean of all since something moved.

        All that is in the scene is shown: material types that are new are compiled before the frame that meets them.
        The G-buffer's AOVs are those of the first of these frames, when motion is that since the call before.
        `camera` None takes the scene's first, or one that shows the whole scene. `progress(done, frames)` is called
        after each frame.
        """
        camera = camera or self.scene.default_camera(self.size[0] / self.size[1])
        for done in range(max(frames, 1)):
            buffers = self._advance(camera, wait=True)
            if done == 0:
                seen = copies(self.device, {name: buffers[name] for name in self.gbuffer.names})
            if progress is not None:
                progress(done + 1, frames)
        kept = copies(self.device, {name: buffers[name] for name in buffers if name not in seen})
        aovs = gbuffer_aovs(seen, self._gpu_scene, camera)
        if "shadows" in kept:
            aovs["shadows"] = lambda: visibility_layers(kept["shadows"].to_numpy(), self._slots.count)
        if "ambient_occlusion" in kept:
            aovs["ambient_occlusion"] = lambda: open_share(kept["ambient_occlusion"])
        if self.debug and self.shadows and (views := self.shadows.debug_views()):
            aovs |= shadow_views(copies(self.device, views), self._slots.svgf)
        if self.debug and self.ambient_occlusion:
            aovs |= occlusion_views(copies(self.device, self.ambient_occlusion.debug_views()))
        if self.debug and self.shared_light:
            aovs |= shared_light_views(copies(self.device, self.shared_light.debug_views()))
        return Frame(
            color=lambda: rgb(kept["color"]),
            display=lambda: rgb(kept["display"]),
            aovs=aovs,
            timings=self.device.profiler.flush(),
        )
