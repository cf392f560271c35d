"""Tier 1 on the processor: Embree fills the buffer of hits from the buffer of rays (RTG 19, 19.2.2)."""

import os
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from pica.rhi.acceleration import ObjectFlags, RtObject
from pica.rhi.device import Device
from pica.rhi.host_memory import HostBuffer
from pica.rhi.passes import Recording
from pica.rhi.rt_geometry import RtGeometry, RtSection
from pica.rhi.rt_view import RtView
from pica.tracing import embree
from pica.tracing.embree_loops import CUTOUT, LANES, OPAQUE, ROWS, loops
from pica.tracing.ray_buffers import RayQueue

_CHUNK = 2048
_Key = tuple[RtGeometry, bool]
"""Of Embree scenes: the geometry, and whether camera rays cull its back faces."""


class _Worker:
    """One thread's memory: a packet, aligned to 64 bytes, and a chunk of the queue."""

    def __init__(self) -> None:
        self._memory = np.zeros(4 * LANES * ROWS + 64, np.uint8), np.zeros(_CHUNK, np.uint32)
        packet, self.room = (memory.ctypes.data for memory in self._memory)
        self.packet = packet + -packet % 64


class _Geometry:
    """A bottom-level structure: Embree scenes with a geometry per section, over pica's own vertices.

    `scene` has all sections, `cutouts` those that are not opaque; 0 if there are none.
    """

    def __init__(self, device: Device, source: RtGeometry, culled: bool) -> None:
        self._embree, self._device, self._source, self._culled = embree.library(), device, source, culled
        self._triangles = [section for section in source.sections if isinstance(section, RtSection)]
        self._sections = [self._section(section) for section in self._triangles]
        self.scene = self._scene(dict(enumerate(self._sections)))
        cutouts = {n: g for n, g in enumerate(self._sections) if not self._triangles[n].opaque}
        self.cutouts = self._scene(cutouts) if cutouts else 0
        self._builds = self._refits = 0
        self.updates = 0
        """Counts builds and refits."""
        self.update()

    def _section(self, section: RtSection) -> int:
        geometry = self._embree.NewGeometry(embree.embree_device(), embree.TRIANGLES)
        self._embree.SetGeometryMask(geometry, OPAQUE if section.opaque else CUTOUT)
        self._embree.SetGeometryEnableFilterFunctionFromArguments(geometry, self._culled)
        return int(geometry)

    def _scene(self, sections: dict[int, int]) -> int:
        scene = self._embree.NewScene(embree.embree_device())
        if self._source.deforms:
            self._embree.SetSceneFlags(scene, embree.DYNAMIC_SCENE)
        else:
            self._embree.SetSceneBuildQuality(scene, embree.HIGH_QUALITY)
        for number, section in sections.items():
            self._embree.AttachGeometryByID(scene, section, number)
        return int(scene)

    def update(self) -> None:
        """Build or refit after the source was built or refitted."""
        source = self._source
        if (self._builds, self._refits) == (source.builds, source.refits):
            return
        self.updates += 1
        quality = embree.MEDIUM_QUALITY if self._builds != source.builds else embree.REFIT_QUALITY
        self._builds, self._refits = source.builds, source.refits
        assert source.buffers is not None
        self._kept = [(buffer, HostBuffer(self._device, buffer).read()) for buffer in source.buffers]
        positions, indices = (data.ctypes.data for _, data in self._kept)
        for geometry, section in zip(self._sections, self._triangles, strict=True):
            shared = partial(self._embree.SetSharedGeometryBuffer, geometry)
            start, count = 12 * section.first_vertex, section.vertex_count
            shared(embree.VERTEX_BUFFER, 0, embree.FLOAT3, positions, start, 12, count)
            start, count = 4 * section.first_index, section.index_count // 3
            shared(embree.INDEX_BUFFER, 0, embree.UINT3, indices, start, 12, count)
            if source.deforms:
                self._embree.SetGeometryBuildQuality(geometry, quality)
            self._embree.CommitGeometry(geometry)
        for scene in filter(None, (self.scene, self.cutouts)):
            self._embree.CommitScene(scene)

    def __del__(self) -> None:
        for section in self._sections:
            self._embree.ReleaseGeometry(section)
        for scene in filter(None, (self.scene, self.cutouts)):
            self._embree.ReleaseScene(scene)


