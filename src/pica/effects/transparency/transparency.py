"""Transmissive surfaces: what is seen through them and in them (RTG 19, 19.3.4)."""

from functools import cached_property

import numpy as np
import slangpy as spy

from pica.frame.effect import Effect, rgb
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import TransparencySettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect


class Transparency(Effect):
    """Paths from the camera through transmissive surfaces, which the G-buffer leaves out."""

    name = "transparency"
    aov_names = ("transmission",)

    def __init__(
        self, device: Device, settings: TransparencySettings, tracer: Tracer | None, cache: str | None, filters: bool
    ) -> None:
        """`cache`: the module of the cache of indirect light, if calls pass one. `filters`: DebugSettings.filters."""
        self._device, self._tracer, self._cache = device, tracer, cache
        self._surfaces, self._filters = settings.surfaces, filters

    @cached_property
    def _trace(self) -> RayEffect:
        """Made for the first scene with transmissive surfaces: others need not compile it."""
        module = "effects/transparency/transparency_rays.slang"
        return ray_effect(self._device, module, "TransparencyRays", "surface", self._tracer, with_module=self._cache)

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        samples: LightSamples,
        indirect: IndirectResult | None,
        radiance: Texture,
    ) -> Texture:
        """`radiance`, complete light towards the camera without transmissive surfaces, with them (width, height,
        rgba32_float, nits; alpha as transparency_rays.slang has it)."""
        with graph.scope(self.name):
            if gbuffer.glass is None:
                graph.offer("transmission", (radiance,), lambda light: np.zeros_like(rgb(light)))
                return radiance
            seen = graph.texture("seen", spy.Format.rgba32_float)
            history = graph.history("moving glass", {"moving": spy.Format.r32_uint})
            moving, state = history.textures["moving"], history.state
            graph.add(
                self._trace,
                graph.size,
                **samples.at_hits(regularized=self._filters),
                glass=gbuffer.glass,
                radiance=radiance,
                seen=write(seen),
                moving=write(moving),
                previousMoving=moving.previous,
                known=lambda frame: int(state.precedes(frame)),
                surfaces=self._surfaces,
                **(indirect.cache.values if indirect and indirect.cache else {}),
            )
            graph.offer("transmission", (seen, radiance), lambda after, before: rgb(after) - rgb(before))
            graph.offer(
                "rays.transparency_rays",
                (gbuffer.glass,),
                lambda glass: int(np.count_nonzero(glass[..., 0])),
                on_request=True,
            )
        return seen
