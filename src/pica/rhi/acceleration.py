"""Acceleration structures as seed 000, 19.2 splits them: RtGeometry, RtObject, RtScene."""

from dataclasses import dataclass
from enum import IntFlag

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device

# VkAccelerationStructureInstanceKHR: transform, custom index and mask, hit group offset and flags, address.
INSTANCE = np.dtype([("transform", "f4", (3, 4)), ("id_and_mask", "u4"), ("group_and_flags", "u4"), ("handle", "u8")])


class ObjectFlags(IntFlag):
    """Instance flags, with Vulkan's values (VkGeometryInstanceFlagBitsKHR).

    Vulkan's front is glTF's: counter-clockwise in object space, also under a mirroring transform.
    """

    NONE = 0
    CULL_DISABLE = 1
    """Both faces are met even by rays that cull back faces."""


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


class RtGeometry:
    """One bottom-level structure, made of sections that index shared vertex and index buffers."""

    def __init__(self, device: Device, positions: spy.Buffer, indices: spy.Buffer, sections: list[RtSection]) -> None:
        flags = spy.AccelerationStructureBuildFlags
        desc = spy.AccelerationStructureBuildDesc(
            {
                "inputs": _inputs(positions, indices, sections),
                "flags": flags.prefer_fast_trace | flags.allow_compaction,
            }
        )
        self.structure = _compacted(device, desc)


class DeformingRtGeometry:
    """A bottom-level structure whose vertices move: refitted, or rebuilt in place when that has become too loose."""

    def __init__(self, device: Device, positions: spy.Buffer, indices: spy.Buffer, sections: list[RtSection]) -> None:
        flags = spy.AccelerationStructureBuildFlags
        inputs = _inputs(positions, indices, sections)
        modes = spy.AccelerationStructureBuildMode
        self._build, self._update = (
            spy.AccelerationStructureBuildDesc(
                {"inputs": inputs, "flags": flags.allow_update | flags.prefer_fast_trace, "mode": mode}
            )
            for mode in (modes.build, modes.update)
        )
        sizes = device.handle.get_acceleration_structure_sizes(self._build)
        scratch = max(sizes.scratch_size, sizes.update_scratch_size, 4)
        self._scratch = device.buffer("geometry scratch", size=scratch)
        device.count_memory(sizes.acceleration_structure_size)
        self.structure = device.handle.create_acceleration_structure(
            kind=spy.AccelerationStructureKind.bottom_level, size=sizes.acceleration_structure_size
        )

    def build(self, encoder: spy.CommandEncoder) -> None:
        """Record a build from the vertices as they are; the first one must come before any refit."""
        encoder.build_acceleration_structure(
            desc=self._build, dst=self.structure, src=None, scratch_buffer=self._scratch
        )

    def refit(self, encoder: spy.CommandEncoder) -> None:
        """Record a refit: the same tree with new boxes, several times faster than a build."""
        encoder.build_acceleration_structure(
            desc=self._update, dst=self.structure, src=self.structure, scratch_buffer=self._scratch
        )


