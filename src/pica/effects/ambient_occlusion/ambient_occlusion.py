"""Ambient occlusion by rays or in screen space."""

import numpy as np
import slangpy as spy

from pica.effects.ambient_occlusion.debug_aovs import offer_occlusion_aovs, unoccluded
from pica.effects.ambient_occlusion.filter import HorizonFilter, RayFilter
from pica.filtering.accumulation import accumulate_grid
from pica.frame.effect import Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.rhi.device import Device
from pica.settings import AmbientOcclusionSettings
from pica.tracing.many_samples import ManySamples
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/ambient_occlusion"


class AmbientOcclusion(Effect):
    """Visibility of the cosine-weighted hemisphere about the shading normal between min_distance and
    max_distance (RTG 25, 25.2.3): a texture (width, height) whose red channel is from 0 to 1; 1 without a
    surface.
    """

    name = "ambient_occlusion"
    aov_names = ("ambient_occlusion",)

    def __init__(
        self, device: Device, settings: AmbientOcclusionSettings, tracer: Tracer | None, filters: bool
    ) -> None:
        """`filters`: DebugSettings.filters."""
        self._settings, self._filters = settings, filters
        self._trace = self._search = None
        self._filter: RayFilter | HorizonFilter | None = None
        if settings.mode == "ray_traced":
            self._trace = ray_effect(device, f"{_FOLDER}/occlusion_rays.slang", "OcclusionRays", "hit", tracer)
            self._filter = RayFilter(device, settings.rays, settings.max_distance) if filters else None
        else:
            self._search = device.compute(f"{_FOLDER}/horizons.slang")
            self._filter = HorizonFilter(device) if filters else None
        self._lengths = {"minDistance": settings.min_distance, "maxDistance": settings.max_distance}
        reference = f"{_FOLDER}/occlusion_reference.slang"
        self._by_many_rays = ManySamples(device, reference, "AmbientVisibility", "hit", tracer)

    def reference(self) -> Reference:
        """Visibility by many rays."""
        layers = {"open": ReferenceLayer(self.name, self._lengths)}
        inputs = "frame", "gbuffer", "scene"
        return Reference(self._by_many_rays, inputs, layers)

    def __call__(self, graph: FrameGraph, gbuffer: GBuffer) -> Texture:
        """Visibility for this frame's G-buffer."""
        with graph.scope(self.name):
            raw = graph.texture("raw", spy.Format.rg16_float)
            shared = {"occlusion": write(raw), **self._lengths}
            rays = self._settings.rays
            if self._trace is not None:
                graph.add(self._trace, graph.size, rayCount=rays, **shared)
                depth = gbuffer.textures["depth"]
                graph.offer(
                    "rays.occlusion_rays", (depth,), lambda depth: int(np.count_nonzero(depth)) * rays, on_request=True
                )
            if self._search is not None:
                graph.add(self._search, accumulate_grid(graph.size), averaged=int(self._filters), **shared)
            graph.offer("debug.ambient_occlusion.raw", (raw,), unoccluded)
            if self._filter is None:
                graph.offer(self.name, (raw,), unoccluded)
                return raw
            history, occlusion = self._filter(graph, raw)
            offer_occlusion_aovs(graph, history, occlusion)
            graph.offer(self.name, (occlusion,), unoccluded)
        return occlusion
