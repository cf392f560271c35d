"""Bottom-level acceleration structures: RtGeometry of RTG 19, 19.2."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import slangpy as spy

from pica.rhi.build_scratch import BuildScratch
from pica.rhi.device import Device

# VkAccelerationStructureInstanceKHR: transform, custom index and mask, hit group offset and flags, address.
INSTANCE = np.dtype([("transform", "f4", (3, 4)), ("id_and_mask", "u4"), ("group_and_flags", "u4"), ("handle", "u8")])

_BOX = 24  # bytes
_BOTTOM = spy.AccelerationStructureKind.bottom_level


@dataclass(frozen=True)
class RtSection:
    """A run of triangles with one material, whose indices count from `first_vertex`."""

    first_vertex: int
    vertex_count: int
    """At most index_count: Slang-RHI takes the larger of the two for the number of indices."""
    first_index: int
    index_count: int
    opaque: bool
    """False: any-hit shaders decide whether each hit counts (alpha)."""


@dataclass(frozen=True)
class RtBoxes:
    """A run of boxes with one material; intersection shaders find the primitives in them."""

    first: int
    count: int
    opaque: bool


class RtGeometry:
    """One bottom-level structure, made of sections that index shared vertex and index buffers.

    Or of boxes, which index a buffer of (low, high) corners instead of vertices.

    A deforming one can be refitted: the same tree with new boxes, several times faster than a build.

    On a device without ray tracing nothing is built: it only informs host tracers (Embree) of geometry and of its
    changes.
    """

    def __init__(self, device: Device, sections: Sequence[RtSection | RtBoxes], deforms: bool = False) -> None:
        self._device, self.sections, self.deforms = device, sections, deforms
        flags = spy.AccelerationStructureBuildFlags
        self._flags = flags.prefer_fast_trace | (flags.allow_update if deforms else flags.allow_compaction)
        self.buffers: tuple[spy.Buffer, spy.Buffer] | None = None
        """Positions (or boxes) and indices that the structure was last built from or refitted to."""
        self.builds = self.refits = 0
        """How many were recorded."""
        self._descs: list[spy.AccelerationStructureBuildDesc] = []
        self._size = self._scratch_size = 0
        self._handle: int | None = None
        self.structure: spy.AccelerationStructure

    @property
    def handle(self) -> int:
        """The structure as a driver's record has it; 0 where nothing is built."""
        if not self._device.traces_rays:
            return 0
        if self._handle is None:
            self._handle = _handle(self.structure)
        return self._handle

    @property
    def has_boxes(self) -> bool:
        """Whether it is made of boxes."""
        return any(isinstance(section, RtBoxes) for section in self.sections)

    def build(
        self,
        encoder: spy.CommandEncoder,
        positions: spy.Buffer,
        indices: spy.Buffer,
        queries: list[spy.AccelerationStructureQueryDesc] | None = None,
    ) -> None:
        """Record a build from the current vertices; the first one must come before any refit."""
        self._use(positions, indices)
        self.builds += 1
        if not self._device.traces_rays:
            return
        if not self._size:
            sizes = self._device.handle.get_acceleration_structure_sizes(self._descs[0])
            self._size = sizes.acceleration_structure_size
            self._scratch_size = max(sizes.scratch_size, sizes.update_scratch_size)
            self._device.count_memory(self._size)
            self.structure = self._device.handle.create_acceleration_structure(kind=_BOTTOM, size=self._size)
            self._handle = None
        scratch = self._device.shared(BuildScratch).take(self._scratch_size)
        encoder.build_acceleration_structure(
            desc=self._descs[0], dst=self.structure, src=None, scratch_buffer=scratch, queries=queries or []
        )

    def refit(self, encoder: spy.CommandEncoder, positions: spy.Buffer, indices: spy.Buffer) -> None:
        """Record a refit to the vertices as they are."""
        self._use(positions, indices)
        self.refits += 1
        if not self._device.traces_rays:
            return
        scratch = self._device.shared(BuildScratch).take(self._scratch_size)
        encoder.build_acceleration_structure(
            desc=self._descs[1], dst=self.structure, src=self.structure, scratch_buffer=scratch
        )

    def compact(self, encoder: spy.CommandEncoder, size: int) -> None:
        """Record the compaction into a structure of `size` bytes, which a query after the build has returned."""
        if not 0 < size < self._size:
            return
        loose, self.structure = (
            self.structure,
            self._device.handle.create_acceleration_structure(kind=_BOTTOM, size=size),
        )
        encoder.copy_acceleration_structure(self.structure, loose, spy.AccelerationStructureCopyMode.compact)
        self._device.count_memory(size - self._size)
        self._size, self._handle = size, None

    def forget(self) -> None:
        """Book the memory as released; the structure is freed with its last user."""
        self._device.count_memory(-self._size)

    def _use(self, positions: spy.Buffer, indices: spy.Buffer) -> None:
        if self.buffers is not None and self.buffers[0] is positions and self.buffers[1] is indices:
            return
        self.buffers = positions, indices
        if not self._device.traces_rays:
            return
        inputs = _inputs(positions, indices, self.sections)
        modes = spy.AccelerationStructureBuildMode
        self._descs = [
            spy.AccelerationStructureBuildDesc({"inputs": inputs, "flags": self._flags, "mode": mode})
            for mode in (modes.build, modes.update)
        ]


