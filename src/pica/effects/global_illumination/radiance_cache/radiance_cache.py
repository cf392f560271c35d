"""World-space radiance cache: light at the hits of rays, which end in it (hash_grid.slang)."""

import math

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext, pixel_size
from pica.frame.signals.indirect import IndirectCache
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/global_illumination/radiance_cache"
_CELL, _LEAST_PIXELS = 0.04, 6
"""A cell's width: metres for each metre from the camera, and pixels at least."""
_SMALLEST, _LARGEST = 1 << 15, 1 << 19
"""Entries, 60 bytes each."""
_TILES = ((1 << 17, 4), (1 << 15, 3), (1 << 13, 2), (0, 1))
"""Pixels of half size, and from so many on the side of a tile of them that gives the cache one of its hits."""
_SUMS, _POINT = 32, 32
"""Bytes of an entry, and of a point: hash_grid.slang."""
_ACROSS = 512
_BOUNCES, _FIRST_BOUNCES, _FIRST_FRAMES = 3, 13, 32
"""Lit surfaces on the cache's own paths, the point included, where entries have few samples; in the first frames, and
the first after a change of lights, when all have few."""
_MATURE, _YOUNG = 48, 8
"""Samples of an entry in which the cache's own rays end; how many frames are too early for that, as light is still on
its way."""
_SAMPLES, _SAMPLES_OF_CHANGE = 1024, 2
"""Samples that an entry's older light counts as: at most, and after a change of lights, when rays go on until there are
new ones."""
_LEAST_MEMORY, _MEMORY_OF_CHANGE, _MEMORY = 2, 8, 32
"""Frames that an entry averages over: right after lights have changed, while they go on changing, and at most."""


class CacheEntries:
    """The hash grid's buffers, and the points at which it takes samples, as the block `radianceCache`."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self.block = device.parameter_block(f"{_FOLDER}/hash_grid.slang", "radianceCache")
        self.capacity, self.points = 0, 0
        """Entries; points of a frame."""
        self._buffers: dict[str, spy.Buffer] = {}

    def clear(self) -> None:
        """Free all entries, and discard all points."""
        for name, buffer in self._buffers.items():
            if name in ("keys", "samples", "sums", "points"):
                buffer.copy_from_numpy(np.zeros(buffer.size // 4, np.uint32))

    def allocate(self, half_size: tuple[int, int]) -> None:
        """Make room for pictures of twice this size. The cache begins empty."""
        pixels = half_size[0] * half_size[1]
        tile = next(side for least, side in _TILES if pixels >= least)
        across, down = (-(-extent // tile) for extent in half_size)
        tiles = across * down
        self.points = 3 * tiles
        self.capacity = capacity = min(max(1 << (2 * pixels - 1).bit_length(), _SMALLEST), _LARGEST)
        threads = -(-self.points // _ACROSS) * _ACROSS  # those beyond the points read, too
        make = self._device.buffer
        self._device.give_back(*self._buffers.values())
        self._buffers = {
            "keys": make("cache keys", size=4 * capacity, struct_size=4),
            "samples": make("cache samples", size=4 * capacity, struct_size=4),
            "sums": make("cache sums", size=_SUMS * capacity, struct_size=4),
            "points": make("cache points", size=_POINT * (self.points + threads), struct_size=16),
            "used": make("cache uses", size=4 * capacity, struct_size=4),
            "light": make("cache light", size=16 * capacity, struct_size=16),
        }
        self.block.bind(
            **self._buffers, capacity=capacity, tile=tile, tilesAcross=across, tiles=tiles, count=self.points
        )
        self.clear()


class RadianceCache:
    """The cache of one view, and the passes that refill it with hits of the last frame's rays."""

    def __init__(self, device: Device, tracer: Tracer | None) -> None:
        module = f"{_FOLDER}/cache_update.slang"
        self._update = ray_effect(device, module, "CacheUpdate", "surface", tracer)
        self._resolve = device.compute(f"{_FOLDER}/cache_resolve.slang")
        self._entries = CacheEntries(device)
        self._occupancy = [device.buffer("cache occupancy", size=4, struct_size=4) for _ in range(2)]
        self._size = 0, 0
        self._clock, self._age, self._memory = 1, 0, 0.0
        self.lookups = IndirectCache(f"{_FOLDER}/radiance_cache.slang", {"radianceCache": self._entries})
        """For effects whose rays end in the cache."""

    def reset(self) -> None:
        """Discard all entries."""
        self._entries.clear()
        self._clock, self._age = 1, 0

    def __call__(self, graph: FrameGraph, light: LightSamples, exposure: Buffer) -> None:
        """Add the passes that sample light at the hits of the last frame, and take the samples into the entries."""
        entries = self._entries
        if graph.half_size != self._size:
            self._size = graph.half_size
            entries.allocate(graph.half_size)
            self._clock, self._age = 1, 0
        graph.provide(radianceCache=entries)
        graph.record("begin radiance cache", self._begin)
        graph.add(
            self._update,
            (_ACROSS, -(-entries.points // _ACROSS)),
            **light.at_hits(regularized=True),
            bounces=lambda frame: _FIRST_BOUNCES if self._age < _FIRST_FRAMES else _BOUNCES,
            mature=lambda frame: _MATURE if self._age >= _YOUNG else math.inf,
            exposure=exposure,
            width=_ACROSS,
        )
        graph.add(
            self._resolve,
            (entries.capacity, 1, 1),
            exposure=exposure,
            memory=lambda frame: self._memory,
            mostSamples=lambda frame: _SAMPLES_OF_CHANGE if frame.since_relit == 0 else _SAMPLES,
            occupancy=lambda frame: self._occupancy[self._clock & 1],
            previousOccupancy=lambda frame: self._occupancy[(self._clock + 1) & 1],
        )
        graph.offer("count.cache_entries", (), self._count, on_request=True)

    def _count(self) -> int:
        return int(self._occupancy[self._clock & 1].to_numpy().view(np.uint32)[0])

    def _begin(self, frame: FrameContext) -> None:
        self._clock += 1
        # After a change of lights the light of old entries would go round for long: paths are long again.
        self._age = 0 if frame.since_relit == 0 else self._age + 1
        least = _MEMORY_OF_CHANGE if frame.changed_lights and frame.since_relit > 0 else _LEAST_MEMORY
        self._memory = min(max(min(self._age, frame.since_relit) / 2, least), _MEMORY)
        orthographic = frame.camera.orthographic_height is not None
        # Metres, for each metre from the camera unless it is orthographic.
        width = _LEAST_PIXELS * pixel_size(frame.camera, frame.size[1])
        size, least_size = (0.0, width) if orthographic else (max(_CELL, width), 0.0)
        self._entries.block.bind(size=size, leastSize=least_size, clock=self._clock)
        frame.encoder.clear_buffer(self._occupancy[self._clock & 1])
