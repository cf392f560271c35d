"""Diffuse global illumination: one effect, several ways to the same buffer."""

import slangpy as spy

from pica.effects.global_illumination.debug_aovs import offer_irradiance_aovs
from pica.effects.global_illumination.light_map.light_map_indirect import LightMapIndirect
from pica.effects.global_illumination.path_traced.path_traced import PathTracedIndirect
from pica.effects.global_illumination.surfels.surfels import SurfelIndirect
from pica.frame.aovs import light_of
from pica.frame.effect import Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectPictures, IndirectResult
from pica.frame.signals.light import SIGNAL
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Texture
from pica.light_map.light_map import LightMap
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import GlobalIlluminationSettings
from pica.tracing.many_samples import ManySamples
from pica.tracing.ray_buffers import Tracer

_REFERENCE = "effects/global_illumination/indirect_reference.slang"


class GlobalIllumination(Effect):
    """The light that surfaces reflect diffusely of other lit surfaces."""

    name = "global_illumination"
    aov_names = ("diffuse_indirect",)

    def __init__(
        self,
        device: Device,
        settings: GlobalIlluminationSettings,
        tracer: Tracer | None,
        light_map: LightMap | None,
        filters: bool,
    ) -> None:
        """`filters`: DebugSettings.filters."""
        self._bounces = settings.bounces
        self._way: PathTracedIndirect | SurfelIndirect | LightMapIndirect
        if settings.mode in ("path_traced", "restir"):
            self._way = PathTracedIndirect(device, settings, tracer, light_map, filters)
        elif settings.mode == "surfels":
            self._way = SurfelIndirect(device, settings, tracer)
        else:
            assert light_map is not None
            self._way = LightMapIndirect(device, light_map)
        self._by_many_paths = ManySamples(device, _REFERENCE, "IndirectLight", "surface", tracer, is_light=True)

    def reset(self) -> None:
        """Discard the surfels."""
        self._way.reset()

    def reference(self) -> Reference:
        """The same by many paths."""
        inputs = "frame", "gbuffer", "scene"
        layers = {"diffuse_indirect": ReferenceLayer("diffuse_indirect", {"bounces": self._way.bounces})}
        return Reference(self._by_many_paths, inputs, layers)

    @property
    def cache(self) -> str | None:
        """The module of the cache of indirect light; see frame/signals/indirect.py."""
        return self._way.cache.module if self._way.cache else None

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        occlusion: Texture | None,
        exposure: Buffer,
    ) -> IndirectResult:
        """The diffuse indirect light of this frame's surfaces.

        For surfels and light maps, `occlusion`: screen-space visibility, finer than they are, or None. For surfels,
        `exposure`: a float, the displayed value of one nit in the previous frame.
        """
        with graph.scope(self.name):
            arriving = graph.texture("arriving", spy.Format.rgba32_float)
            paths: Texture | None = None
            pictures = IndirectPictures(arriving, graph.texture("reflected", SIGNAL))
            if isinstance(self._way, SurfelIndirect):
                self._way(graph, gbuffer, scene, light, occlusion, exposure, pictures)
            elif isinstance(self._way, LightMapIndirect):
                self._way(graph, occlusion, pictures)
            else:
                paths = self._way(graph, gbuffer, light, exposure, pictures)
            graph.offer("diffuse_indirect", (pictures.reflected,), light_of)
            offer_irradiance_aovs(graph, arriving)
        known, cache = self._way.is_smooth, self._way.cache
        return IndirectResult(arriving, pictures.reflected, known, self._bounces, paths, cache)
