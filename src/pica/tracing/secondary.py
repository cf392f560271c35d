"""Another device that traces part of a frame's rays."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import DeviceError
from pica.gpu_scene.view import SceneView
from pica.graph.plan import PlanPart
from pica.rhi.device import Device
from pica.rhi.host_memory import Readback
from pica.rhi.passes import DeviceRecording, Recording
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import RaysSettings, Settings
from pica.tracing.fallbacks import runnable
from pica.tracing.packed_rays import PACKED_HIT, PackedRays, QueuePart, power_of_two
from pica.tracing.ray_buffers import HIT, RAY, RayQueue
from pica.tracing.stopwatch import Stopwatch
from pica.tracing.tracers import buffer_tracer, uses_embree


class Secondary:
    """A device with a copy of the scene, which follows a view of it on the primary device."""

    def __init__(self, device: Device, primary: Device, number: int, scene: Scene, settings: Settings) -> None:
        """`number`: in timings and messages, as equal devices have equal names."""
        self.number = number
        self._device = device.memory_scope()
        self._packed = PackedRays(primary)
        self._pack_hits = device.compute("tracing/pack_hits.slang")
        self._stopwatch = Stopwatch(device, laps=3)
        self._buffers: dict[int, tuple[spy.Buffer, spy.Buffer, spy.Buffer, spy.Buffer, Readback]] = {}
        self._numbers: tuple[object, NDArray[np.uint32] | None] = None, None
        self._rays: RaysSettings | None = None
        self._fault: Exception | None = None
        self._sending = self._tracing = self._receiving = 0.0
        """Seconds of the newest rays, copies by host and device."""
        with self._named("took over the scene"):
            self.scene = SceneView(device, scene, settings)
            self.configure(settings)

    def configure(self, settings: Settings) -> None:
        """Follow other settings."""
        settings = runnable(self._device, settings)
        self.scene.configure(settings)
        if settings.rays != self._rays:
            self._rays = settings.rays
            self._tracer = buffer_tracer(self._device, settings.rays, self.scene)
            self._is_on_processor = uses_embree(self._device, settings.rays)

    def update(self, camera: Camera) -> None:
        """Upload the changes of the scene that `scene.sync` has collected. Raises DeviceError for ever once it fails:
        the copy of the scene would be another one."""
        with self._named("took over a change of the scene"):
            if self._fault is not None:
                raise self._fault
            try:
                with self._device.record() as recording:
                    self.scene.update(recording, camera)
            except Exception as fault:
                self._fault = fault
                raise

    def pack(self, recording: Recording, queue: RayQueue, part: QueuePart) -> None:
        """Record on the primary the gathering of a part of its queue."""
        self._part = part
        self._packed.pack(recording, queue, part)

    def begin(self) -> None:
        """Copy these rays, once the primary has gathered them, and trace them."""
        with self._named("traced rays of a frame"):
            started = time.perf_counter()
            rays = self._packed.rays()
            nearest, shadows = len(self._part.nearest), len(self._part.shadows)
            queue, packed, self._hits = self._queue_for(nearest, shadows)
            recording = DeviceRecording(self._device.handle.create_command_encoder(), self._device.profiler)
            self._stopwatch.begin(recording)
            end = queue.places.size // 4
            for place, part in ((0, rays[: nearest * RAY]), (end - shadows, rays[nearest * RAY :][: shadows * RAY])):
                if len(part):
                    recording.encoder.upload_buffer_data(queue.rays, place * RAY, part)
            self._sending = time.perf_counter() - started
            if self._is_on_processor:  # Embree reads what the device has finished
                self._device.finish(recording)
            self._stopwatch.lap(recording)
            traced = self._tracer(recording, queue)
            self._stopwatch.lap(recording, on_processor=traced)
            if traced:
                _number(queue.places)
            self._pack_hits(
                recording,
                (self._part.count, 1, 1),
                rays=queue.rays,
                hits=queue.hits,
                packedHits=packed,
                queue=queue.places,
                first=spy.uint2(0, end - shadows),
                count=spy.uint2(nearest, shadows),
            )
            self._hits.copy(recording.encoder, 0, packed, 0, self._part.count * PACKED_HIT)
            self._stopwatch.lap(recording)
            self._submission = self._device.submit(recording)

    def finish(self, recording: Recording, queue: RayQueue, primary: SceneView) -> None:
        """Wait for the hits, and record on the primary that they go to their places in its queue."""
        with self._named("traced rays of a frame"):
            self._device.submissions.wait(self._submission)
            started = time.perf_counter()
            hits = self._hits.read()[: self._part.count * PACKED_HIT]
            self._packed.unpack(recording, queue, hits, self._numbers_on(primary))
            sent, self._tracing, received = (self._stopwatch.seconds(lap) for lap in range(3))
            self._sending += sent
            self._receiving = received + time.perf_counter() - started

    @property
    def seconds(self) -> float:
        """For the newest rays, after `finish`: copies and tracing."""
        return self._sending + self._tracing + self._receiving

    def note(self, recording: Recording) -> None:
        """Tell the profiler of the newest rays: copies are passes of their own in the frame graph."""
        profiler, name = recording.profiler, f"secondary {self.number}"
        profiler.add(f"trace_rays on {name}", self._tracing)
        owner = profiler.owner
        for copy, seconds, size in (
            (f"rays to {name}", self._sending, self._part.count * RAY),
            (f"hits from {name}", self._receiving, self._part.count * PACKED_HIT),
        ):
            if isinstance(owner, PlanPart):
                profiler.owner = owner._replace(copy=copy)
            profiler.add(copy, seconds, size)
        profiler.owner = owner

    def _numbers_on(self, primary: SceneView) -> NDArray[np.uint32] | None:
        """(records,) the primary's number of each record here; None where both number them alike. Copies of a scene
        that were made at different times have different holes in their tables."""
        own = self.scene
        state = [(view.scene.content_revision, view.own.placed) for view in (primary, own)]
        if self._numbers[0] != state:
            alike = np.arange(len(own.records), dtype=np.uint32)
            numbers = alike.copy()
            for node in own.scene.placements:
                here, there = own.records_of(node), primary.records_of(node)
                numbers[here.start : here.stop] = there
            self._numbers = state, None if np.array_equal(numbers, alike) else numbers
        return self._numbers[1]

    def _queue_for(self, nearest: int, shadows: int) -> tuple[RayQueue, spy.Buffer, Readback]:
        """Buffers for a power of two of rays: few sizes, which all stay."""
        capacity = power_of_two(nearest + shadows)
        if capacity not in self._buffers:
            strides = {"rays": RAY, "hits": HIT, "places": 4, "packed hits": PACKED_HIT}
            rays, hits, places, packed = (
                self._device.buffer(f"{name} of another device", size=capacity * stride, struct_size=stride)
                for name, stride in strides.items()
            )
            _number(places)
            readback = Readback(self._device, "hits on the host", capacity * PACKED_HIT)
            self._buffers[capacity] = rays, hits, places, packed, readback
        rays, hits, places, packed, readback = self._buffers[capacity]
        return RayQueue(rays, hits, places, nearest, shadows), packed, readback

    @contextmanager
    def _named(self, what: str) -> Iterator[None]:
        """Raises DeviceError with the device's name for anything that the block raises."""
        try:
            yield
        except Exception as error:
            who = f"secondary device {self.number} ({self._device.name!r})"
            raise DeviceError(f"{who} failed while it {what}: {error}") from error


def _number(places: spy.Buffer) -> None:
    """Each ray lies in its place; Embree reorders places."""
    places.copy_from_numpy(np.arange(places.size // 4, dtype=np.uint32))
