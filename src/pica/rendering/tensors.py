"""AOVs decoded on the device: as arrays, and as CUDA tensors, which do not pass through the host's memory."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.context import Size
from pica.graph.offers import Decoder
from pica.graph.plan import Capture
from pica.graph.snapshot import Snapshot
from pica.rhi.cuda import Loan, SharedBuffers
from pica.rhi.device import Device
from pica.rhi.host_memory import HostBuffer
from pica.rhi.passes import ComputePass


def cuda_tensors(device: Device, size: Size, captures: Mapping[str, Capture]) -> dict[str, Callable[[], Any]]:
    """Functions that make a PyTorch tensor of each capture that the device can decode, by name; empty if the device
    shares no memory with CUDA. `size`: (width, height) of the tensors."""
    if not device.handle.supports_cuda_interop:
        return {}
    return {
        name: partial(_tensor, device, size, capture)
        for name, capture in captures.items()
        if isinstance(capture.read, Decoder)
    }


def cuda_tensor_of_all(device: Device, size: Size, captures: Sequence[Capture]) -> Any:
    """One tensor of an AOV of several views, (views, ...), made at once; None where it must be made view by view."""
    if not (device.handle.supports_cuda_interop and are_decoded_at_once(captures)):
        return None
    return _tensor(device, size, captures[0], len(captures))


def are_decoded_at_once(captures: Sequence[Capture]) -> bool:
    """Whether the device can decode all of these captures in one pass."""
    sources = zip(*(capture.parts for capture in captures), strict=True)
    return all(_are_alike(captures[0], capture) for capture in captures) and all(follow(parts) for parts in sources)


def decoded_array(device: Device, size: Size, capture: Capture, views: int = 1) -> NDArray[Any]:
    """An AOV as Frame.aov has it, decoded on the device, which is faster than NumPy on graphics cards. `views`: as
    `decoded`."""
    loan, dtype, shape = decoded(device, size, capture, views)
    assert isinstance(capture.read, Decoder)
    values = HostBuffer(device, loan.buffer).copied().view(dtype).reshape(shape)
    return values[..., : capture.read.channels] if capture.read.channels > 1 else values[..., 0]


def follow(parts: Sequence[Snapshot]) -> bool:
    """Whether snapshots lie one after the other in the same memory, from its beginning."""
    starts = range(0, len(parts) * parts[0].size, parts[0].size)
    return all(
        part.memory is parts[0].memory and part.first == start for part, start in zip(parts, starts, strict=True)
    )


def _are_alike(first: Capture, other: Capture) -> bool:
    """Whether both are decoded in the same way."""
    a, b = first.read, other.read
    if (
        not (isinstance(a, Decoder) and isinstance(b, Decoder))
        or a.kind != b.kind
        or a.values.keys() != b.values.keys()
    ):
        return False
    return all(np.array_equal(value, b.values[name]) for name, value in a.values.items())


def decoded(
    device: Device, size: Size, capture: Capture, views: int = 1
) -> tuple[Loan, np.dtype[Any], tuple[int, ...]]:
    """A capture decoded by its `Decoder` into a buffer of its own, with the type and the shape of its content.

    Channels that the buffer has beyond those of the AOV are not part of it. `views`: how many that follow it in memory
    are decoded with it, itself included; they are in front of the shape if they are several. Waits for the device.
    """
    read = capture.read
    assert isinstance(read, Decoder)
    source, records = capture.parts[0], capture.parts[-1]
    _, height, width, channels = source.shape
    words = source.dtype.itemsize * channels // 4
    stays = read.kind == 0
    dtype = source.dtype if stays else np.dtype(np.uint32 if "table" in read.values else np.float32)
    stored = words if stays else read.channels
    label, length = f"a tensor of {size[0]}x{size[1]} pixels", 4 * stored * size[0] * size[1] * views
    loan = device.shared(SharedBuffers).lend(label, length)
    table = np.ascontiguousarray(read.values.get("table", ()), np.uint32).reshape(-1, 1)
    with device.record() as recording:
        device.shared(_decode)(
            recording,
            (size[0], size[1] * views, 1),
            source=source.buffer,
            records=records.buffer,
            firsts=(source.first, records.first),
            table=device.structured("labels", table) if len(table) else device.shared(_no_table),
            result=loan.buffer,
            kind=int(read.kind),
            which=read.values.get("which", 0),
            sourceSize=(width, height * views),  # pictures one below the other
            resultSize=(size[0], size[1] * views),
            words=words,
            channels=stored,
            near=read.values.get("near", 0.0),
            far=read.values.get("far", 0.0),
        )
    with device.lock:
        device.handle.wait_for_idle()
    shape = size[1], size[0], channels if stays else read.channels
    return loan, dtype, shape if views == 1 else (views, *shape)


def _tensor(device: Device, size: Size, capture: Capture, views: int = 1) -> Any:
    import torch

    loan, dtype, shape = decoded(device, size, capture, views)
    assert isinstance(capture.read, Decoder)
    tensor: Any = torch.as_tensor(loan, device="cuda").view(getattr(torch, dtype.name)).reshape(shape)
    return tensor[..., : capture.read.channels] if capture.read.channels > 1 else tensor[..., 0]


def _no_table(device: Device) -> spy.Buffer:
    return device.structured("labels", np.zeros((1, 1), np.uint32))


def _decode(device: Device) -> ComputePass:
    return device.compute("frame/decode_aov.slang")
