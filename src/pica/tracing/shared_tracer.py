"""Rays of a frame shared among devices: ranges of a queue are traced elsewhere, and their hits come back.

As the talk on PICA PICA has it: the primary device generates the rays of the whole picture, copies parts of them to the
others, and alone shades and filters.
"""

import time
from collections.abc import Sequence

import numpy as np

from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.scene.camera import Camera
from pica.settings import RaysSettings, Settings
from pica.tracing.balance import Balance
from pica.tracing.fallbacks import say_once, traces
from pica.tracing.packed_rays import QueuePart
from pica.tracing.ray_buffers import RayQueue
from pica.tracing.secondary import Secondary
from pica.tracing.stopwatch import Stopwatch
from pica.tracing.tracers import buffer_tracer, uses_embree

FEWEST = 1 << 15
"""Rays of a queue that are worth copies; the primary traces smaller ones alone."""


def pays(device: Device, settings: RaysSettings) -> bool:
    """Whether several devices may be faster. A graphics card's ray tracing pipeline is faster than ray buffers, however
    many devices share them: then a warning, unless these are asked for."""
    if settings.scheduler == "buffers" or device.is_software or uses_embree(device, settings):
        return True
    slower = "one graphics card alone is faster than ray buffers that several share"
    say_once(device, f"devices: {slower}; the first renders alone (rays.scheduler=buffers shares them all the same)")
    return False


class SharedTracer:
    """A Tracer of the primary device with the help of others.

    Effects generate rays and shade hits on the primary alone. So others need no G-buffer, cache or history, and hits
    are the same bits whichever device finds them. Copies go through the host, because SlangPy's Vulkan devices share
    no memory with each other.
    """

    def __init__(self, device: Device, view: SceneView, others: Sequence[Device], settings: Settings) -> None:
        self._device, self._view = device.memory_scope(), view
        self.secondaries: list[Secondary] = []
        for other in others:
            if traces(other):
                number = len(self.secondaries) + 1
                self.secondaries.append(Secondary(other, self._device, number, view.source, settings))
            else:
                say_once(device, f"devices: {other.name!r} traces no rays; the others do without it")
        self._stopwatch = Stopwatch(device, laps=1)
        self._rays: RaysSettings | None = None
        self.configure(settings)

    def configure(self, settings: Settings) -> None:
        """Follow other settings."""
        for secondary in self.secondaries:
            secondary.configure(settings)
        if settings.rays != self._rays:
            self._rays = settings.rays
            self._own = buffer_tracer(self._device, settings.rays, self._view)
            self.balance = Balance(1 + len(self.secondaries))

    def sync(self) -> None:
        """Collect changes of the scene for all copies, as SceneView.sync."""
        for secondary in self.secondaries:
            secondary.scene.sync()

    def begin_frame(self, camera: Camera) -> None:
        """Upload these changes, and balance shares by the times of the frame before."""
        self.balance.end_frame()
        if self.secondaries and not self.balance.pays:
            self.secondaries = []
            saved = "copies of rays take longer than other devices save"
            say_once(self._device, f"devices: {saved}; the first renders alone from here on, leave the others out")
        for secondary in self.secondaries:
            secondary.update(camera)

    def __call__(self, recording: Recording, queue: RayQueue) -> bool:
        """Trace the rays in the queue; waits for them, unless they are too few to be shared."""
        if not self.secondaries or queue.nearest + queue.shadows < FEWEST:
            return self._own(recording, queue)
        started = time.perf_counter()
        own, parts = self._split(queue)
        for secondary, part in parts:
            secondary.pack(recording, queue, part)
        self._device.finish(recording)
        self._stopwatch.begin(recording)
        traced = self._own(recording, own)
        self._stopwatch.lap(recording, on_processor=traced)
        submission = self._device.submit(recording)
        for secondary, _ in parts:
            secondary.begin()
        for secondary, _ in parts:
            secondary.finish(recording, queue, self._view)
        self._device.submissions.wait(submission)
        rays, seconds = np.zeros(len(self.balance.shares)), np.zeros(len(self.balance.shares))
        rays[0], seconds[0] = own.nearest + own.shadows, self._stopwatch.seconds(0)
        for secondary, part in parts:
            rays[secondary.number], seconds[secondary.number] = part.count, secondary.seconds
            secondary.note(recording)
        self.balance.note(rays, seconds, time.perf_counter() - started)
        return traced

    def _split(self, queue: RayQueue) -> tuple[RayQueue, list[tuple[Secondary, QueuePart]]]:
        """The primary's part, and those of the others that have any. Shadow rays lie at the queue's end, and are
        split from there."""
        nearest, shadows = self.balance.split(queue.nearest), self.balance.split(queue.shadows)
        own = RayQueue(queue.rays, queue.hits, queue.places, nearest[0], shadows[0])
        ends = np.cumsum(nearest).tolist(), (queue.places.size // 4 - np.cumsum(shadows)).tolist()
        parts = [
            QueuePart(range(end - near, end), range(start, start + dark))
            for end, start, near, dark in zip(*ends, nearest, shadows, strict=True)
        ]
        return own, [(each, parts[each.number]) for each in self.secondaries if parts[each.number].count]
