"""Reflections' rays through the scene, and the lighting of their hits."""

from typing import Any

import numpy as np
import slangpy as spy

from pica.effects.reflections.ray_grid import ray_size
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, update, write
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ENDED_PATHS, ray_effect


class TracedRays:
    """A ray along the specular lobe for 2x2 pixels or for one, and a shadow ray from its hit to a light."""

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
        """Maximum numbers of bounces, by their names in shaders."""
        module = "effects/reflections/ray_traced/reflection_rays.slang"
        self._trace = ray_effect(
            device,
            module,
            "ReflectionRays",
            "surface",
            tracer,
            simplified=settings.simplified_materials,
            with_module=cache,
            parts=ENDED_PATHS,
        )
        # A pass whose parameters differ between dispatches would be bound again each time.
        self._gather = [device.compute("effects/reflections/ray_traced/gather_lighting.slang") for _ in range(2)]

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        samples: LightSamples,
        indirect: IndirectResult | None,
        hit_position_and_pdf: Texture,
        light: Texture,
        hit_motion: Texture,
        mirrors: int,
        dense: bool,
    ) -> Texture:
        """Trace the rays; write `hit_position_and_pdf` and `light` as reflected.slang has them, and in frames in which
        anything but the camera moves `hit_motion`.

        `indirect`: None without global illumination. `mirrors`: as in reflected.slang, `dense`: as in ray_grid.slang.
        Returns the light of single rays
        (format of `light`) before spatial reuse.
        """
        self.bounces["indirectBounces"] = indirect.bounces if indirect else 0
        smooth, size = self._filters, ray_size(graph, dense)
        blocks = {"gbuffer": gbuffer} if dense else gbuffer.half_blocks(graph)
        packed_hits = graph.texture("packed hits", spy.Format.rg32_uint, size)
        single = graph.texture("light of single rays", spy.Format.rgba32_uint, size) if smooth else light
        # Mirror rays are no samples of the lobe, and are weighed apart from what is.
        paths = indirect.paths if indirect and not mirrors else None
        known: dict[str, Any] = {
            "arriving": indirect.arriving if indirect else graph.nothing(spy.Format.rgba32_float),
            "arrivingKnown": int(indirect is not None and indirect.known),
            "paths": paths if paths else graph.nothing(spy.Format.rgba32_float),
            "pathsKnown": int(paths is not None),
        }
        graph.add(
            self._trace,
            size,
            **blocks,
            **self.bounces,
            **known,
            **samples.at_hits(regularized=smooth),
            hitPositionAndPdf=write(hit_position_and_pdf),
            light=write(single),
            packedHits=write(packed_hits),
            hitMotion=write(hit_motion),
            moves=lambda frame: int(frame.changed_scene),
            lightMotions=samples.motions.buffer,
            mirrors=mirrors,
            dense=int(dense),
            **(indirect.cache.values if indirect and indirect.cache else {}),
        )
        graph.offer(
            "rays.reflection_rays",
            (hit_position_and_pdf, packed_hits),
            lambda ends, hits: int(np.count_nonzero(ends[..., 3] * hits.any(-1))),
            on_request=True,
        )
        if smooth:
            rays = {"hitPositionAndPdf": hit_position_and_pdf, "packedHits": packed_hits, "light": single}
            for each, gather in enumerate(self._gather[: 1 + dense]):
                target = update(light) if each else write(light)
                threads = (*(graph.size if each else graph.half_size), 1)
                graph.add(gather, threads, gathered=target, dense=int(dense), each=each, **blocks, **rays)
        return single
