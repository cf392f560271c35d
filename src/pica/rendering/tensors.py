"""AOVs as CUDA tensors, decoded on the device: nothing passes through the host's memory."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import slangpy as spy

from pica.frame.context import Size
from pica.graph.offers import Decoder
from pica.graph.plan import Capture
from pica.rhi.cuda import Loan, SharedBuffers
from pica.rhi.device import Device
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


def decoded(device: Device, size: Size, capture: Capture) -> tuple[Loan, np.dtype[Any], tuple[int, ...]]:
    """A capture decoded by its `Decoder` into a buffer of its own, with the type and the shape of its content.

    Channels that the buffer has beyond those of the AOV are not part of it. Waits for the device.
    """
    read = capture.read
    assert isinstance(read, Decoder)
    source, records = capture.parts[0], capture.parts[-1]
    _, height, width, channels = source.shape
    words = source.dtype.itemsize * channels // 4
    stays = read.kind == 0
    dtype = source.dtype if stays else np.dtype(np.uint32 if "table" in read.values else np.float32)
    stored = words if stays else read.channels
    label, length = f"a tensor of {size[0]}x{size[1]} pixels", 4 * stored * size[0] * size[1]
    loan = device.shared(SharedBuffers).lend(label, length)
    table = np.ascontiguousarray(read.values.get("table", ()), np.uint32).reshape(-1, 1)
    with device.record() as recording:
        device.shared(_decode)(
            recording,
            (*size, 1),
            source=source.buffer,
            records=records.buffer,
            firsts=(source.first, records.first),
            table=device.structured("labels", table) if len(table) else device.shared(_no_table),
            result=loan.buffer,
            kind=int(read.kind),
            which=read.values.get("which", 0),
            sourceSize=(width, height),
            resultSize=size,
            words=words,
            channels=stored,
            near=read.values.get("near", 0.0),
            far=read.values.get("far", 0.0),
        )
    with device.lock:
        device.handle.wait_for_idle()
    return loan, dtype, (size[1], size[0], channels if stays else read.channels)


def _tensor(device: Device, size: Size, capture: Capture) -> Any:
    import torch

    loan, dtype, shape = decoded(device, size, capture)
    assert isinstance(capture.read, Decoder)
    tensor: Any = torch.as_tensor(loan, device="cuda").view(getattr(torch, dtype.name)).reshape(shape)
    return tensor[..., : capture.read.channels] if capture.read.channels > 1 else tensor[..., 0]


def _no_table(device: Device) -> spy.Buffer:
    return device.structured("labels", np.zeros((1, 1), np.uint32))


def _decode(device: Device) -> ComputePass:
    return device.compute("frame/decode_aov.slang")
