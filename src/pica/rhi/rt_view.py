"""The top level of one view: the shared objects, and objects of its own."""

from collections import ChainMap
from collections.abc import Iterable, Mapping
from weakref import WeakSet

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.acceleration import RtObject, RtScene, SlotWatcher, TopLevel
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.rt_geometry import INSTANCE
from pica.rhi.tables import HostTable, RowUpload


class RtView:
    """The top-level structure for one view's rays. Without objects of its own it is the scene's top level.

    Its objects have slots in the scene's table, where the shared records have them as invisible to all rays; the
    view's top level is built from a copy of those records, with the view's structures.
    """

    def __init__(self, device: Device, scene: RtScene) -> None:
        self._device, self._scene = device, scene
        self._own: dict[int, RtObject] = {}
        self._handles: dict[int, int] = {}
        self._revision = 0
        self._built = (-1, -1)
        self._watchers: WeakSet[SlotWatcher] = WeakSet()
        self._top = TopLevel(device)
        self._records: spy.Buffer | None = None
        self._upload = RowUpload(device)

    @property
    def structure(self) -> spy.AccelerationStructure:
        """The top level, after `build`."""
        return self._top.structure if self._own else self._scene.structure

    @property
    def objects(self) -> Mapping[int, RtObject]:
        """The view's objects, by slot."""
        return ChainMap(self._own, self._scene.objects) if self._own else self._scene.objects

    @property
    def slots(self) -> HostTable:
        """INSTANCE rows by slot; the host's copy lacks the structures of views."""
        return self._scene.slots

    @property
    def has_boxes(self) -> bool:
        """As RtScene.has_boxes; only triangles can be a view's own."""
        return self._scene.has_boxes

    def watch(self) -> SlotWatcher:
        """As RtScene.watch, for this view's objects."""
        watcher = self._scene.watch()
        watcher.add(self._own)
        self._watchers.add(watcher)
        return watcher

    def changed(self, slots: Iterable[int] = ()) -> None:
        """As RtScene.changed, for objects of the view's own."""
        self._revision += 1
        for watcher in self._watchers:
            watcher.add(slots)

    def place(self, slots: NDArray[np.int64], placed: RtObject, rows: NDArray[np.void]) -> None:
        """Put an object of the view's own into slots (n,), with the rows from acceleration.rows_of."""
        self.slots.rows[slots] = rows
        numbers = slots.tolist()
        self._own.update(dict.fromkeys(numbers, placed))
        self._handles.update(dict.fromkeys(numbers, placed.geometry.handle))
        self.slots.touch(slots)
        self.changed(numbers)

    def remove(self, slots: range) -> None:
        """As RtScene.remove."""
        for slot in slots:
            self._own.pop(slot, None)
            self._handles.pop(slot, None)
        self.slots.give_back(slots.start, len(slots))
        self.changed(slots)

    def build(self, recording: Recording) -> None:
        """As RtScene.build."""
        if not self._own:
            self._scene.build(recording)
            return
        due = self._scene.revision, self._revision
        if self._built == due:
            return
        self._built = due
        self.slots.flush(recording)
        if not self._device.traces_rays:
            return
        source = self.slots.buffer
        if self._records is None or self._records.size != source.size:
            if self._records is not None:
                self._device.give_back(self._records)
            size = INSTANCE.itemsize
            self._records = self._device.buffer(
                "view's rt objects", size=source.size, struct_size=size, usage=self._device.built_from
            )
        recording.encoder.copy_buffer(self._records, 0, source, 0, source.size)
        own = np.array(sorted(self._own), np.int64)
        rows = self.slots.rows[own]
        rows["handle"] = [self._handles[slot] for slot in own.tolist()]
        self._upload(recording, self._records, own, rows)
        self._top.build(recording, self._records, len(self.slots.rows))
