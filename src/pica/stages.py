"""The stages of the frame: made as the settings ask for, and made anew where these or the size change."""

from collections.abc import Set
from dataclasses import fields

from pica.effects.ambient_occlusion.ambient_occlusion import AmbientOcclusion
from pica.effects.antialiasing.antialiasing import Antialiasing
from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.effects.global_illumination.global_illumination import GlobalIllumination
from pica.effects.lighting.lighting import DirectLighting
from pica.effects.post.post import Post
from pica.effects.reflections.reflections import Reflections
from pica.effects.shadow_maps.shadow_maps import ShadowMaps
from pica.effects.shadows.shadows import Shadows
from pica.effects.stochastic_light.stochastic_light import StochasticLightDenoiser
from pica.errors import SettingsError
from pica.frame.arguments import check_made_with
from pica.frame.closing import Closing, alone
from pica.frame.context import FrameSequence, Size
from pica.frame.effect import Effect
from pica.frame.reprojection import Reprojection
from pica.frame.snapshot import checked_size
from pica.gpu_scene.view import SceneView
from pica.light_map.light_map import LightMap
from pica.light_sampling.light_sampler import LightSampler
from pica.light_sampling.light_slots import LightSlots
from pica.programs.preparation import expect as expect_programs
from pica.rhi.device import Device, open_device
from pica.scene.model import Scene
from pica.scene.values import checked, instance, optional
from pica.settings import Settings
from pica.tracing.fallbacks import runnable
from pica.tracing.tracers import choose_tracer

_OPTIONAL: tuple[type[Effect], ...] = Shadows, AmbientOcclusion, GlobalIllumination, Reflections
"""Effects that settings may leave out; ShadowMaps has the name and the AOVs of Shadows."""
_GROUPS = frozenset(field.name for field in fields(Settings))


