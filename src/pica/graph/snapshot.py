"""The content of a texture or buffer at one point of a recording, preserved from later frames."""

from functools import cache
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device
from pica.rhi.host_memory import HostBuffer

_KINDS = {spy.FormatType.float: "f", spy.FormatType.uint: "u", spy.FormatType.unorm: "u"}
_USAGE = spy.BufferUsage.copy_destination | spy.BufferUsage.copy_source | spy.BufferUsage.shader_resource


class SnapshotMemory:
    """Memory of several equal snapshots, which is read at once."""

    def __init__(self, device: Device, count: int = 1) -> None:
        self._device, self._count, self._taken = device, count, 0
        self.buffer: spy.Buffer
        self._content: NDArray[np.uint8] | None = None

    def take(self, size: int, what: str) -> int:
        """Where a snapshot of `size` bytes begins. `what`: for errors."""
        if self._taken == 0:
            total = size * self._count
            with self._device.allocating(what):
                self.buffer = self._device.handle.create_buffer(size=total, usage=_USAGE, label=what)
        self._taken += size
        return self._taken - size

    @property
    def is_read(self) -> bool:
        """Whether `content` was called."""
        return self._content is not None

    def content(self) -> NDArray[np.uint8]:
        """All of it, (bytes,). The device has finished the recording."""
        if self._content is None:
            self._content = HostBuffer(self._device, self.buffer).copied()
        return self._content


class Snapshot:
    """A copy, made when the device reaches this point of a recording.

    `buffer` holds, from byte `first` on, `size` bytes, texels of `dtype`: `shape` is (layers, height, width, channels),
    of a buffer (bytes,).
    """

    def __init__(
        self,
        device: Device,
        encoder: spy.CommandEncoder,
        source: spy.Texture | spy.Buffer,
        memory: SnapshotMemory | None = None,
    ) -> None:
        """Record the copy. It goes to a buffer, which costs the host a tenth of a texture. `memory`: shared with
        others."""
        self._layered = False
        self.memory = memory = memory or SnapshotMemory(device)
        if isinstance(source, spy.Buffer):
            self.shape: tuple[int, ...] = (source.size,)
            self.dtype = np.dtype(np.uint8)
            self.size = source.size
            self.first = memory.take(source.size, f"a copy of {source.size} bytes")
            encoder.copy_buffer(memory.buffer, self.first, source, 0, source.size)
            return
        self._layered = source.type == spy.TextureType.texture_2d_array
        self.dtype, channels, texel = _texel(source.format)
        self.shape = source.array_length, source.height, source.width, channels
        row = source.width * texel
        layer = row * source.height
        self.size = layer * source.array_length
        self.first = memory.take(self.size, f"a copy of {source.width}x{source.height} texels")
        for number in range(source.array_length):
            place = self.first + number * layer
            encoder.copy_texture_to_buffer(memory.buffer, place, layer, row, source, number, 0)

    @property
    def buffer(self) -> spy.Buffer:
        """The buffer that it is in."""
        return self.memory.buffer

    @property
    def is_read(self) -> bool:
        """Whether its memory is on the host already."""
        return self.memory.is_read

    def array(self) -> NDArray[Any]:
        """Of a texture (height, width[, channels]); layers in front, always with channels, of an array of textures. Of
        a buffer its bytes. The device has finished the recording.
        """
        own = self.memory.content()[self.first : self.first + self.size]
        values = own.view(self.dtype).reshape(self.shape)
        if self._layered or len(self.shape) == 1:
            return values
        return values[0] if self.shape[-1] > 1 else values[0, ..., 0]


@cache
def _texel(texture_format: spy.Format) -> tuple[np.dtype[Any], int, int]:
    """The type of a channel, their number, and bytes of all."""
    info = spy.get_format_info(texture_format)
    dtype = np.dtype(f"{_KINDS[info.type]}{info.bytes_per_block // info.channel_count}")
    return dtype, info.channel_count, info.bytes_per_block
