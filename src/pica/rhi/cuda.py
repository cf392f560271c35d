"""Memory that a Vulkan device shares with CUDA, for PyTorch."""

import atexit
import sys
import threading
from collections import deque
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

import slangpy as spy

if TYPE_CHECKING:
    from pica.rhi.device import Device


def is_wanted(adapter: spy.AdapterInfo) -> bool:
    """Whether to open a device for sharing: PyTorch is imported, and its first CUDA device is this adapter.

    CUDA takes hundreds of megabytes of a card, which programs without tensors should not pay.
    """
    torch: Any = sys.modules.get("torch")
    if torch is None or "nvidia" not in adapter.name.lower() or not torch.cuda.is_available():
        return False
    # SlangPy's tensors are of CUDA's first device. On Linux an adapter is identified by the UUID that CUDA has too.
    uuid = str(torch.cuda.get_device_properties(0).uuid).replace("-", "")
    return torch.cuda.device_count() == 1 or bytes(adapter.luid).hex() == uuid


_MADE: "WeakSet[SharedBuffer]" = WeakSet()


@atexit.register
def _forget() -> None:
    """Before SlangPy closes its devices, which PyTorch's tensors still ask for."""
    for shared in _MADE:
        shared.tensor = None


class SharedBuffer:
    """Memory that passes can write and that CUDA can read, on a device that shares memory."""

    def __init__(self, device: "Device", label: str, size: int) -> None:
        self.size = size
        usage = spy.BufferUsage.unordered_access | spy.BufferUsage.copy_source
        shares = device.handle.supports_cuda_interop
        with device.allocating(label):
            self.buffer = device.handle.create_buffer(
                size=size, struct_size=4, usage=usage | (spy.BufferUsage.shared if shares else 0), label=label
            )
        self.tensor: Any = self.buffer.to_torch(type=spy.DataType.float32, shape=[size // 4]) if shares else None
        """All of it, for PyTorch."""
        _MADE.add(self)


class Loan:
    """A shared buffer, until this object and all tensors made of it have gone. For PyTorch an array of bytes."""

    def __init__(self, buffers: "SharedBuffers", shared: SharedBuffer) -> None:
        self._buffers, self._shared, self.buffer = buffers, shared, shared.buffer

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        pointer = self._shared.tensor.data_ptr()
        return {"shape": (self._shared.size,), "typestr": "|u1", "data": (pointer, False), "version": 3}

    def __del__(self) -> None:
        self._buffers.give_back(self._shared)


class SharedBuffers:
    """Lends shared buffers. It keeps those that come back: to make one, and to show it to CUDA, takes milliseconds."""

    KEPT = 8

    def __init__(self, device: "Device") -> None:
        self._device, self._lock = device, threading.Lock()
        self._free: deque[SharedBuffer] = deque(maxlen=self.KEPT)

    def lend(self, label: str, size: int) -> Loan:
        """A buffer of `size` bytes, a multiple of 4. Its content is undefined."""
        with self._lock:
            found = next((shared for shared in reversed(self._free) if shared.size == size), None)
            if found is not None:
                self._free.remove(found)
        if found is None:
            return Loan(self, SharedBuffer(self._device, label, size))
        if found.tensor is not None:
            sys.modules["torch"].cuda.synchronize()  # kernels may still read what has been a tensor
        return Loan(self, found)

    def give_back(self, shared: SharedBuffer) -> None:
        """The end of a loan. Those unused for longest are freed."""
        with self._lock:
            self._free.append(shared)
