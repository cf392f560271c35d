"""Draws the samples of the light slots, once per frame for all passes that read them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import slangpy as spy

from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Texture, update, write
from pica.light_sampling.light_motions import LightMotions
from pica.light_sampling.light_slots import LightSlots
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.programs.scene_features import SPLIT_SUM_ONLY
from pica.rhi.device import Device

_PRESAMPLED = 1 << 14
"""Points of lights that are drawn ahead for all pixels, 32 bytes each."""
_PRESAMPLED_AT_HITS = 1 << 12
"""The same for hits of rays."""
_CLUSTERS, _SLOTS, _TILE = 128, 256, 16
"""As in light_clusters.slang."""
_TILE_THREADS = 8
"""For each tile, in tile_lights.slang."""
_TEXELS = 16, 9
"""Of a tile's visibility counts: as in cluster_visibility.slang."""
_CLUSTER = 64
"""Bytes of a LightCluster."""
_TRIANGLE = 44
"""Bytes of a PresampledTriangle (presampled_lights.slang)."""
_LEAST_ROUGHNESS = 0.3
"""For hits of rays, lit by punctual lights: narrower highlights are rare spikes (light_at_hits.slang)."""


@dataclass(frozen=True)
class LightSamples:
    """The light samples of a frame, of which its direct light is made."""

    slots: LightSlots
    samples: Texture
    """(width, height, slots) light_samples.slang: the sample of each slot that needs one."""
    weights: Texture
    """(width, height, denoised slots, r16_float) their weights in the filtered visibility of their slot."""
    at_hits_pool: tuple[Buffer, Buffer] | None
    """Points on all emitters, for the hits of rays, and the triangles of those on triangles; None if no pass reads
    them."""
    motions: LightMotions
    """Of the first lights of the table."""
    sources: Texture | None = None
    """(width, height, r8_uint) what the shared slot's samples are of (cluster_visibility.slang); None without one."""
    counts: Texture | None = None
    """Of visible samples (cluster_visibility.slang), for `count_visibility`; None without a shared slot."""

    def at_hits(self, regularized: bool) -> dict[str, Any]:
        """Arguments of ray effects that light their hits. `regularized`: with highlights wider than surfaces have."""
        assert self.at_hits_pool is not None, "LightSampler was not asked for it"
        pool, triangles = self.at_hits_pool
        slots = self.slots
        return {
            "pool": pool,
            "triangles": triangles,
            "entries": lambda frame: _PRESAMPLED_AT_HITS if slots.every else 0,
            "leastRoughness": _LEAST_ROUGHNESS if regularized else 0.0,
        }


