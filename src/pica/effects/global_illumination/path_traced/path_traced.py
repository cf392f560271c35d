"""Indirect light by paths from the pixels, a quarter a pixel, and a filter (RTG 19, 19.3.3.3 and 19.3.3.4)."""

import numpy as np
import slangpy as spy

from pica.effects.global_illumination.debug_aovs import offer_filter_aovs, offer_ray_aovs
from pica.effects.global_illumination.path_traced.path_resampling import PathResampling
from pica.effects.global_illumination.radiance_cache.radiance_cache import RadianceCache
from pica.filtering.accumulation import accumulate_grid
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import ENDLESS, IndirectCache, IndirectPictures
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, History, Texture, update, write
from pica.light_map.gpu_light_map import GpuLightMap, light_map_cache
from pica.light_map.light_map import LightMap
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import GlobalIlluminationSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ENDED_PATHS, ray_effect

_FOLDER = "effects/global_illumination/path_traced"
_LIGHT = spy.Format.rgba32_float
_GRADIENT = spy.Format.rg32_uint
_TILE = 8
"""change_tiles.slang: TILE."""
_EARLY = 16
"""irradiance_gather.slang: EARLY."""


class PathTracedIndirect:
    """Indirect light by paths from the pixels; with the mode `restir` each is chosen from many."""

    def __init__(
        self,
        device: Device,
        settings: GlobalIlluminationSettings,
        tracer: Tracer | None,
        light_map: LightMap | None,
        filters: bool,
    ) -> None:
        """`filters`: DebugSettings.filters."""
        self._settings = settings
        self.is_smooth = filters
        """Whether the light in each pixel is the mean of many rays."""
        self._asks_picture = filters and settings.bounces > 1
        self.bounces = ENDLESS if self._asks_picture else settings.bounces
        asks_map = light_map is not None and self._asks_picture
        self.radiance_cache: RadianceCache | None = None
        if light_map and asks_map:
            self.cache: IndirectCache | None = light_map_cache(GpuLightMap(device, light_map))
        else:
            self.radiance_cache = RadianceCache(device, tracer) if self._asks_picture else None
            self.cache = self.radiance_cache.lookups if self.radiance_cache else None
        module, cache = f"{_FOLDER}/indirect_rays.slang", self.cache.module if self.cache else None
        parts = ENDED_PATHS if settings.bounces > 1 else ()
        self._trace = ray_effect(device, module, "IndirectRays", "surface", tracer, True, cache, parts=parts)
        self._gather = device.compute(f"{_FOLDER}/irradiance_gather.slang")
        self._widen = device.compute(f"{_FOLDER}/irradiance_atrous.slang")
        self._compare = device.compute(f"{_FOLDER}/irradiance_change.slang")
        self._accumulate = device.compute(f"{_FOLDER}/irradiance_history.slang")
        self._filter = programs(device).compute(f"{_FOLDER}/irradiance_filter.slang")
        self._resampling = PathResampling(device, tracer) if settings.mode == "restir" else None

    def reset(self) -> None:
        """Discard the radiance cache."""
        if self.radiance_cache is not None:
            self.radiance_cache.reset()

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        light: LightSamples,
        exposure: Buffer,
        pictures: IndirectPictures,
    ) -> Texture | None:
        """Fill the pictures. Returns IndirectResult.paths."""
        if self.radiance_cache is not None:
            self.radiance_cache(graph, light, exposure)
        history = graph.history("indirect light", {"history": spy.Format.rgba32_uint}, layers=1)
        found, directions = self._found(graph, gbuffer, light, history)
        signal, gradients = graph.nothing(_LIGHT), graph.nothing(_GRADIENT)
        if self.is_smooth:
            signal, gradients = self._smooth(graph, gbuffer, found, directions, history)
        graph.add(
            self._filter,
            graph.grid,
            found=found,
            signal=signal,
            gradients=gradients,
            smooth=int(self.is_smooth),
            **pictures.arguments(),
        )
        return None if self._resampling else found

    def _found(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        light: LightSamples,
        history: History,
    ) -> tuple[Texture, Texture]:
        """Of half size, as indirect_rays.slang has them: the light of a path for 2x2 pixels, and its direction."""
        state, resamples = history.state, self._resampling is not None
        found = graph.texture("found", _LIGHT, graph.half_size)
        directions = graph.texture("directions", spy.Format.r32_uint, graph.half_size)
        met = graph.texture("met", spy.Format.rg32_uint, graph.half_size if resamples else (1, 1))
        asks = self._asks_picture
        graph.add(
            self._trace,
            graph.half_size,
            **gbuffer.half_blocks(graph),
            bounces=self._settings.bounces,
            previousHistory=history["history"].previous if self.is_smooth else graph.nothing(spy.Format.rgba32_uint, 1),
            known=lambda frame: int(asks and state.precedes(frame)),
            **light.at_hits(regularized=self.is_smooth),
            resampled=int(resamples),
            found=write(found),
            directions=write(directions),
            met=write(met),
            **(self.cache.values if self.cache else {}),
        )
        if self._resampling is not None:
            self._resampling(graph, gbuffer, found, directions, met)
        offer_ray_aovs(graph, found)
        graph.offer(
            "rays.indirect_rays", (found,), lambda values: int(np.count_nonzero(values[..., 3])), on_request=True
        )
        return found, directions

    def _smooth(
        self, graph: FrameGraph, gbuffer: GBuffer, found: Texture, directions: Texture, history: History
    ) -> tuple[Texture, Texture]:
        """Over neighbours' rays and earlier frames: the signal, and its gradients (irradiance_gradient.slang)."""
        half = gbuffer.half_blocks(graph)
        gathered = graph.texture("gathered", _LIGHT, graph.half_size)
        widened = graph.texture("widened", _LIGHT, graph.half_size)
        gradients = graph.texture("gradients", _GRADIENT, graph.half_size)
        tiles = -(-graph.size[0] // _TILE), -(-graph.size[1] // _TILE)
        changes = graph.texture("changes", _LIGHT, tiles)
        signal = graph.texture("signal", _LIGHT)
        written = {"gathered": write(gathered), "gradients": write(gradients)}
        dominant = graph.buffer("dominant rays", data=np.zeros(_EARLY, np.uint32))
        graph.add(
            self._gather,
            graph.half_grid,
            found=found,
            directions=directions,
            dominant=update(dominant),
            **half,
            **written,
        )
        graph.add(self._widen, graph.half_grid, gathered=gathered, gradients=gradients, widened=write(widened), **half)
        graph.add(
            self._compare,
            (*tiles, 1),
            gathered=widened,
            changes=write(changes),
            known=lambda frame: int(history.state.precedes(frame)),
            previousHistory=history["history"].previous,
        )
        graph.add(
            self._accumulate,
            accumulate_grid(graph.size),
            gathered=widened,
            gradients=gradients,
            changes=changes,
            signal=write(signal),
            known=history.known,
            **history.swap(),
        )
        offer_filter_aovs(graph, gathered, gradients, signal, history["history"])
        return signal, gradients
