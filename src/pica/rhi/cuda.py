"""Memory that a Vulkan device shares with CUDA, for PyTorch."""

import sys
from typing import TYPE_CHECKING, Any

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


def shared_buffer(device: "Device", label: str, size: int) -> spy.Buffer:
    """A buffer of `size` bytes that passes can write, and that CUDA can read on a device that shares memory."""
    usage = spy.BufferUsage.unordered_access | spy.BufferUsage.copy_source
    if device.handle.supports_cuda_interop:
        usage |= spy.BufferUsage.shared
    with device.allocating(label):
        return device.handle.create_buffer(size=size, struct_size=4, usage=usage, label=label)