def _inputs(
    positions: spy.Buffer, indices: spy.Buffer, sections: list[RtSection]
) -> list[spy.AccelerationStructureBuildInputTriangles]:
    flags = spy.AccelerationStructureGeometryFlags
    return [
        spy.AccelerationStructureBuildInputTriangles(
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


def _compacted(device: Device, desc: spy.AccelerationStructureBuildDesc) -> spy.AccelerationStructure:
    sizes = device.handle.get_acceleration_structure_sizes(desc)
    scratch = device.handle.create_buffer(size=max(sizes.scratch_size, 4), usage=spy.BufferUsage.unordered_access)
    kind = spy.AccelerationStructureKind.bottom_level
    built = device.handle.create_acceleration_structure(kind=kind, size=sizes.acceleration_structure_size)
    pool = device.handle.create_query_pool(spy.QueryType.acceleration_structure_compacted_size, 1)
    pool.reset()
    encoder = device.handle.create_command_encoder()
    query = spy.AccelerationStructureQueryDesc(
        {
            "query_type": spy.QueryType.acceleration_structure_compacted_size,
            "query_pool": pool,
            "first_query_index": 0,
        }
    )
    encoder.build_acceleration_structure(desc=desc, dst=built, src=None, scratch_buffer=scratch, queries=[query])
    device.handle.submit_command_buffer(encoder.finish())
    device.handle.wait_for_idle()
    size = pool.get_result(0)
    temporary = sizes.acceleration_structure_size + sizes.scratch_size
    device.count_memory(temporary)
    if not 0 < size < sizes.acceleration_structure_size:
        device.count_memory(-sizes.scratch_size)
        return built
    device.count_memory(size)
    device.count_memory(-temporary)
    compact = device.handle.create_acceleration_structure(kind=kind, size=size)
    encoder = device.handle.create_command_encoder()
    encoder.copy_acceleration_structure(compact, built, spy.AccelerationStructureCopyMode.compact)
    device.handle.submit_command_buffer(encoder.finish())
    device.handle.wait_for_idle()
    return compact


@dataclass(frozen=True)
class RtObject:
    """One placed geometry: which, where, and what rays see of it."""

    geometry: RtGeometry | DeformingRtGeometry
    first_record: int
    """Record of its first section; InstanceID() in shaders."""
    flags: ObjectFlags = ObjectFlags.NONE
    mask: int = 0xFF


class RtScene:
    """The top-level structure over all objects. Moving some rewrites their 64 bytes and rebuilds the top level only."""

    def __init__(self, device: Device, objects: list[RtObject], transforms: NDArray[np.float32]) -> None:
        """`transforms`: (objects, 3, 4) object to world."""
        self._device = device
        self._geometries = {id(o.geometry): o.geometry for o in objects}  # a top level does not keep its parts alive
        self._records = np.zeros(max(len(objects), 1), INSTANCE)
        handles = {key: _handle(geometry.structure) for key, geometry in self._geometries.items()}
        for index, placed in enumerate(objects):
            record = self._records[index]
            record["id_and_mask"] = placed.first_record | placed.mask << 24
            record["group_and_flags"] = int(placed.flags) << 24
            record["handle"] = handles[id(placed.geometry)]
        if len(objects):
            self._records["transform"] = transforms
        usage = spy.BufferUsage.shader_resource | spy.BufferUsage.acceleration_structure_build_input
        self._instances = device.buffer("rt instances", data=self._records.view(np.uint8), usage=usage)
        self._desc = spy.AccelerationStructureBuildDesc(
            {
                "inputs": [
                    spy.AccelerationStructureBuildInputInstances(
                        {"instance_buffer": self._instances, "instance_stride": 64, "instance_count": len(objects)}
                    )
                ]
            }
        )
        sizes = device.handle.get_acceleration_structure_sizes(self._desc)
        self._scratch = device.buffer("rt scene scratch", size=max(sizes.scratch_size, 4))
        device.count_memory(sizes.acceleration_structure_size)
        self.structure = device.handle.create_acceleration_structure(
            kind=spy.AccelerationStructureKind.top_level, size=sizes.acceleration_structure_size
        )

    def move(self, encoder: spy.CommandEncoder, index: int, transform: NDArray[np.float32]) -> None:
        """Place object `index` anew, (3, 4) object to world; takes effect with the next `build`."""
        self._records[index]["transform"] = transform
        encoder.upload_buffer_data(self._instances, 64 * index, self._records[index : index + 1].view(np.uint8))

    def build(self, encoder: spy.CommandEncoder) -> None:
        """Record the build of the top level from the objects as they stand."""
        encoder.build_acceleration_structure(
            desc=self._desc, dst=self.structure, src=None, scratch_buffer=self._scratch
        )


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
