"""Reflections' rays through the scene, and the lighting of their hits."""

from typing import Any

import numpy as np
import slangpy as spy

from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import PATHS, ray_effect


class TracedRays:
    """A ray for 2x2 pixels along the lobe that the surface mirrors, and one from what it meets to a light."""

    def __init__(
        self,
        device: Device,
        settings: ReflectionsSettings,
        tracer: Tracer | None,
        cache: str | None,
        filters: bool,
    ) -> None:
        """`cache`, `filters`: as Reflections has them."""
        self._filters = filters
        self.bounces = {"bounces": settings.bounces, "indirectBounces": 0}
        """Surfaces that paths may meet, by the names that shaders have for these limits."""
        module = "effects/reflections/ray_traced/reflection_rays.slang"
        self._trace = ray_effect(
            device, module, "ReflectionRays", "surface", tracer, simplified=True, with_module=cache, parts=PATHS
        )
        self._gather = device.compute("effects/reflections/ray_traced/gather_lighting.slang")

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        samples: LightSamples,
        indirect: IndirectResult | None,
        ends: Texture,
        light: Texture,
        mirrors: int,
    ) -> Texture:
        """Trace, and fill `ends` and `light`, textures of half size, as reflected.slang has them; `mirrors` as there.

        `indirect`: None where there is no global illumination. Returns what each ray brought, as `light`, before
        neighbours lend theirs.
        """
        self.bounces["indirectBounces"] = indirect.bounces if indirect else 0
        smooth, half = self._filters, gbuffer.half_blocks(graph)
        met = graph.texture("met", spy.Format.rg32_uint, graph.half_size)
        single = graph.texture("light of single rays", spy.Format.rgba32_uint, graph.half_size) if smooth else light
        known: dict[str, Any] = {
            "arriving": indirect.arriving if indirect else graph.nothing(spy.Format.rgba32_float),
            "arrivingKnown": int(indirect is not None and indirect.known),
        }
        graph.add(
            self._trace,
            graph.half_size,
            **half,
            **self.bounces,
            **known,
            **samples.at_hits(regularized=smooth),
            ends=write(ends),
            light=write(single),
            met=write(met),
            mirrors=mirrors,
            **(indirect.cache.values if indirect and indirect.cache else {}),
        )
        graph.offer(
            "rays.reflection_rays", (ends,), lambda values: int(np.count_nonzero(values[..., 3])), on_request=True
        )
        if smooth:
            rays = {"ends": ends, "met": met, "light": single}
            graph.add(self._gather, graph.half_grid, gathered=write(light), **half, **rays)
        return single
