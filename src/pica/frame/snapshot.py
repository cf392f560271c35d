"""Pictures that outlive the frame which made them."""

from collections.abc import Mapping
from operator import index

import slangpy as spy

from pica.errors import PicaError, shown
from pica.frame.context import Size
from pica.rhi.device import Device

LARGEST = 16384


def checked_size(size: Size) -> Size:
    """(width, height) as it is, or PicaError when no picture can have it."""
    try:
        width, height = (index(length) for length in size)
    except Exception:  # what going through it raises
        raise PicaError(f"picture size {shown(size)}: must be two whole numbers, width and height") from None
    if not (1 <= width <= LARGEST and 1 <= height <= LARGEST):
        raise PicaError(f"picture size {shown(width)}x{shown(height)}: width and height must be 1 to {LARGEST} pixels")
    return width, height


def copies(device: Device, textures: Mapping[str, spy.Texture]) -> dict[str, spy.Texture]:
    """Copies of the textures on the device, which later frames leave alone."""
    kept = {}
    encoder = device.handle.create_command_encoder()
    for name, texture in textures.items():
        kept[name] = device.handle.create_texture(
            format=texture.format,
            type=texture.type,
            array_length=texture.array_length,
            width=texture.width,
            height=texture.height,
            usage=spy.TextureUsage.shader_resource | spy.TextureUsage.copy_destination,
            label=f"{name} kept",
        )
        for layer in range(texture.array_length):
            encoder.copy_texture(
                kept[name],
                layer,
                0,
                spy.uint3(0, 0, 0),
                texture,
                layer,
                0,
                spy.uint3(0, 0, 0),
                spy.uint3(texture.width, texture.height, 1),
            )
    device.handle.submit_command_buffer(encoder.finish())
    return kept