def build_compact(device: Device, geometries: list[RtGeometry], positions: spy.Buffer, indices: spy.Buffer) -> None:
    """Build structures that will not change and move each into as little memory as it needs. Waits for the GPU."""
    if not geometries:
        return
    if not device.traces_rays:
        for geometry in geometries:
            geometry.build(device.handle.create_command_encoder(), positions, indices)
        return
    pool = device.handle.create_query_pool(spy.QueryType.acceleration_structure_compacted_size, len(geometries))
    pool.reset()
    encoder = device.handle.create_command_encoder()
    for index, geometry in enumerate(geometries):
        query = spy.AccelerationStructureQueryDesc(
            {
                "query_type": spy.QueryType.acceleration_structure_compacted_size,
                "query_pool": pool,
                "first_query_index": index,
            }
        )
        geometry.build(encoder, positions, indices, [query])
    device.handle.submit_command_buffer(encoder.finish())
    device.handle.wait_for_idle()
    encoder = device.handle.create_command_encoder()
    for index, geometry in enumerate(geometries):
        geometry.compact(encoder, pool.get_result(index))
    device.handle.submit_command_buffer(encoder.finish())
    device.handle.wait_for_idle()


def _inputs(positions: spy.Buffer, indices: spy.Buffer, sections: Sequence[RtSection | RtBoxes]) -> list[Any]:
    flags = spy.AccelerationStructureGeometryFlags
    return [
        spy.AccelerationStructureBuildInputProceduralPrimitives(
            {
                "aabb_buffers": [spy.BufferOffsetPair(positions, _BOX * section.first)],
                "aabb_stride": _BOX,
                "primitive_count": section.count,
                "flags": flags.opaque if section.opaque else flags.none,
            }
        )
        if isinstance(section, RtBoxes)
        else spy.AccelerationStructureBuildInputTriangles(
            {
                "vertex_buffers": [spy.BufferOffsetPair(positions, 12 * section.first_vertex)],
                "vertex_format": spy.Format.rgb32_float,
                "vertex_count": section.vertex_count,
                "vertex_stride": 12,
                "index_buffer": spy.BufferOffsetPair(indices, 4 * section.first_index),
                "index_format": spy.IndexFormat.uint32,
                "index_count": section.index_count,
                "flags": flags.opaque if section.opaque else flags.none,
            }
        )
        for section in sections
    ]


def _handle(structure: spy.AccelerationStructure) -> int:
    description = spy.AccelerationStructureInstanceDesc(
        {
            "transform": spy.float3x4.identity(),
            "instance_id": 0,
            "instance_mask": 0xFF,
            "instance_contribution_to_hit_group_index": 0,
            "flags": spy.AccelerationStructureInstanceFlags.none,
            "acceleration_structure": structure.handle,
        }
    )
    return int(description.to_numpy().view(INSTANCE)[0]["handle"])
