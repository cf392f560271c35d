"""World-space radiance cache: light at the hits of rays, which end in it (hash_grid.slang)."""

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext, camera_constants
from pica.frame.signals.indirect import IndirectCache
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/global_illumination/radiance_cache"
_CELL, _LEAST_PIXELS = 0.04, 16
"""A cell's width: metres for each metre from the camera, and pixels at least."""
_SMALLEST, _LARGEST = 1 << 15, 1 << 19
"""Entries, 60 bytes each."""
_TILES = ((1 << 17, 4), (1 << 14, 3), (0, 2))
"""Pixels of half size, and from so many on the side of a tile of them that gives the cache one of its hits."""
_SUMS, _POINT = 32, 32
"""Bytes: hash_grid.slang."""
_ACROSS = 512
_BOUNCES = 12
"""Maximum number of bounces of the cache's own paths, where the entries are young."""
_SAMPLES, _SAMPLES_OF_CHANGE = 1024, 3
"""Maximum number of samples that an entry counts; the same when lights change, so that rays end in it only after two
new samples, which outweigh it."""
_NEVER = 1 << 31
"""A frame that no point was written in."""


class CacheEntries:
    """The hash grid's buffers, and the points at which it takes samples, as the block `radianceCache`."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self.block = device.parameter_block(f"{_FOLDER}/hash_grid.slang", "radianceCache")
        self.capacity, self.points = 0, 0
        """Entries; points of a frame."""
        self._cleared: dict[str, spy.Buffer] = {}

    def clear(self) -> None:
        """Free all entries, and discard all points."""
        for name, buffer in self._cleared.items():
            buffer.copy_from_numpy(np.full(buffer.size // 4, _NEVER if name == "points" else 0, np.uint32))

    def allocate(self, half_size: tuple[int, int]) -> None:
        """Make room for pictures of twice this size. The cache begins empty."""
        pixels = half_size[0] * half_size[1]
        tile = next(side for least, side in _TILES if pixels >= least)
        across, down = (-(-extent // tile) for extent in half_size)
        tiles = across * down
        self.points = 3 * tiles
        self.capacity = capacity = min(max(1 << (2 * pixels - 1).bit_length(), _SMALLEST), _LARGEST)
        make = self._device.buffer
        buffers = {
            "keys": make("cache keys", size=4 * capacity, struct_size=4),
            "samples": make("cache samples", size=4 * capacity, struct_size=4),
            "sums": make("cache sums", size=_SUMS * capacity, struct_size=4),
            "points": make("cache points", size=2 * _POINT * self.points, struct_size=16),
            "used": make("cache uses", size=4 * capacity, struct_size=4),
            "light": make("cache light", size=16 * capacity, struct_size=16),
        }
        self._cleared = {name: buffers[name] for name in ("keys", "samples", "sums", "points")}
        self.block.bind(**buffers, capacity=capacity, tile=tile, tilesAcross=across, tiles=tiles, count=self.points)
        self.clear()


class RadianceCache:
    """The cache of one view, and the passes that refill it with hits of the last frame's rays."""

    def __init__(self, device: Device, tracer: Tracer | None) -> None:
        module = f"{_FOLDER}/cache_update.slang"
        self._update = ray_effect(device, module, "CacheUpdate", "surface", tracer, simplified=True)
        self._resolve = device.compute(f"{_FOLDER}/cache_resolve.slang")
        self._entries = CacheEntries(device)
        self._occupancy = [device.buffer("cache occupancy", size=4, struct_size=4) for _ in range(2)]
        self._size = (0, 0)
        self.lookups = IndirectCache(f"{_FOLDER}/radiance_cache.slang", {"radianceCache": self._entries})
        """For effects whose rays end in the cache."""

    def reset(self) -> None:
        """Discard all entries."""
        self._entries.clear()

    def __call__(self, graph: FrameGraph, light: LightSamples, exposure: Buffer) -> None:
        """Add the passes that sample light at the hits of the last frame, and take the samples into the entries."""
        entries = self._entries
        if graph.half_size != self._size:
            self._size = graph.half_size
            entries.allocate(graph.half_size)
        graph.provide(radianceCache=entries)
        graph.record("begin radiance cache", self._begin)
        graph.add(
            self._update,
            (_ACROSS, -(-entries.points // _ACROSS)),
            **light.at_hits(regularized=True),
            bounces=_BOUNCES,
            exposure=exposure,
            width=_ACROSS,
        )
        graph.add(
            self._resolve,
            (entries.capacity, 1, 1),
            exposure=exposure,
            mostSamples=lambda frame: _SAMPLES_OF_CHANGE if frame.changed_lights else _SAMPLES,
            occupancy=lambda frame: self._occupancy[frame.index & 1],
            previousOccupancy=lambda frame: self._occupancy[(frame.index + 1) & 1],
        )

    def _begin(self, frame: FrameContext) -> None:
        pixel = camera_constants(frame.camera, frame.size, frame.output_size[0] / frame.output_size[1])["pixelSize"]
        least = _LEAST_PIXELS * pixel
        orthographic = frame.camera.orthographic_height is not None
        self._entries.block.bind(size=least if orthographic else max(_CELL, least))
        frame.encoder.clear_buffer(self._occupancy[frame.index & 1])
