"""Acceleration structures as seed 000, 19.2 splits them: RtGeometry, RtObject, RtScene."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntFlag
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import HostTable

# VkAccelerationStructureInstanceKHR: transform, custom index and mask, hit group offset and flags, address.
INSTANCE = np.dtype([("transform", "f4", (3, 4)), ("id_and_mask", "u4"), ("group_and_flags", "u4"), ("handle", "u8")])

_BOX = 24  # bytes
_BOTTOM = spy.AccelerationStructureKind.bottom_level


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


@dataclass(frozen=True)
class RtBoxes:
    """A run of boxes with one material; what is in them is for intersection shaders to find."""

    first: int
    count: int
    opaque: bool


class RtGeometry:
    """One bottom-level structure, made of sections that index shared vertex and index buffers.

    Or of boxes, which index a buffer of (low, high) corners that stands in for that of the vertices.

    A deforming one can be refitted: the same tree with new boxes, several times faster than a build.
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
        self._scratch: spy.Buffer | None = None
        self._size = 0
        self._pair: list[spy.AccelerationStructure] = []
        """Of equal size; builds take turns."""
        self._gone: list[RtObject] = []
        self._gone_before: list[RtObject] = []
        self.structure: spy.AccelerationStructure
        self.previous: spy.AccelerationStructure
        """As it was before the newest build: where objects were in the frame before. Those that deform have their new
        form in it, as their bottom levels are updated in place."""

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
        """Record a build from the vertices as they are; the first one must come before any refit."""
        self._use(positions, indices)
        self.builds += 1
        if not self._size:
            sizes = self._device.handle.get_acceleration_structure_sizes(self._descs[0])
            self._size = sizes.acceleration_structure_size
            scratch = max(sizes.scratch_size, sizes.update_scratch_size, 4)
            self._scratch = self._device.buffer("geometry scratch", size=scratch)
            self._device.count_memory(self._size)
            self.structure = self._device.handle.create_acceleration_structure(kind=_BOTTOM, size=self._size)
        assert self._scratch is not None
        encoder.build_acceleration_structure(
            desc=self._descs[0], dst=self.structure, src=None, scratch_buffer=self._scratch, queries=queries or []
        )
        if not self.deforms:
            self._device.give_back(self._scratch)
            self._scratch = None

    def refit(self, encoder: spy.CommandEncoder, positions: spy.Buffer, indices: spy.Buffer) -> None:
        """Record a refit to the vertices as they are."""
        self._use(positions, indices)
        self.refits += 1
        assert self._scratch is not None
        encoder.build_acceleration_structure(
            desc=self._descs[1], dst=self.structure, src=self.structure, scratch_buffer=self._scratch
        )

    def compact(self, encoder: spy.CommandEncoder, size: int) -> None:
        """Record the move into a structure of `size` bytes, as a query after the build has told it."""
        if not 0 < size < self._size:
            return
        loose, self.structure = (
            self.structure,
            self._device.handle.create_acceleration_structure(kind=_BOTTOM, size=size),
        )
        encoder.copy_acceleration_structure(self.structure, loose, spy.AccelerationStructureCopyMode.compact)
        self._device.count_memory(size - self._size)
        self._size = size

    def forget(self) -> None:
        """Book the memory as given back; the structure goes when its last user does."""
        self._device.count_memory(-self._size)
        if self._scratch is not None:
            self._device.give_back(self._scratch)

    def _use(self, positions: spy.Buffer, indices: spy.Buffer) -> None:
        if self.buffers is not None and self.buffers[0] is positions and self.buffers[1] is indices:
            return
        self.buffers = positions, indices
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


@dataclass(frozen=True)
class RtObject:
    """One placed geometry: which, and what rays see of it."""

    geometry: RtGeometry
    first_record: int
    """Record of its first section; InstanceID() in shaders."""
    hit_group: int = 0
    """Which of a pipeline's hit groups its hits are for."""
    flags: ObjectFlags = ObjectFlags.NONE


