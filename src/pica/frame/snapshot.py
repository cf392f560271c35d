"""Pictures that outlive the frame which made them."""

from operator import index
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import PicaError, shown
from pica.frame.context import Size
from pica.rhi.device import Device
from pica.rhi.host_memory import HostBuffer

LARGEST = 16384
_KINDS = {spy.FormatType.float: "f", spy.FormatType.uint: "u", spy.FormatType.unorm: "u"}
_USAGE = spy.BufferUsage.copy_destination | spy.BufferUsage.copy_source | spy.BufferUsage.shader_resource


def checked_size(size: Size) -> Size:
    """(width, height) as it is, or PicaError when no picture can have it."""
    try:
        width, height = (index(length) for length in size)
    except Exception:  # what going through it raises
        raise PicaError(f"picture size {shown(size)}: must be two whole numbers, width and height") from None
    if not (1 <= width <= LARGEST and 1 <= height <= LARGEST):
        raise PicaError(f"picture size {shown(width)}x{shown(height)}: width and height must be 1 to {LARGEST} pixels")
    return width, height


class Snapshot:
    """What a texture holds when the device comes to this point of a recording, whatever later frames do."""

    def __init__(self, device: Device, encoder: spy.CommandEncoder, texture: spy.Texture) -> None:
        """Record the copy. It is a buffer, which costs the host a tenth of what a texture does."""
        info = spy.get_format_info(texture.format)
        self._layered = texture.type == spy.TextureType.texture_2d_array
        self._shape = texture.array_length, texture.height, texture.width, info.channel_count
        self._dtype = np.dtype(f"{_KINDS[info.type]}{info.bytes_per_block // info.channel_count}")
        row = texture.width * info.bytes_per_block
        layer = row * texture.height
        what = f"a copy of {texture.width}x{texture.height} texels"
        with device.allocating(what):
            self._buffer = device.handle.create_buffer(size=layer * texture.array_length, usage=_USAGE, label=what)
        for number in range(texture.array_length):
            encoder.copy_texture_to_buffer(self._buffer, number * layer, layer, row, texture, number, 0)
        self._device = device

    def array(self) -> NDArray[Any]:
        """(height, width[, channels]); layers in front, always with channels, of an array of textures.

        The device has finished the recording.
        """
        data = HostBuffer(self._device, self._buffer).read()
        values = data.copy().view(self._dtype).reshape(self._shape)
        if self._layered:
            return values
        return values[0] if self._shape[-1] > 1 else values[0, ..., 0]
