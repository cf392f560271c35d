"""The content of a texture or buffer at one point of a recording, preserved from later frames."""

from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device
from pica.rhi.host_memory import HostBuffer

_KINDS = {spy.FormatType.float: "f", spy.FormatType.uint: "u", spy.FormatType.unorm: "u"}
_USAGE = spy.BufferUsage.copy_destination | spy.BufferUsage.copy_source | spy.BufferUsage.shader_resource


class Snapshot:
    """A copy, made when the device reaches this point of a recording.

    `buffer` holds texels of `dtype`: `shape` is (layers, height, width, channels), of a buffer (bytes,).
    """

    def __init__(self, device: Device, encoder: spy.CommandEncoder, source: spy.Texture | spy.Buffer) -> None:
        """Record the copy. It goes to a buffer, which costs the host a tenth of a texture."""
        self._device = device
        self._layered = False
        if isinstance(source, spy.Buffer):
            self.shape: tuple[int, ...] = (source.size,)
            self.dtype = np.dtype(np.uint8)
            self.buffer = self._room(source.size, f"a copy of {source.size} bytes")
            encoder.copy_buffer(self.buffer, 0, source, 0, source.size)
            return
        info = spy.get_format_info(source.format)
        self._layered = source.type == spy.TextureType.texture_2d_array
        self.shape = source.array_length, source.height, source.width, info.channel_count
        self.dtype = np.dtype(f"{_KINDS[info.type]}{info.bytes_per_block // info.channel_count}")
        row = source.width * info.bytes_per_block
        layer = row * source.height
        self.buffer = self._room(layer * source.array_length, f"a copy of {source.width}x{source.height} texels")
        for number in range(source.array_length):
            encoder.copy_texture_to_buffer(self.buffer, number * layer, layer, row, source, number, 0)

    def _room(self, size: int, what: str) -> spy.Buffer:
        with self._device.allocating(what):
            return self._device.handle.create_buffer(size=size, usage=_USAGE, label=what)

    def array(self) -> NDArray[Any]:
        """Of a texture (height, width[, channels]); layers in front, always with channels, of an array of textures. Of
        a buffer its bytes. The device has finished the recording.
        """
        values = HostBuffer(self._device, self.buffer).copied().view(self.dtype).reshape(self.shape)
        if self._layered or len(self.shape) == 1:
            return values
        return values[0] if self.shape[-1] > 1 else values[0, ..., 0]