class LightSampler:
    """One sample a pixel and slot, of the slots that need any."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._motions = LightMotions(device)
        self._presample = [programs(device).compute("light_sampling/presample_lights.slang") for _ in range(2)]
        self._cluster = programs(device).compute("light_sampling/cluster_lights.slang")
        self._choose = programs(device).compute("light_sampling/tile_lights.slang")
        self._count = programs(device).compute("light_sampling/count_visibility.slang")
        self._sample: dict[bool, MaterialPass] = {}

    def __call__(self, graph: FrameGraph, slots: LightSlots, at_hits: bool) -> LightSamples:
        """Draw this frame's samples. `at_hits`: whether some effect lights points that are not in the G-buffer."""
        with graph.scope("light_sampling"):
            graph.record("follow lights", lambda frame: self._motions.follow(frame, slots.lights))
            pool = self._pool_at_hits(graph, slots) if at_hits else None
            layers, denoised = slots.count, len(slots.denoised)
            if slots.first_sampled == slots.count:
                nothing = graph.nothing(spy.Format.rgba32_uint, 1), graph.nothing(spy.Format.r16_float, 1)
                return LightSamples(slots, *nothing, pool, self._motions)
            samples = graph.texture("samples", spy.Format.rgba32_uint, layers=layers)
            size = graph.size if denoised else (1, 1)
            weights = graph.texture("weights", spy.Format.r16_float, size, layers=max(denoised, 1))
            sources = graph.texture("sources", spy.Format.r8_uint, graph.size if slots.has_shared else (1, 1))
            shared, counts = self._shared_pool(graph, slots)
            graph.add(
                self._sample_pass(slots.by_ratio),
                graph.grid,
                **shared,
                sources=write(sources),
                lightSamples=write(samples),
                weights=write(weights),
            )
        return LightSamples(slots, samples, weights, pool, self._motions, sources, counts)

    def count_visibility(self, graph: FrameGraph, light: LightSamples, bits: Texture) -> None:
        """Keep for later frames which samples of the shared slot are visible, as `bits` (ShadowTextures) tells. Not
        without filters, when a frame depends on no other."""
        if light.counts is None or light.sources is None or not light.slots.noisy:
            return
        with graph.scope("light_sampling"):
            across, down = self._tile_grid(graph)
            graph.add(
                self._count,
                (_TILE * across, _TILE * down, 1),
                sources=light.sources,
                visibility=bits,
                visibilityCounts=update(light.counts),
            )

    def _sample_pass(self, by_ratio: bool) -> MaterialPass:
        if by_ratio not in self._sample:
            features = () if by_ratio else (SPLIT_SUM_ONLY,)
            step = programs(self._device).compute("light_sampling/sample_lights.slang", features=features)
            self._sample[by_ratio] = step
        return self._sample[by_ratio]

    def _shared_pool(self, graph: FrameGraph, slots: LightSlots) -> tuple[dict[str, Any], Texture | None]:
        """Arguments of the pass that draws a pixel's samples: points on the emitters that share a slot. And
        `LightSamples.counts`."""
        if not slots.has_shared:
            return {
                "pool": graph.buffer("no lights", 32, struct_size=16),
                "triangles": graph.buffer("no triangles", _TRIANGLE, struct_size=_TRIANGLE),
                "entries": 0,
                "tiles": graph.buffer("no tiles", 4),
            }, None
        pool = graph.buffer("presampled lights", 32 * _PRESAMPLED, struct_size=16)
        triangles = graph.buffer("presampled triangles", _TRIANGLE * _PRESAMPLED, struct_size=_TRIANGLE)
        self._draw(graph, 0, _PRESAMPLED, pool, triangles, lambda: slots.shared_lights)
        tiles, counts = self._tiles(graph, pool)
        return {"pool": pool, "triangles": triangles, "entries": _PRESAMPLED, "tiles": tiles}, counts

    def _tiles(self, graph: FrameGraph, pool: Buffer) -> tuple[Buffer, Texture]:
        """Which parts of the pool matter in each tile of pixels, and LightSamples.counts."""
        clusters = graph.buffer("light clusters", _CLUSTER * _CLUSTERS, struct_size=_CLUSTER)
        graph.add(self._cluster, (_CLUSTERS, 1, 1), pool=pool, entries=_PRESAMPLED, clusters=write(clusters))
        across, down = self._tile_grid(graph)
        tiles = graph.buffer("light tiles", 4 * (_SLOTS + 1 + _CLUSTERS) * across * down)
        counts = {"visibilityCounts": spy.Format.rg16_float}
        history = graph.history("visibility", counts, (_TEXELS[0] * across, _TEXELS[1] * down))
        graph.add(
            self._choose,
            (_TILE_THREADS, across * down, 1),
            clusters=clusters,
            tiles=write(tiles),
            known=history.known,
            **history.swap(),
        )
        return tiles, history["visibilityCounts"]

    @staticmethod
    def _tile_grid(graph: FrameGraph) -> tuple[int, int]:
        width, height = graph.size
        return -(-width // _TILE), -(-height // _TILE)

    def _pool_at_hits(self, graph: FrameGraph, slots: LightSlots) -> tuple[Buffer, Buffer]:
        pool = graph.buffer("presampled lights at hits", 32 * _PRESAMPLED_AT_HITS, struct_size=16)
        triangles = graph.buffer("presampled triangles at hits", _TRIANGLE * _PRESAMPLED_AT_HITS, struct_size=_TRIANGLE)
        self._draw(graph, 1, _PRESAMPLED_AT_HITS, pool, triangles, lambda: range(slots.every))
        return pool, triangles

    def _draw(
        self,
        graph: FrameGraph,
        number: int,
        entries: int,
        pool: Buffer,
        triangles: Buffer,
        lights: Callable[[], range],
    ) -> None:
        """Draw this frame's points (presampled_lights.slang) from these entries of the light table."""
        graph.add(
            self._presample[number],
            (entries, 1, 1),
            when=lambda frame: len(lights()) > 0,
            pool=write(pool),
            triangles=write(triangles),
            entries=entries,
            range=lambda frame: spy.uint2(lights().start, len(lights())),
        )