class _Top:
    """A top-level structure: an Embree scene of instances, numbered as pica's slots."""

    def __init__(self) -> None:
        self._embree = embree.library()
        self.scene = self._embree.NewScene(embree.embree_device())
        self._embree.SetSceneFlags(self.scene, embree.DYNAMIC_SCENE)
        self._instances: dict[int, int] = {}
        self.commit()  # an empty scene can be traced too, once it is committed

    def __len__(self) -> int:
        return len(self._instances)

    def add(self, slot: int, geometry: int) -> None:
        """A slot shows this Embree scene."""
        instance = self._instances[slot] = self._embree.NewGeometry(embree.embree_device(), embree.INSTANCE)
        self._embree.SetGeometryInstancedScene(instance, geometry)
        self._embree.AttachGeometryByID(self.scene, instance, slot)

    def remove(self, slot: int) -> None:
        """Empty a slot; nothing happens where it is empty already."""
        instance = self._instances.pop(slot, None)
        if instance is not None:
            self._embree.DetachGeometry(self.scene, slot)
            self._embree.ReleaseGeometry(instance)

    def place(self, slots: list[int], transforms: NDArray[np.float32], masks: list[int]) -> None:
        """Place the objects of slots, (n, 3, 4) object to world; takes effect with `commit`."""
        first, size = transforms.ctypes.data, transforms.strides[0]
        for number, (slot, mask) in enumerate(zip(slots, masks, strict=True)):
            instance = self._instances.get(slot)
            if instance is not None:
                self._embree.SetGeometryMask(instance, mask)
                self._embree.SetGeometryTransform(instance, 0, embree.ROWS_3X4, first + number * size)
                self._embree.CommitGeometry(instance)

    def commit(self) -> None:
        """Rebuild from the current instances."""
        self._embree.CommitScene(self.scene)

    def __del__(self) -> None:
        for instance in self._instances.values():
            self._embree.ReleaseGeometry(instance)
        self._embree.ReleaseScene(self.scene)


class _Shared:
    """What the tracers on a device have in common: bottom-level structures, and threads, which serve one at a time."""

    def __init__(self, device: Device) -> None:
        self.geometries: WeakValueDictionary[_Key, _Geometry] = WeakValueDictionary()
        self.workers = [_Worker() for _ in range(_cores())]
        self.threads = ThreadPoolExecutor(len(self.workers), "embree")


