"""The stages of the frame: made for the settings, and replaced when these change."""

from collections.abc import Set
from dataclasses import fields

from pica.effects.ambient_occlusion.ambient_occlusion import AmbientOcclusion
from pica.effects.antialiasing.antialiasing import Antialiasing
from pica.effects.composite.composite import Composite
from pica.effects.depth_of_field.depth_of_field import DepthOfField
from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.effects.global_illumination.global_illumination import GlobalIllumination
from pica.effects.lighting.lighting import DirectLighting
from pica.effects.motion_blur.motion_blur import MotionBlur
from pica.effects.post.post import Post
from pica.effects.reflections.reflections import Reflections
from pica.effects.shadow_maps.shadow_maps import ShadowMaps
from pica.effects.shadows.shadows import Shadows
from pica.effects.stochastic_light.stochastic_light import StochasticLightDenoiser
from pica.effects.translucency.translucency import Translucency
from pica.effects.transparency.transparency import Transparency
from pica.filtering.reprojection import Reprojection
from pica.frame.effect import Effect
from pica.gpu_scene.view import SceneView
from pica.images.lut import Lut
from pica.light_map.light_map import LightMap
from pica.light_sampling.history_limits import HistoryLimits
from pica.light_sampling.light_sampler import LightSampler
from pica.light_sampling.light_slots import LightSlots
from pica.rhi.device import Device
from pica.settings import Settings
from pica.tracing.fallbacks import say_once
from pica.tracing.ray_buffers import Tracer
from pica.tracing.shared_tracer import SharedTracer
from pica.tracing.tracers import choose_tracer

_OPTIONAL: tuple[type[Effect], ...] = (
    Shadows,
    AmbientOcclusion,
    GlobalIllumination,
    Reflections,
    Transparency,
    Translucency,
)
"""Effects that settings may leave out; ShadowMaps has the name and the AOVs of Shadows."""
EVERY_GROUP = frozenset(field.name for field in fields(Settings))


