"""The G-buffer's textures, as one block that shaders read."""

import slangpy as spy

from pica.frame.context import Size
from pica.rhi.device import Device

_FORMATS = {
    "visibility": spy.Format.rg32_uint,
    "depth": spy.Format.r32_float,
    "normals": spy.Format.rg32_uint,
    "material": spy.Format.rgba32_uint,
    "emission": spy.Format.rgba32_float,
    "motion": spy.Format.rgba32_float,
}


class GBuffer:
    """What each pixel sees; the fields of frame/gbuffer.slang."""

    def __init__(self, device: Device, size: Size) -> None:
        usage = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access
        self.textures = {
            name: device.texture(
                name,
                texture_format,
                size,
                usage | spy.TextureUsage.render_target if name == "visibility" else usage,
            )
            for name, texture_format in _FORMATS.items()
        }
        self.block = device.parameter_block("frame/gbuffer.slang", "gbuffer")
        self.block.bind(**self.textures)
