"""Buffers as NumPy arrays: in place if device memory is host memory, else through copies."""

import ctypes
from collections import OrderedDict
from weakref import proxy

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device


class HostBuffer:
    """A buffer's content on the host. The device must be idle while the host reads or writes.

    lavapipe's buffers lie in the process's own memory and their device address is a pointer, so nothing is copied.
    """

    def __init__(self, device: Device, buffer: spy.Buffer) -> None:
        self._device, self._buffer = device, buffer
        self._shared: NDArray[np.uint8] | None = None
        if "llvmpipe" in device.name:
            memory = (ctypes.c_uint8 * buffer.size).from_address(buffer.device_address)
            self._shared = np.frombuffer(memoryview(memory), np.uint8)

    def read(self) -> NDArray[np.uint8]:
        """The content of the buffer, (bytes,)."""
        if self._shared is not None:
            return self._shared
        return self._device.shared(_Readbacks).read(self._buffer)

    def copied(self) -> NDArray[np.uint8]:
        """As `read`, in an array of its own."""
        return self.read() if self._shared is None else self._shared.copy()

    def write(self, data: NDArray[np.uint8]) -> None:
        """Write back content that was read and changed, (bytes,)."""
        if self._shared is None:
            self._buffer.copy_from_numpy(data)


_KEPT = 128 << 20
"""Bytes of host memory that reads of a device keep at most."""


class _Readbacks:
    """Host memory for reads, which stays: allocating it takes most of the time of a read (8 MB: 4.7 of 5.5 ms)."""

    def __init__(self, device: Device) -> None:
        self._device: Device = proxy(device)  # which has this
        self._by_size: OrderedDict[int, Readback] = OrderedDict()
        """Those used last are the last."""

    def read(self, buffer: spy.Buffer) -> NDArray[np.uint8]:
        """The content of a buffer, (bytes,). Waits for the device."""
        device, size = self._device, buffer.size
        with device.lock:
            readback = self._by_size.pop(size, None) or Readback(device, "a read", size)
            self._by_size[size] = readback
            with device.record() as recording:
                readback.copy(recording.encoder, 0, buffer, 0, size)
            device.submissions.wait_for_all()
            content = readback.read()
            while sum(self._by_size) > _KEPT:
                device.give_back(self._by_size.popitem(last=False)[1].buffer)
            return content


class Readback:
    """Memory of the host to which the device copies, so that reading needs no work of the device."""

    def __init__(self, device: Device, label: str, size: int) -> None:
        """`size`: in bytes."""
        with device.allocating(f"{label}, {size:,} bytes"):
            self.buffer = device.handle.create_buffer(
                size=size, memory_type=spy.MemoryType.read_back, usage=spy.BufferUsage.copy_destination, label=label
            )
        device.count_memory(self.buffer.memory_usage.device)

    def copy(self, encoder: spy.CommandEncoder, place: int, source: spy.Buffer, first: int, size: int) -> None:
        """Record a copy of `size` bytes."""
        if size:
            encoder.copy_buffer(self.buffer, place, source, first, size)

    def read(self) -> NDArray[np.uint8]:
        """(bytes,) once the device has finished the copies."""
        return self.buffer.to_numpy().view(np.uint8).reshape(-1)
