"""Acceleration structures as RTG 19, 19.2 splits them: RtGeometry, RtObject, RtScene."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntFlag
from typing import Any
from weakref import WeakSet

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.build_scratch import BuildScratch
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import HostTable

# VkAccelerationStructureInstanceKHR: transform, custom index and mask, hit group offset and flags, address.
INSTANCE = np.dtype([("transform", "f4", (3, 4)), ("id_and_mask", "u4"), ("group_and_flags", "u4"), ("handle", "u8")])

_BOX = 24  # bytes
_ROUNDING = float(np.finfo(np.float32).eps)
_BOTTOM = spy.AccelerationStructureKind.bottom_level


class ObjectFlags(IntFlag):
    """Instance flags, with Vulkan's values (VkGeometryInstanceFlagBitsKHR).

    Vulkan's front is glTF's: counter-clockwise in object space, also under a mirroring transform.
    """

    NONE = 0
    CULL_DISABLE = 1
    """Rays hit both faces even if they cull back faces."""


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


@dataclass(frozen=True)
class RtObject:
    """The geometry in a slot, and how rays hit it."""

    geometry: RtGeometry
    hit_group: int = 0
    """Which of a pipeline's hit groups its hits are for."""
    flags: ObjectFlags = ObjectFlags.NONE


class SlotWatcher:
    """Collects filled, moved and emptied slots for a subscriber."""

    def __init__(self, slots: Iterable[int]) -> None:
        self._slots = set(slots)

    def add(self, slots: Iterable[int]) -> None:
        """Note changed slots."""
        self._slots.update(slots)

    def take(self) -> set[int]:
        """The slots changed since the last call."""
        changed, self._slots = self._slots, set()
        return changed


class RtScene:
    """Objects in numbered slots and the top-level structure over them. Rays never hit empty slots.

    Some slots may belong to one view: its own top level (RtView) shows them, this one does not. On a device without
    ray tracing there is no structure, only the slots.
    """

    def __init__(self, device: Device) -> None:
        self.slots = HostTable(device, "rt objects", INSTANCE, device.built_from)
        self.objects: dict[int, RtObject] = {}  # a top level does not keep its bottom levels alive
        self.revision = 0
        """Counts changes that require a new top level."""
        self._watchers: WeakSet[SlotWatcher] = WeakSet()
        self._with_boxes: set[int] = set()
        self._top = TopLevel(device)
        self._built = -1

    @property
    def structure(self) -> spy.AccelerationStructure:
        """The top level of all objects that views share, after `build`."""
        return self._top.structure

    @property
    def has_boxes(self) -> bool:
        """Whether any object consists of boxes, which need intersection shaders."""
        return bool(self._with_boxes)

    def watch(self) -> SlotWatcher:
        """A subscriber to changed slots, with those that are filled now."""
        watcher = SlotWatcher(self.objects)
        self._watchers.add(watcher)
        return watcher

    def changed(self, slots: Iterable[int] = ()) -> None:
        """Require a new top level: these slots changed, or one of their structures was rebuilt."""
        self.revision += 1
        for watcher in self._watchers:
            watcher.add(slots)

    def place(self, slots: NDArray[np.int64], placed: RtObject, rows: NDArray[np.void]) -> None:
        """Put an object into slots (n,), with the rows from `rows_of`."""
        self.slots.rows[slots] = rows
        self.slots.rows["handle"][slots] = placed.geometry.handle
        numbers = slots.tolist()
        self.objects.update(dict.fromkeys(numbers, placed))
        if placed.geometry.has_boxes:
            self._with_boxes.update(numbers)
        self.slots.touch(slots)
        self.changed(numbers)

    def move(self, slots: NDArray[np.int64], transforms: NDArray[Any]) -> None:
        """Set the transforms of slots' objects, (n, 3, 4) object to world; takes effect with the next `build`."""
        self.slots.rows["transform"][slots] = without_rounding(transforms)
        self.slots.touch(slots)
        self.changed(slots.tolist())

    def mask(self, slots: range, mask: int) -> None:
        """Restrict the objects of slots to rays with one of these 8 mask bits, from the next `build` on."""
        numbers = np.array(slots)
        ids = self.slots.rows["id_and_mask"][numbers] & np.uint32(0xFFFFFF)
        self.slots.rows["id_and_mask"][numbers] = ids | np.uint32(mask << 24)
        self.slots.touch(numbers)
        self.changed(slots)

    def remove(self, slots: range) -> None:
        """Empty slots and free them."""
        for slot in slots:
            self.objects.pop(slot, None)
        self._with_boxes.difference_update(slots)
        self.slots.give_back(slots.start, len(slots))
        self.changed(slots)

    def build(self, recording: Recording) -> None:
        """Record the upload of changes, and the build of the top level if it is required."""
        if self._built == self.revision:
            return
        self._built = self.revision
        self.slots.flush(recording)
        self._top.build(recording, self.slots.buffer, len(self.slots.rows))


