"""Light that passes surfaces diffusely: through sheets, and through solids that scatter it (RTG 25, 25.2.5)."""

from functools import cached_property
from typing import Any

import numpy as np
import slangpy as spy

from pica.filtering.accumulation import accumulate_grid
from pica.filtering.convergence import COMPLETE_FROM
from pica.frame.aovs import light_of
from pica.frame.effect import Effect
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.frame.signals.light import SIGNAL
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Texture, update, write
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device
from pica.scene.material import Material
from pica.settings import TranslucencySettings
from pica.texture_space.map_paths import MapLight, MapPaths
from pica.texture_space.texture_maps import MappedKind
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect

_FOLDER = "effects/translucency"
_ESTIMATOR = 48
"""Bytes: multiscale_mean.slang."""
_WALK = 48
"""Bytes: PausedWalk in subsurface_path.slang."""


def _look(material: Material) -> tuple[object, ...]:
    medium = material.scattering, material.absorption, material.scatter_anisotropy, material.thin_walled
    textures = material.diffuse_transmission_texture, material.diffuse_transmission_color_texture
    return *medium, material.diffuse_transmission, material.diffuse_transmission_color, *map(id, textures)


_SOLIDS = MappedKind(
    has_light=Material.passes_diffusely,
    is_mapped=lambda material: material.passes_diffusely() and not material.thin_walled,
    look=_look,
)


class Translucency(Effect):
    """Paths below surfaces with diffuse transmission, from the texels of their maps."""

    name = "translucency"
    aov_names = ("subsurface",)

    def __init__(
        self,
        device: Device,
        settings: TranslucencySettings,
        tracer: Tracer | None,
        cache: str | None,
        source: "Translucency | None" = None,
    ) -> None:
        """`cache`: the module of the cache of indirect light, if calls pass one. `source`: of another view of the scene
        with the same settings, which keeps the maps of both: light below surfaces does not depend on the camera."""
        self._device, self._settings, self._tracer, self._cache = device, settings, tracer, cache
        self._source = source
        self._light: MapLight | None = None

    @cached_property
    def _paths(self) -> MapPaths:
        """Made for the first scene that has any."""
        if self._source is not None:
            return self._source._paths
        return MapPaths(self._device, _SOLIDS, self._settings.map_size, self._settings.interval)

    @cached_property
    def _trace(self) -> RayEffect:
        module = f"{_FOLDER}/map_rays.slang"
        return ray_effect(self._device, module, "MapRays", "surface", self._tracer, True, with_module=self._cache)

    @cached_property
    def _trace_screen(self) -> RayEffect:
        module = f"{_FOLDER}/screen_rays.slang"
        return ray_effect(self._device, module, "ScreenRays", "surface", self._tracer, True, with_module=self._cache)

    @cached_property
    def _accumulate(self) -> MaterialPass:
        return programs(self._device).compute(f"{_FOLDER}/screen_history.slang")

    @cached_property
    def _look_up(self) -> MaterialPass:
        return programs(self._device).compute(f"{_FOLDER}/map_lookup.slang")

    @cached_property
    def _apply(self) -> MaterialPass:
        return programs(self._device).compute(f"{_FOLDER}/translucency_apply.slang")

    def reset(self) -> None:
        """Forget the maps' light."""
        if "_paths" in self.__dict__ and self._source is None:
            self._paths.reset()

    def works_by_pixel(self, scene: SceneView) -> bool:
        """Whether paths are needed for surfaces without a map: the frame is declared again when it changes."""
        without = "_paths" in self.__dict__ and self._paths.maps.leaves_out
        return scene.translucent and (self._settings.mode == "screen_space" or scene.sheets or without)

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        scene: SceneView,
        samples: LightSamples,
        indirect: IndirectResult | None,
        exposure: Buffer,
    ) -> Texture | None:
        """Light towards the camera, as frame/signals/light.py has it; None if the scene has no such surfaces."""
        with graph.scope(self.name):
            if not scene.translucent:
                graph.offer("subsurface", (gbuffer.textures["depth"],), lambda depth: np.zeros((*depth.shape[:2], 3)))
                return None
            path = {
                **samples.at_hits(regularized=True),
                "scatterings": self._settings.scatterings,
                **(indirect.cache.values if indirect and indirect.cache else {}),
            }
            if self._source is None:
                self._trace_maps(graph, scene, path, exposure)
            else:
                graph.provide(textureMaps=self._paths.maps)
            signal = graph.texture("signal", spy.Format.rgba32_float)
            by_pixel = self.works_by_pixel(scene)
            if by_pixel:
                self._trace_pixels(graph, path, signal)
            reflected = graph.texture("light", SIGNAL)
            graph.add(
                self._look_up,
                graph.grid,
                signal=update(signal) if by_pixel else write(signal),
                **self._looked_up(),
            )
            graph.add(self._apply, graph.grid, signal=signal, reflected=write(reflected))
            graph.offer("subsurface", (reflected,), light_of)
        return reflected

    def _trace_maps(self, graph: FrameGraph, scene: SceneView, path: dict[str, Any], exposure: Buffer) -> None:
        """Trace paths from texels of the maps."""
        paths, side = self._paths, self._paths.maps.side
        paths.follow(graph, scene, self._settings.mode == "texture_space")
        self._light = light = paths.light(graph)
        drift = graph.history("drift", {"drift": spy.Format.r32_float}, (side, side)).textures["drift"]
        paused = graph.buffer("paused walks", _WALK * side * side, struct_size=_WALK)
        of_texels = {
            "paused": update(paused),
            "drift": write(drift),
            "previousDrift": drift.previous,
            "exposure": exposure,
            "settled": lambda frame: int(paths.unchanged(frame) > COMPLETE_FROM),
        }
        paths.trace(graph, light, self._trace, "map_rays", _ESTIMATOR, **path, **of_texels)
        graph.offer("debug.translucency.maps", (light.texels,), lambda values: values[..., :3], on_request=True)

    def _looked_up(self) -> dict[str, Any]:
        """The maps as inputs of map_lookup.slang."""
        if self._source is None:
            light = self.light_of_maps()
            return {"light": light.texels, "lastSeen": update(light.last_seen), "number": light.number}
        of_source = self._source.light_of_maps
        return {
            "light": lambda frame: of_source().texels.physical,
            "lastSeen": lambda frame: of_source().last_seen.physical,
            "number": lambda frame: of_source().number(frame),
        }

    def light_of_maps(self) -> MapLight:
        """Of the newest frame that was declared."""
        assert self._light is not None
        return self._light

    def _trace_pixels(self, graph: FrameGraph, path: dict[str, Any], signal: Texture) -> None:
        """Fill `signal`, as screen_history.slang has it, with light that passes surfaces without a map."""
        samples = graph.texture("samples", spy.Format.rgba32_float)
        history = graph.history("history", {"history": spy.Format.rgba32_uint}, layers=1)
        graph.add(self._trace_screen, graph.size, **path, samples=write(samples))
        graph.add(
            self._accumulate,
            accumulate_grid(graph.size),
            samples=samples,
            signal=write(signal),
            known=history.known,
            **history.swap(),
        )
