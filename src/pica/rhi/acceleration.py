"""Top-level acceleration structures: RtObject and RtScene of RTG 19, 19.2; rt_geometry.py has RtGeometry."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntFlag
from typing import Any
from weakref import WeakSet

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.rt_geometry import INSTANCE, RtGeometry
from pica.rhi.tables import HostTable

_ROUNDING = float(np.finfo(np.float32).eps)


class ObjectFlags(IntFlag):
    """Instance flags, with Vulkan's values (VkGeometryInstanceFlagBitsKHR).

    Vulkan's front is glTF's: counter-clockwise in object space, also under a mirroring transform.
    """

    NONE = 0
    CULL_DISABLE = 1
    """Rays hit both faces even if they cull back faces."""


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
