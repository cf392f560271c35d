"""Part of a queue of rays on its way to another device, and the hits that come back."""

from dataclasses import dataclass

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device
from pica.rhi.host_memory import Readback
from pica.rhi.passes import Recording
from pica.tracing.ray_buffers import HIT, RAY, RayQueue

PACKED_HIT = HIT + 4
"""Bytes of a hit on its way back, with what tracing has noted in its ray (pack_hits.slang)."""


@dataclass(frozen=True)
class QueuePart:
    """Ranges of a queue's places."""

    nearest: range
    shadows: range

    @property
    def count(self) -> int:
        """How many rays."""
        return len(self.nearest) + len(self.shadows)


class PackedRays:
    """The device's side of the copies to and from another device: one after the other, a part of a queue each."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._pack = device.compute("tracing/pack_rays.slang")
        self._unpack = device.compute("tracing/unpack_hits.slang")
        self._buffers: dict[int, tuple[spy.Buffer, Readback, spy.Buffer]] = {}
        self._alike = device.buffer("records alike", size=4, struct_size=4)
        self._records: spy.Buffer | None = None
        self._numbers: NDArray[np.uint32] | None = None

    def pack(self, recording: Recording, queue: RayQueue, part: QueuePart) -> None:
        """Record the gathering of the part's rays, and their copy to the host."""
        rays, self._rays, self._hits = self._room(part.count)
        self._parameters = {
            "queue": queue.places,
            "first": spy.uint2(part.nearest.start, part.shadows.start),
            "count": spy.uint2(len(part.nearest), len(part.shadows)),
        }
        threads = (part.count, 1, 1)
        self._pack(recording, threads, rays=queue.rays, packedRays=rays, **self._parameters)
        self._rays.copy(recording.encoder, 0, rays, 0, part.count * RAY)

    def rays(self) -> NDArray[np.uint8]:
        """The rays, once they are gathered: (bytes,), of which the last may belong to none."""
        return self._rays.read()

    def unpack(
        self, recording: Recording, queue: RayQueue, hits: NDArray[np.uint8], numbers: NDArray[np.uint32] | None
    ) -> None:
        """Record the upload of the rays' hits, and put them in their places. `numbers`: of records on this device, by
        those on the other; None: alike."""
        if numbers is not self._numbers:
            self._numbers = numbers
            if self._records is not None:
                self._device.give_back(self._records)
            self._records = None if numbers is None else self._device.structured("records of another device", numbers)
        recording.encoder.upload_buffer_data(self._hits, 0, hits)
        self._unpack(
            recording,
            (len(hits) // PACKED_HIT, 1, 1),
            packedHits=self._hits,
            hits=queue.hits,
            rays=queue.rays,
            records=self._records or self._alike,
            recordCount=0 if numbers is None else len(numbers),
            **self._parameters,
        )

    def _room(self, count: int) -> tuple[spy.Buffer, Readback, spy.Buffer]:
        """For a power of two of rays: few sizes, which all stay."""
        capacity = power_of_two(count)
        if capacity not in self._buffers:
            self._buffers[capacity] = (
                self._device.buffer("packed rays", size=capacity * RAY, struct_size=4),
                Readback(self._device, "packed rays on the host", capacity * RAY),
                self._device.buffer("packed hits", size=capacity * PACKED_HIT, struct_size=4),
            )
        return self._buffers[capacity]


def power_of_two(count: int) -> int:
    """The least one that is not below `count`."""
    return 1 << max(count - 1, 0).bit_length()
