"""Indirect light from surfels: discs on surfaces that remember it (RTG 25, 25.2.6)."""

import numpy as np
import slangpy as spy

from pica.effects.global_illumination.debug_aovs import SURFEL_AOVS, offer_surfel_aovs
from pica.filtering.convergence import COMPLETE_FROM
from pica.frame.context import FrameContext, camera_constants
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import ENDLESS, IndirectCache, IndirectPictures
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Texture, write
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import GlobalIlluminationSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/global_illumination/surfels"
_SIZE, _LEAST_PIXELS = 0.02, 8
"""A surfel's radius: metres for each metre from the camera, and pixels at least."""
_CELLS, _PER_CELL = 1 << 16, 64
"""surfel_grid.slang: CELLS, PER_CELL."""
_ANCHOR, _ESTIMATOR = 32, 48
"""Bytes: surfel_anchor.slang, multiscale_mean.slang."""
_DEPTHS = 16
"""surfel_depth.slang: DEPTHS."""
_RAYS_ACROSS = 512
_BOUNCES = 12
"""Maximum number of bounces of paths that hit no surfels."""


class SurfelPool:
    """The surfels, in buffers that are all allocated at the start."""

    def __init__(self, device: Device, capacity: int) -> None:
        self.capacity = capacity
        self.rays = -(-capacity // _RAYS_ACROSS) * _RAYS_ACROSS
        make = device.buffer
        self.shared = {
            "placed": device.structured("surfel places", np.zeros((capacity, 4), np.float32)),
            "facing": make("surfel normals", size=4 * capacity, struct_size=4),
            "light": make("surfel light", size=16 * capacity, struct_size=16),
            "depths": make("surfel depths", size=4 * _DEPTHS * capacity, struct_size=4),
            "used": make("surfel uses", size=4 * capacity, struct_size=4),
            "keys": make("surfel cells", size=4 * _CELLS, struct_size=4),
            "counts": make("surfel cell counts", size=4 * _CELLS, struct_size=4),
            "members": make("surfel cell members", size=4 * _CELLS * _PER_CELL, struct_size=4),
        }
        self.block = device.parameter_block(f"{_FOLDER}/surfel_grid.slang", "surfels")
        self.block.bind(**self.shared)
        self.anchors = make("surfel anchors", size=_ANCHOR * capacity, struct_size=_ANCHOR)
        self.estimators = make("surfel estimators", size=_ESTIMATOR * capacity, struct_size=_ESTIMATOR)
        self.sample_counts = make("surfel sample counts", size=4 * capacity, struct_size=4)
        self.ray_ranges = make("surfel ray ranges", size=8 * capacity, struct_size=8)
        self.surfel_of_ray = make("surfel rays", size=4 * self.rays, struct_size=4)
        self.ray_radiance = make("radiance of surfel rays", size=16 * self.rays, struct_size=16)
        self.drifts = make("surfel drifts", size=4 * capacity, struct_size=4)
        self.ray_count = make("surfel ray count", size=4, struct_size=4)
        self.free_slots = device.structured("free surfels", np.arange(capacity, dtype=np.uint32))
        self.free_count = device.structured("free surfel count", np.array([capacity], np.int32))

    def clear(self) -> None:
        """Discard all surfels."""
        self.shared["placed"].copy_from_numpy(np.zeros((self.capacity, 4), np.float32))
        self.free_slots.copy_from_numpy(np.arange(self.capacity, dtype=np.uint32))
        self.free_count.copy_from_numpy(np.array([self.capacity], np.int32))


class SurfelIndirect:
    """Indirect light that surfels remember."""

    bounces, is_smooth = ENDLESS, True

    def __init__(self, device: Device, settings: GlobalIlluminationSettings, tracer: Tracer | None) -> None:
        self._device = device
        self._pool = SurfelPool(device, settings.surfels)
        compute = device.compute
        self._place = compute(f"{_FOLDER}/surfel_place.slang")
        self._spawn = compute(f"{_FOLDER}/surfel_spawn.slang")
        self._queue = compute(f"{_FOLDER}/surfel_queue.slang")
        module = f"{_FOLDER}/surfel_rays.slang"
        # Except in closed rooms, few paths go on after their first hit.
        self._trace = ray_effect(device, module, "SurfelRays", "surface", tracer, simplified=True, parts=(2, 4))
        self._update = compute(f"{_FOLDER}/surfel_update.slang")
        self._lookup = compute(f"{_FOLDER}/surfel_lookup.slang")
        self._apply = programs(device).compute(f"{_FOLDER}/surfel_apply.slang")
        self._scene, self._unchanged = -1, 0
        self.cache = IndirectCache(f"{_FOLDER}/surfel_cache.slang", {"surfels": self._pool})

    def reset(self) -> None:
        """Discard all surfels."""
        self._pool.clear()
        self._unchanged = 0

    def count(self) -> int:
        """Surfels in use. Waits for the device."""
        return self._pool.capacity - max(int(self._pool.free_count.to_numpy().view(np.int32)[0]), 0)

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        occlusion: Texture | None,
        exposure: Buffer,
        pictures: IndirectPictures,
    ) -> None:
        """Fill the pictures."""
        pool = self._pool
        surfel_grid = (pool.capacity, 1, 1)
        slots = {"freeSlots": pool.free_slots, "freeCount": pool.free_count}
        graph.provide(surfels=pool)
        graph.record("begin surfels", self._begin, scene=scene)
        graph.add(
            self._place,
            surfel_grid,
            anchors=pool.anchors,
            capacity=pool.capacity,
            **slots,
        )
        graph.add(
            self._spawn,
            graph.half_grid,
            **gbuffer.half_blocks(graph),
            anchors=pool.anchors,
            estimators=pool.estimators,
            sampleCounts=pool.sample_counts,
            drifts=pool.drifts,
            **slots,
        )
        graph.add(
            self._queue,
            surfel_grid,
            estimators=pool.estimators,
            surfelOfRay=pool.surfel_of_ray,
            rayCount=pool.ray_count,
            rayRanges=pool.ray_ranges,
            sampleCounts=pool.sample_counts,
            capacity=pool.capacity,
            budget=pool.rays,
        )
        graph.add(
            self._trace,
            (_RAYS_ACROSS, pool.rays // _RAYS_ACROSS),
            bounces=_BOUNCES,
            **light.at_hits(regularized=True),
            surfelOfRay=pool.surfel_of_ray,
            rayCount=pool.ray_count,
            rayRanges=pool.ray_ranges,
            sampleCounts=pool.sample_counts,
            rayRadiance=pool.ray_radiance,
            width=_RAYS_ACROSS,
        )
        graph.add(
            self._update,
            surfel_grid,
            rayRanges=pool.ray_ranges,
            sampleCounts=pool.sample_counts,
            rayRadiance=pool.ray_radiance,
            exposure=exposure,
            drifts=pool.drifts,
            estimators=pool.estimators,
            capacity=pool.capacity,
            settled=lambda frame: int(self._unchanged > COMPLETE_FROM),
            **slots,
        )
        half_light = graph.texture("light of surfels", spy.Format.rgba32_float, graph.half_size)
        graph.add(self._lookup, graph.half_grid, halfLight=write(half_light))
        graph.add(
            self._apply,
            graph.grid,
            halfLight=half_light,
            occlusion=occlusion or graph.nothing(spy.Format.r16_float),
            occluded=int(occlusion is not None),
            **pictures.arguments(),
        )
        self._offer(graph)

    def _begin(self, frame: FrameContext, scene: SceneView) -> None:
        self._unchanged = self._unchanged + 1 if scene.revision == self._scene else 0
        self._scene = scene.revision
        pool = self._pool
        pixel = camera_constants(frame.camera, frame.size, frame.output_size[0] / frame.output_size[1])["pixelSize"]
        pool.block.bind(size=max(_SIZE, _LEAST_PIXELS * pixel))
        for buffer in (pool.shared["keys"], pool.shared["counts"], pool.ray_count):
            frame.encoder.clear_buffer(buffer)

    def _offer(self, graph: FrameGraph) -> None:
        pool = self._pool
        if graph.wants(*SURFEL_AOVS):
            nearest = graph.texture("nearest surfels", spy.Format.rgba32_uint)
            cells = graph.texture("cells of surfels", spy.Format.rg32_uint)
            graph.add(
                self._device.compute(f"{_FOLDER}/surfel_debug.slang"),
                graph.grid,
                anchors=pool.anchors,
                sampleCounts=pool.sample_counts,
                rayRanges=pool.ray_ranges,
                nearest=write(nearest),
                cells=write(cells),
            )
            offer_surfel_aovs(graph, nearest, cells)
        ray_count = lambda: min(int(pool.ray_count.to_numpy().view(np.uint32)[0]), pool.rays)  # noqa: E731
        graph.offer("rays.surfel_rays", (), ray_count, on_request=True)
        graph.offer("count.surfels", (), self.count, on_request=True)