class Stages:
    """All that a frame is made by. They own passes and pipelines; textures they declare to the graph."""

    def __init__(
        self,
        device: Device,
        settings: Settings,
        view: SceneView,
        light_map: LightMap | None,
        lut: Lut | None,
        leader: "Stages | None" = None,
        shared: SharedTracer | None = None,
    ) -> None:
        """`leader`: of another view of the scene, whose light that no camera influences is theirs too. It follows
        settings, and runs in each frame, before they do. `shared`: traces with the help of other devices."""
        self._device, self._view, self._light_map, self._lut = device, view, light_map, lut
        self._leader, self._shared = leader, shared
        self._cache: str | None = None
        self._glass_layers = -1
        self.reprojection = Reprojection(device)
        self.light_sampler = LightSampler(device.memory_scope())
        self.history_limits = HistoryLimits(device.memory_scope())
        self.stochastic_light = StochasticLightDenoiser(device)
        self.depth_of_field = DepthOfField(device)
        self.shadows: Shadows | ShadowMaps | None = None
        self.ambient_occlusion: AmbientOcclusion | None = None
        self.global_illumination: GlobalIllumination | None = None
        self.reflections: Reflections | None = None
        self.translucency: Translucency | None = None
        self.transparency: Transparency | None = None
        self.motion_blur: MotionBlur | None = None
        self.follow(settings, EVERY_GROUP)

    def follow(self, settings: Settings, changed: Set[str]) -> list[str]:
        """Replace stages that depend on settings of the groups `changed`. Returns the names of new
        effects."""
        device, filters = self._device, settings.debug.filters
        before = self.effects if changed != EVERY_GROUP else []
        if "rays" in changed:
            self.tracer: Tracer | None = self._shared
            if self._shared is None:
                self.tracer = choose_tracer(device.memory_scope(), settings.rays, self._view)
        layers = Transparency.glass_layers(settings.transparency)
        if changed & {"rays", "visibility"} or layers != self._glass_layers:
            self._glass_layers = layers
            self.gbuffer = GBufferEffect(device.memory_scope(), settings.visibility.primary, self.tracer, layers)
        if changed & {"shadows", "shadow_maps", "lighting", "reflections", "debug"}:
            self.slots = LightSlots(device.memory_scope(), settings)
        if changed & {"rays", "shadows", "shadow_maps"}:
            self.shadows = self._shadows(settings)
        if changed & {"rays", "ambient_occlusion", "debug"}:
            occlusion = settings.ambient_occlusion
            off = occlusion.mode == "off"
            self.ambient_occlusion = (
                None if off else AmbientOcclusion(device.memory_scope(), occlusion, self.tracer, filters)
            )
        if changed & {"rays", "global_illumination", "debug"}:
            indirect, light_map = settings.global_illumination, self._light_map
            lacks_map = indirect.mode == "light_map" and light_map is None
            if lacks_map:
                say_once(device, "global_illumination.mode is light_map without a light map: no indirect light")
            off = indirect.mode == "off" or lacks_map
            inputs = indirect, self.tracer, light_map, filters
            self.global_illumination = None if off else GlobalIllumination(device.memory_scope(), *inputs)
        cache = self.global_illumination.cache if self.global_illumination else None
        if changed & {"rays", "reflections", "debug"} or cache != self._cache:
            off = settings.reflections.mode == "off"
            mirrors = settings.reflections, self.tracer, cache, filters
            self.reflections = None if off else Reflections(device.memory_scope(), *mirrors)
        if changed & {"rays", "transparency", "debug"} or cache != self._cache:
            glass = settings.transparency, self.tracer, cache, filters
            off = settings.transparency.mode == "off"
            self.transparency = None if off else Transparency(device.memory_scope(), *glass)
        if changed & {"rays", "translucency"} or cache != self._cache:
            wax = settings.translucency, self.tracer, cache, self._leader.translucency if self._leader else None
            off = settings.translucency.mode == "off"
            self.translucency = None if off else Translucency(device.memory_scope(), *wax)
        self._cache = cache
        by_rays = "ray_traced" in (settings.reflections.mode, settings.transparency.mode)
        by_rays = by_rays or settings.translucency.mode != "off"
        self._traces_hits = by_rays or settings.global_illumination.mode in ("path_traced", "restir", "surfels")
        if "lighting" in changed:
            self.lighting = DirectLighting(device.memory_scope(), settings.lighting)
        transparent = settings.visibility.background == "transparent"
        if "visibility" in changed:
            self.composite = Composite(device.memory_scope(), transparent)
        if changed & {"antialiasing", "visibility"}:
            self.antialiasing = Antialiasing(device.memory_scope(), settings.antialiasing, transparent)
        if "post" in changed:
            shutter = settings.post.shutter
            self.motion_blur = MotionBlur(device.memory_scope(), shutter) if shutter > 0 else None
            self.post = Post(device.memory_scope(), settings.post, self._lut)
        return [effect.name for effect in self.effects if effect not in before]

    def _shadows(self, settings: Settings) -> Shadows | ShadowMaps | None:
        if settings.shadows.mode == "off":
            return None
        if settings.shadows.method == "maps":
            return ShadowMaps(self._device.memory_scope(), settings)
        return Shadows(self._device.memory_scope(), settings.shadows, self.tracer)

    @property
    def lights_hits(self) -> bool:
        """Whether some stage lights points that are not in the G-buffer."""
        return self._traces_hits or (self.transparency is not None and self._view.glass_apart)

    @property
    def effects(self) -> list[Effect]:
        """The active stages, in the order of the frame."""
        every = (
            self.gbuffer,
            self.shadows,
            self.ambient_occlusion,
            self.lighting,
            self.stochastic_light,
            self.global_illumination,
            self.translucency,
            self.reflections,
            self.composite,
            self.transparency,
            self.antialiasing,
            self.depth_of_field,
            self.motion_blur,
            self.post,
        )
        return [effect for effect in every if effect is not None]

    @property
    def missing_aovs(self) -> dict[str, str]:
        """AOVs of effects that are off, with the effect's name."""
        there = {effect.name for effect in self.effects}
        return {name: effect.name for effect in _OPTIONAL if effect.name not in there for name in effect.aov_names}

    def reset(self) -> None:
        """Discard the effects' state of earlier frames on the host."""
        for effect in self.effects:
            effect.reset()