class Stages(Closing):
    """All that a renderer calls in a frame, and what goes for all stages alike. Parameters as Renderer's."""

    def __init__(
        self,
        scene: Scene,
        size: Size,
        settings: Settings | None,
        device: Device | str | None,
        light_map: LightMap | None,
    ) -> None:
        check_made_with(type(self).__name__, scene, settings, device)
        checked(f"{type(self).__name__}: light_map", optional(instance(LightMap)), light_map)
        if light_map is not None:
            light_map.check_scene(scene)
        self.light_map = light_map
        self._cache: str | None = None
        self.size = checked_size(size)
        super().__init__(open_device(device))
        expect_programs(self.device)
        self.settings = runnable(self.device, settings or Settings())
        self.scene = scene
        with self.device.turn:
            self.view = SceneView(self.device, scene, self.settings)
            self._make(_GROUPS)

    def _make(self, changed: Set[str]) -> None:
        """Make the stages that follow these settings; each with a part of the device, to be dropped with it."""
        device, settings, view = self.device, self.settings, self.view
        filters = settings.debug.filters
        if changed & {"seed", "antialiasing"}:
            self._frames = FrameSequence(device, self.size, settings.seed, settings.antialiasing.upscale)
        size = self.render_size
        if changed == _GROUPS:
            self.reprojection = Reprojection(device.part(), size)
            self._light_sampler = LightSampler(device.part(), size)
            self.stochastic_light = StochasticLightDenoiser(device.part(), size)
        if "rays" in changed:
            self.tracer = choose_tracer(device.part(), settings.rays, view)
        if changed & {"rays", "visibility"}:
            self.gbuffer = GBufferEffect(device.part(), size, settings.visibility.primary, self.tracer)
        if changed & {"shadows", "shadow_maps", "lighting", "reflections", "debug"}:
            self._slots = LightSlots(device.part(), settings)
        if changed & {"rays", "shadows", "shadow_maps"}:
            self.shadows = self._shadows()
        if changed & {"rays", "ambient_occlusion", "debug"}:
            occlusion = settings.ambient_occlusion
            off = occlusion.mode == "off"
            self.ambient_occlusion = (
                None if off else AmbientOcclusion(device.part(), size, occlusion, self.tracer, filters)
            )
        if changed & {"rays", "global_illumination", "debug"}:
            indirect = settings.global_illumination
            off = indirect.mode == "off" or (indirect.mode == "light_map" and self.light_map is None)
            self.global_illumination = (
                None if off else GlobalIllumination(device.part(), size, indirect, self.tracer, self.light_map, filters)
            )
        cache = self.global_illumination.cache if self.global_illumination else None
        if changed & {"rays", "reflections", "debug"} or cache != self._cache:
            off, self._cache = settings.reflections.mode == "off", cache
            self.reflections = (
                None if off else Reflections(device.part(), size, settings.reflections, self.tracer, cache, filters)
            )
        by_rays = settings.reflections.mode == "ray_traced"
        self._light_sampler.expect_hits(
            by_rays or settings.global_illumination.mode in ("path_traced", "restir", "surfels")
        )
        if "lighting" in changed:
            self.lighting = DirectLighting(device.part(), size, settings.lighting)
        if changed & {"antialiasing", "visibility"}:
            transparent = settings.visibility.background == "transparent"
            self.antialiasing = Antialiasing(device.part(), self.size, settings.antialiasing, transparent)
        if "post" in changed:
            self.post = Post(device.part(), self.size, settings.post)
        self._prepared = False

    def _prepare(self) -> None:
        """Make all programs before the first frame that needs some of them; the scene is up to date."""
        if isinstance(self.shadows, Shadows):
            self.shadows.expect(self.view)
        self._light_sampler.expect(self._slots)
        self.view.make_programs()
        self._prepared = True

    def _shadows(self) -> Shadows | ShadowMaps | None:
        settings = self.settings
        if settings.shadows.mode == "off":
            return None
        if settings.shadows.method == "maps":
            return ShadowMaps(self.device.part(), self.render_size, settings)
        return Shadows(self.device.part(), self.render_size, settings.shadows, self.tracer)

    @property
    def effects(self) -> list[Effect]:
        """The stages that the settings ask for, in the order of the frame."""
        every = (
            self.gbuffer,
            self.shadows,
            self.ambient_occlusion,
            self.lighting,
            self.stochastic_light,
            self.global_illumination,
            self.reflections,
            self.antialiasing,
            self.post,
        )
        return [effect for effect in every if effect is not None]

    @property
    def missing_aovs(self) -> dict[str, str]:
        """AOVs of effects that are off, with the effect's name."""
        there = {effect.name for effect in self.effects}
        return {name: effect.name for effect in _OPTIONAL if effect.name not in there for name in effect.aov_names}

    @property
    def render_size(self) -> Size:
        """At which all up to antialiasing works; `size` is that of the pictures."""
        return self._frames.size

    @alone
    def reset(self) -> None:
        """Drop all history: the next frame is frame 0 again, as a new renderer's."""
        self._frames.reset()
        self._drop_histories()

    def _drop_histories(self) -> None:
        self.reprojection.reset()
        for effect in self.effects:
            effect.reset()

    @alone
    def resize(self, size: Size) -> None:
        """Render at another (width, height) from the next frame on, without history. Raises PicaError."""
        self.size = checked_size(size)
        with self.device.turn:
            self._frames.resize(self.size)
            self._light_sampler.resize(self.render_size)
            self.reprojection.resize(self.render_size)
            for effect in self.effects:
                effect.resize(self.size if effect.at_output else self.render_size)

    @alone
    def configure(self, settings: Settings) -> None:
        """Follow other settings from the next frame on. Stages whose settings are the same keep their histories."""
        checked("configure: settings", instance(Settings), settings, SettingsError)
        settings = runnable(self.device, settings)
        with self.device.turn:
            self.view.configure(settings)
            before, self.settings = self.settings, settings
            changed = before.changed_groups(settings)
            if before.antialiasing.upscale != settings.antialiasing.upscale:
                changed = _GROUPS  # all works at another size
            self._make(changed)
        if changed & {"seed", "rays", "visibility", "antialiasing"}:
            self.reset()  # the G-buffer or the camera of the frame before is gone
        elif changed - {"post"}:
            self.antialiasing.reset()