class EmbreeTracer:
    """Traces ray buffers with Embree on every core. Raises DeviceError when it is not installed."""

    def __init__(self, device: Device, scene: RtView) -> None:
        self._device, self._source, self._changes = device, scene, scene.watch()
        self._all, self._cutouts = _Top(), _Top()
        self._geometries: dict[_Key, _Geometry] = {}
        self._updates: dict[_Key, int] = {}
        """`updates` of the geometries that the top levels are built from."""
        self._shown: dict[int, RtObject] = {}
        self._users: dict[_Key, set[int]] = {}
        self._records = np.zeros(1, np.uint32)
        self._loops = loops()
        self._functions = [embree.library().address(name) for name in ("Intersect16", "Occluded16")]
        # RTCIntersectArguments: flags (coherent rays), features (all), context, filter, intersection function.
        self._culling = np.array([1 << 16 | 0xFFFFFFFF << 32, 0, self._loops.cull_backs, 0, 0, 0], np.uint64)
        self._shared = device.shared(_Shared)

    def __call__(self, recording: Recording, queue: RayQueue) -> bool:
        """Trace the rays in the queue. The device has finished filling it."""
        started = time.perf_counter()
        self._update()
        rays, hits, places = (HostBuffer(self._device, b) for b in (queue.rays, queue.hits, queue.places))
        waiting = places.read().view(np.uint32)
        ray_data, hit_data = rays.read(), hits.read()
        intersect, occluded = self._functions
        cutouts = self._cutouts.scene if len(self._cutouts) else 0
        values, records = (ray_data.ctypes.data, hit_data.ctypes.data), self._records.ctypes.data

        def nearest(part: NDArray[np.uint32], worker: _Worker) -> None:
            own = *values, part.ctypes.data, len(part), records, worker.packet
            self._loops.nearest(intersect, self._all.scene, self._culling.ctypes.data, *own, worker.room)

        def shadows(part: NDArray[np.uint32], worker: _Worker) -> None:
            own = *values, part.ctypes.data, len(part), records, worker.packet
            self._loops.shadows(intersect, occluded, self._all.scene, cutouts, *own)

        self._run(nearest, waiting[: queue.nearest])
        self._run(shadows, waiting[len(waiting) - queue.shadows :])
        hits.write(hit_data)
        places.write(waiting.view(np.uint8))
        recording.profiler.add("embree", time.perf_counter() - started)
        return True

    def _run(self, trace: Callable[[NDArray[np.uint32], _Worker], None], places: NDArray[np.uint32]) -> None:
        if len(places) <= _CHUNK:
            if len(places):
                trace(places, self._shared.workers[0])
            return
        chunks = iter(range(0, len(places), _CHUNK))
        lock = threading.Lock()

        def work(worker: _Worker) -> None:
            while True:
                with lock:
                    begin = next(chunks, None)
                if begin is None:
                    return
                trace(places[begin : begin + _CHUNK], worker)

        first, *others = self._shared.workers
        running = [self._shared.threads.submit(work, worker) for worker in others]
        work(first)
        for other in running:
            other.result()

    def _update(self) -> None:
        """Apply objects placed, moved, removed or deformed since the last rays."""
        moved, objects = self._changes.take(), self._source.objects
        come: defaultdict[RtObject, list[int]] = defaultdict(list)
        for slot in moved:
            placed, before = objects.get(slot), self._shown.get(slot)
            if placed != before:
                if before is not None:
                    self._hide(slot)
                if placed is not None:
                    come[placed].append(slot)
        for placed, slots in come.items():
            self._show(placed, slots)
        for key, geometry in self._geometries.items():
            if key[0].deforms:
                geometry.update()
                if self._updates[key] != geometry.updates:
                    self._updates[key] = geometry.updates
                    moved |= self._users[key]
        if not moved:
            return
        slots = list(moved & self._shown.keys())
        rows = self._source.slots.rows[slots]
        transforms, masks = rows["transform"].copy(), rows["id_and_mask"] >> 24
        flat = np.linalg.det(transforms[:, :, :3]) == 0  # degenerate: not invertible, and never hit
        transforms[flat], masks[flat] = np.eye(3, 4), 0
        for top in (self._all, self._cutouts):
            if len(top):
                top.place(slots, transforms, masks.tolist())
        if max(slots, default=0) >= len(self._records):
            self._records = np.resize(self._records, 2 * max(slots) + 1)
        self._records[slots] = rows["id_and_mask"] & 0xFFFFFF
        self._all.commit()
        self._cutouts.commit()
        embree.check()

    def _hide(self, slot: int) -> None:
        key = _key(self._shown.pop(slot))
        self._all.remove(slot)
        self._cutouts.remove(slot)
        self._users[key].discard(slot)
        if not self._users[key]:
            del self._users[key], self._geometries[key], self._updates[key]

    def _show(self, placed: RtObject, slots: list[int]) -> None:
        key = _key(placed)
        if key not in self._geometries:
            shared = self._shared.geometries
            self._geometries[key] = shared[key] = shared.get(key) or _Geometry(self._device, *key)
            self._updates[key] = self._geometries[key].updates
        geometry = self._geometries[key]
        self._shown.update(dict.fromkeys(slots, placed))
        self._users.setdefault(key, set()).update(slots)
        for slot in slots:
            self._all.add(slot, geometry.scene)
            if geometry.cutouts:
                self._cutouts.add(slot, geometry.cutouts)


def _key(placed: RtObject) -> _Key:
    return placed.geometry, ObjectFlags.CULL_DISABLE not in placed.flags


def _cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
