"""Memory that builds of acceleration structures need while they run."""

import slangpy as spy

from pica.rhi.device import Device

_FIRST = 1 << 20  # bytes
_ALIGNMENT = 256  # Vulkan's upper limit (minAccelerationStructureScratchOffsetAlignment)


class BuildScratch:
    """Scratch memory for builds and refits of bottom levels: one buffer per device, suballocated in order.

    When it is used up, allocation starts over: Slang-RHI inserts a barrier between two builds with one buffer.
    """

    def __init__(self, device: Device) -> None:
        self._device, self._used = device, 0
        self._buffer = device.buffer("build scratch", size=_FIRST)

    @property
    def size(self) -> int:
        """Bytes."""
        return self._buffer.size

    def take(self, size: int) -> spy.BufferOffsetPair:
        """At least `size` bytes for a build that is recorded next."""
        if size > self.size:
            self._device.give_back(self._buffer)
            self._buffer = self._device.buffer("build scratch", size=2 * size)
        offset = self._used if self._used + size <= self.size else 0
        self._used = -(-(offset + size) // _ALIGNMENT) * _ALIGNMENT
        return spy.BufferOffsetPair(self._buffer, offset)