def rows_of(
    placed: RtObject, first_records: NDArray[np.int64], transforms: NDArray[Any], masks: NDArray[np.uint32]
) -> NDArray[np.void]:
    """(n,) the driver's records of an object with n transforms, (n, 3, 4) object to world, invisible to all rays.

    `first_records`: InstanceID() in shaders, the records of its first section; `masks` as for RtScene.mask.
    """
    rows = np.zeros(len(first_records), INSTANCE)
    rows["id_and_mask"] = first_records | masks.astype(np.int64) << 24
    rows["group_and_flags"] = placed.hit_group | int(placed.flags) << 24
    rows["transform"] = without_rounding(transforms)
    return rows


def without_rounding(transforms: NDArray[Any]) -> NDArray[np.float32]:
    """Transforms (n, 3, 4) with axes set to exact zeros despite rounding: a rotation by 90 degrees leaves 6e-17.

    Without ray tracing cores (on an H100), rays miss flat meshes under such a transform.
    """
    cleaned = np.array(transforms, np.float32)
    axes = cleaned[..., :3]
    size = np.abs(axes).max(axis=(-2, -1), keepdims=True)
    axes[np.abs(axes) < _ROUNDING * size] = 0
    return cleaned


class TopLevel:
    """A top-level structure and its build inputs; empty on a device without ray tracing."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._prepared: tuple[spy.Buffer, spy.AccelerationStructureBuildDesc, spy.Buffer] | None = None
        self._size = 0
        self.structure: spy.AccelerationStructure

    def build(self, recording: Recording, instances: spy.Buffer, count: int) -> None:
        """Record a build over a buffer of INSTANCE rows; `structure` may be a new one after it."""
        if not self._device.traces_rays:
            return
        if self._prepared is None or self._prepared[0] is not instances:
            self._prepare(instances, count)
        assert self._prepared is not None
        _, desc, scratch = self._prepared
        recording.profiler.begin(recording.encoder, "top level")
        recording.encoder.build_acceleration_structure(desc=desc, dst=self.structure, src=None, scratch_buffer=scratch)
        recording.profiler.end(recording.encoder)

    def _prepare(self, instances: spy.Buffer, count: int) -> None:
        # As many instances as the buffer holds: unused rows are zero, which Vulkan treats as inactive.
        inputs = spy.AccelerationStructureBuildInputInstances(
            {"instance_buffer": instances, "instance_stride": INSTANCE.itemsize, "instance_count": count}
        )
        desc = spy.AccelerationStructureBuildDesc({"inputs": [inputs]})
        sizes = self._device.handle.get_acceleration_structure_sizes(desc)
        if self._prepared is not None:
            self._device.count_memory(-self._size)
            self._device.give_back(self._prepared[2])
        scratch = self._device.buffer("rt scene scratch", size=max(sizes.scratch_size, 4))
        self._size = sizes.acceleration_structure_size
        self._device.count_memory(self._size)
        self.structure = self._device.handle.create_acceleration_structure(
            kind=spy.AccelerationStructureKind.top_level, size=self._size
        )
        self._prepared = instances, desc, scratch


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
