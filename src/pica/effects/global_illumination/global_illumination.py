"""Diffuse global illumination: one effect, several ways to the same buffer."""

import slangpy as spy

from pica.effects.global_illumination.light_map_indirect import LightMapIndirect
from pica.effects.global_illumination.path_traced import PathTracedIndirect
from pica.effects.global_illumination.surfels import SurfelIndirect
from pica.effects.global_illumination.views import arriving_views, color
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.frame.indirect import IndirectLight
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.light_map.light_map import LightMap
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import GlobalIlluminationSettings
from pica.tracing.ray_buffers import Tracer


class GlobalIllumination(Effect):
    """Adds the light that surfaces reflect diffusely of other lit surfaces."""

    name = "global_illumination"
    aov_names = ("indirect",)

    def __init__(
        self,
        device: Device,
        size: Size,
        settings: GlobalIlluminationSettings,
        tracer: Tracer | None,
        light_map: LightMap | None,
        filters: bool,
    ) -> None:
        """`filters`: DebugSettings.filters."""
        self._device, self._bounces = device, settings.bounces
        self._way: PathTracedIndirect | SurfelIndirect | LightMapIndirect
        if settings.mode in ("path_traced", "restir"):
            self._way = PathTracedIndirect(device, size, settings, tracer, light_map, filters)
        elif settings.mode == "surfels":
            self._way = SurfelIndirect(device, size, settings, tracer)
        else:
            assert light_map is not None
            self._way = LightMapIndirect(device, light_map)
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        made = {"indirect": "indirect light", "arriving": "indirect light over albedo"}
        self._pictures = {
            name: self._device.texture(label, spy.Format.rgba32_float, size) for name, label in made.items()
        }

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(*self._pictures.values())
        self._allocate(size)
        self._way.resize(size)

    def reset(self) -> None:
        """Drop the history, or the surfels."""
        self._way.reset()

    def aovs(self) -> dict[str, Aov]:
        """indirect: (height, width, 3) the light that surfaces reflect diffusely of others, in nits."""
        return {"indirect": Aov((self._pictures["indirect"],), color)}

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py."""
        return {**arriving_views(self._pictures["arriving"]), **self._way.debug_aovs()}

    def reference(self) -> Reference:
        """The same by many paths."""
        inputs = "frame", "gbuffer", "scene"
        layers = {"indirect": ReferenceLayer(self.aovs()["indirect"], {"bounces": self._way.bounces})}
        return Reference("path_tracer/indirect_light.slang", "IndirectLight", "surface", inputs, layers, is_light=True)

    @property
    def cache(self) -> str | None:
        """The module of the cache that its light comes with; see frame/indirect.py."""
        return self._way.cache.module if self._way.cache else None

    def ray_counts(self) -> dict[str, int]:
        """First rays of the paths; those to lights are as many at most, and more where paths go on."""
        return self._way.ray_counts()

    def surfel_count(self) -> int:
        """How many surfels are in use. Waits for the device."""
        return self._way.count() if isinstance(self._way, SurfelIndirect) else 0

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        reprojection: Reprojection,
        occlusion: spy.Texture | None,
        exposure: spy.Buffer,
        radiance: spy.Texture,
    ) -> IndirectLight:
        """Add what this frame's surfaces reflect diffusely of others to `radiance`.

        For surfels and light maps, `occlusion`: of the screen, None or detail finer than they are. For surfels,
        `exposure`: a float, what one nit was shown as in the frame before.
        """
        pictures = {**self._pictures, "radiance": radiance}
        if isinstance(self._way, SurfelIndirect):
            self._way(frame, gbuffer, scene, light, occlusion, exposure, pictures)
        elif isinstance(self._way, LightMapIndirect):
            self._way(frame, gbuffer, scene, occlusion, pictures)
        else:
            self._way(frame, gbuffer, scene, light, reprojection, pictures)
        return IndirectLight(self._pictures["arriving"], self._way.is_smooth, self._bounces, self._way.cache)