class RtScene:
    """The top-level structure over all objects, kept in numbered slots. Empty slots are met by no ray."""

    def __init__(self, device: Device) -> None:
        self._device = device
        usage = spy.BufferUsage.unordered_access | spy.BufferUsage.acceleration_structure_build_input
        self.slots = HostTable(device, "rt objects", INSTANCE, usage)
        self.objects: dict[int, RtObject] = {}  # a top level does not keep its parts alive
        self._watchers: list[set[int]] = []
        self._with_boxes: set[int] = set()
        self._built: tuple[spy.Buffer, spy.AccelerationStructureBuildDesc, spy.Buffer] | None = None
        self._size = 0
        self._pair: list[spy.AccelerationStructure] = []
        """Of equal size; builds take turns."""
        self._gone: list[RtObject] = []
        self._gone_before: list[RtObject] = []
        self.structure: spy.AccelerationStructure
        self.previous: spy.AccelerationStructure
        """As it was before the newest build: where objects were in the frame before. Those that deform have their new
        form in it, as their bottom levels are updated in place."""

    @property
    def has_boxes(self) -> bool:
        """Whether any object is made of boxes, which only intersection shaders can look into."""
        return bool(self._with_boxes)

    def watch(self) -> set[int]:
        """A set that gathers the slots which are filled, moved or emptied; whoever asked for it takes them out."""
        self._watchers.append(set(self.objects))
        return self._watchers[-1]

    def _tell(self, slots: Iterable[int]) -> None:
        for watcher in self._watchers:
            watcher.update(slots)

    def place(self, slot: int, placed: RtObject, transform: NDArray[Any], mask: int = 0xFF) -> None:
        """Put an object into a slot, (3, 4) object to world; `mask` as for `mask`."""
        row = self.slots.rows[slot]
        row["id_and_mask"] = placed.first_record | mask << 24
        row["group_and_flags"] = placed.hit_group | int(placed.flags) << 24
        row["handle"] = _handle(placed.geometry.structure)
        row["transform"] = transform
        self.objects[slot] = placed
        if placed.geometry.has_boxes:
            self._with_boxes.add(slot)
        self._tell([slot])
        self.slots.touch(np.array([slot]))

    def move(self, slots: NDArray[np.int64], transforms: NDArray[Any]) -> None:
        """Place the objects of slots anew, (n, 3, 4) object to world; takes effect with the next `build`."""
        self.slots.rows["transform"][slots] = transforms
        self.slots.touch(slots)
        self._tell(slots.tolist())

    def mask(self, slots: range, mask: int) -> None:
        """Only rays whose mask has one of these 8 bits meet the objects of slots, from the next `build` on."""
        numbers = np.array(slots)
        ids = self.slots.rows["id_and_mask"][numbers] & np.uint32(0xFFFFFF)
        self.slots.rows["id_and_mask"][numbers] = ids | np.uint32(mask << 24)
        self.slots.touch(numbers)
        self._tell(slots)

    def remove(self, slots: range) -> None:
        """Empty slots and give them back."""
        self._tell(slots)
        self._gone += [self.objects.pop(slot) for slot in slots]
        self._with_boxes.difference_update(slots)
        self.slots.give_back(slots.start, len(slots))

    def build(self, recording: Recording) -> None:
        """Record the upload of what changed and the build of the top level; `structure` may be a new one after it."""
        self.slots.flush(recording)
        if self._built is None or self._built[0] is not self.slots.buffer:
            self._prepare()
        first = not hasattr(self, "structure")
        self._pair.reverse()
        self.previous, self.structure = self._pair[0] if first else self.structure, self._pair[0]
        self._gone_before, self._gone = self._gone, []  # the previous top level still shows them
        assert self._built is not None
        recording.profiler.begin(recording.encoder, "top level")
        recording.encoder.build_acceleration_structure(
            desc=self._built[1], dst=self.structure, src=None, scratch_buffer=self._built[2]
        )
        recording.profiler.end(recording.encoder)

    def _prepare(self) -> None:
        # As many instances as the buffer holds: rows that nobody uses are zero, which Vulkan counts as inactive.
        desc = spy.AccelerationStructureBuildDesc(
            {
                "inputs": [
                    spy.AccelerationStructureBuildInputInstances(
                        {
                            "instance_buffer": self.slots.buffer,
                            "instance_stride": INSTANCE.itemsize,
                            "instance_count": len(self.slots.rows),
                        }
                    )
                ]
            }
        )
        sizes = self._device.handle.get_acceleration_structure_sizes(desc)
        if self._built is not None:
            self._device.count_memory(-2 * self._size)
            self._device.give_back(self._built[2])
        scratch = self._device.buffer("rt scene scratch", size=max(sizes.scratch_size, 4))
        self._size = sizes.acceleration_structure_size
        self._device.count_memory(2 * self._size)
        self._pair = [
            self._device.handle.create_acceleration_structure(
                kind=spy.AccelerationStructureKind.top_level, size=self._size
            )
            for _ in range(2)
        ]
        self._built = self.slots.buffer, desc, scratch


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
