"""Buffers as NumPy arrays: in place if device memory is host memory, else through copies."""

import ctypes

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device


class HostBuffer:
    """A buffer's content on the host. The device must be idle while the host reads or writes.

    lavapipe's buffers lie in the process's own memory and their device address is a pointer, so nothing is copied.
    """

    def __init__(self, device: Device, buffer: spy.Buffer) -> None:
        self._buffer = buffer
        self._shared: NDArray[np.uint8] | None = None
        if "llvmpipe" in device.name:
            memory = (ctypes.c_uint8 * buffer.size).from_address(buffer.device_address)
            self._shared = np.frombuffer(memoryview(memory), np.uint8)

    def read(self) -> NDArray[np.uint8]:
        """The content of the buffer, (bytes,)."""
        return self._buffer.to_numpy().view(np.uint8).reshape(-1) if self._shared is None else self._shared

    def write(self, data: NDArray[np.uint8]) -> None:
        """Write back content that was read and changed, (bytes,)."""
        if self._shared is None:
            self._buffer.copy_from_numpy(data)


class Readback:
    """Memory of the host to which the device copies, so that reading needs no work of the device."""

    def __init__(self, device: Device, label: str, size: int) -> None:
        """`size`: in bytes."""
        with device.allocating(f"{label}, {size:,} bytes"):
            self._buffer = device.handle.create_buffer(
                size=size, memory_type=spy.MemoryType.read_back, usage=spy.BufferUsage.copy_destination, label=label
            )
        device.count_memory(self._buffer.memory_usage.device)

    def copy(self, encoder: spy.CommandEncoder, place: int, source: spy.Buffer, first: int, size: int) -> None:
        """Record a copy of `size` bytes."""
        if size:
            encoder.copy_buffer(self._buffer, place, source, first, size)

    def read(self) -> NDArray[np.uint8]:
        """(bytes,) once the device has finished the copies."""
        return self._buffer.to_numpy().view(np.uint8).reshape(-1)
