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
_REMEMBERED = ("visibility", "depth", "normals")


class GBuffer:
    """What each pixel sees; the fields of frame/gbuffer.slang. Shapes are kept for one more frame, by turns."""

    def __init__(self, device: Device, size: Size) -> None:
        usage = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access

        def make(name: str) -> spy.Texture:
            more = spy.TextureUsage.render_target if name == "visibility" else spy.TextureUsage.none
            return device.texture(name, _FORMATS[name], size, usage | more)

        self.textures = {name: make(name) for name in _FORMATS}
        self._previous = {name: make(name) for name in _REMEMBERED}
        self.block = device.parameter_block("frame/gbuffer.slang", "gbuffer")

    def turn(self) -> None:
        """Begin a frame: what was written so far is the previous frame's."""
        for name in _REMEMBERED:
            self.textures[name], self._previous[name] = self._previous[name], self.textures[name]
        previous = {f"previous{name.capitalize()}": texture for name, texture in self._previous.items()}
        self.block.bind(**self.textures, **previous)
