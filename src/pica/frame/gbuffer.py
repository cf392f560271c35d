"""The G-buffer's textures, as one block that shaders read."""

import slangpy as spy

from pica.frame.context import FrameContext, Size, half_size
from pica.rhi.device import Device

_FORMATS = {
    "visibility": spy.Format.rg32_uint,
    "depth": spy.Format.r32_float,
    "normals": spy.Format.rg32_uint,
    "material": spy.Format.rgba32_uint,
    "emission": spy.Format.rg32_uint,
    "motion": spy.Format.rg32_uint,
}
_FOR_SOME = {"coats": spy.Format.rg32_uint, "lobes": spy.Format.rgba32_uint}
"""Of a single pixel until a material is seen that has any."""
_REMEMBERED = ("visibility", "depth", "normals")


class GBuffer:
    """What each pixel sees; the fields of frame/gbuffer.slang. Shapes are kept for one more frame, by turns."""

    def __init__(self, device: Device, size: Size) -> None:
        usage = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access

        def make(name: str) -> spy.Texture:
            more = spy.TextureUsage.render_target if name == "visibility" else spy.TextureUsage.none
            return device.texture(name, _FORMATS[name], size, usage | more)

        self._device, self._size = device, size
        self._turns = 0
        self._half: _HalfGBuffer | None = None
        self.textures = {name: make(name) for name in _FORMATS}
        self.textures |= {name: device.texture(name, kind, (1, 1), usage) for name, kind in _FOR_SOME.items()}
        self._usage = usage
        self._previous = {name: make(name) for name in _REMEMBERED}
        self.block = device.parameter_block("frame/gbuffer.slang", "gbuffer")

    def give_back(self) -> None:
        """Nobody needs these textures any more."""
        self._device.give_back(*self.textures.values(), *self._previous.values())
        if self._half is not None:
            self._half.buffer.give_back()

    def has_room_for(self, name: str) -> bool:
        """Whether there is room for "coats" or for "lobes", a texture more each."""
        texture = self.textures[name]
        return (texture.width, texture.height) == self._size

    def make_room_for(self, name: str) -> None:
        """Materials that have such may be seen from this frame on."""
        if not self.has_room_for(name):
            self._device.give_back(self.textures[name])
            self.textures[name] = self._device.texture(name, _FOR_SOME[name], self._size, self._usage)

    def turn(self) -> None:
        """Begin a frame: what was written so far is the previous frame's."""
        self._turns += 1
        for name in _REMEMBERED:
            self.textures[name], self._previous[name] = self._previous[name], self.textures[name]
        previous = {f"previous{name.capitalize()}": texture for name, texture in self._previous.items()}
        self.block.bind(**self.textures, **previous)

    def at_half(self, frame: FrameContext) -> "GBuffer":
        """The same for `frame.at_half()`; made once a frame, where it is asked for, and then takes a quarter more."""
        self._half = self._half or _HalfGBuffer(self._device, half_size(self._size))
        return self._half(frame.at_half(), self, self._turns)

    def forget(self, frame: FrameContext) -> None:
        """Keep nothing of the previous frame: no shape of now is found in it."""
        frame.encoder.clear_texture_uint(self._previous["visibility"])


class _HalfGBuffer:
    """Another G-buffer, filled with one pixel of each 2x2 of the full one (frame/half_gbuffer.slang)."""

    def __init__(self, device: Device, size: Size) -> None:
        self.buffer = GBuffer(device, size)
        self._pass = device.compute("frame/half_gbuffer.slang")
        self._filled = 0

    def __call__(self, frame: FrameContext, full: GBuffer, turn: int) -> GBuffer:
        """`frame`: at half size; `turn`: the number of the frame."""
        if self._filled == turn:
            return self.buffer
        for name in filter(full.has_room_for, _FOR_SOME):
            self.buffer.make_room_for(name)
        self.buffer.turn()
        if self._filled != turn - 1:
            self.buffer.forget(frame)
        self._filled = turn
        textures = {f"half{name.capitalize()}": texture for name, texture in self.buffer.textures.items()}
        kept = {"coated": full.has_room_for("coats"), "hasLobes": full.has_room_for("lobes")}
        self._pass(frame, frame.grid, frame=frame, gbuffer=full, **kept, **textures)
        return self.buffer
