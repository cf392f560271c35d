"""What an effect remembers of the frames before."""

from collections.abc import Mapping

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.rhi.device import Device

_GROUP = 16
"""accumulate.slang: GROUP."""


def accumulate_grid(size: Size, layers: int = 1) -> tuple[int, int, int]:
    """Threads of a pass that calls accumulate.slang's `accumulate`: its groups begin elsewhere in each frame."""
    return size[0] + _GROUP, size[1] + _GROUP, layers


class History:
    """Textures in two sets that take turns: one holds what the previous frame left, the other takes this one's."""

    def __init__(
        self, device: Device, label: str, formats: Mapping[str, spy.Format], size: Size, layers: int | None = None
    ) -> None:
        """`formats`: of each texture, by the name that shaders have for it. `layers`: see Device.texture."""
        self._device, self._label, self._formats = device, label, dict(formats)
        self._sets: list[dict[str, spy.Texture]] = []
        self.length = 0
        """Frames since there was nothing."""
        self._newest = -1
        self.resize(size, layers)

    @property
    def current(self) -> dict[str, spy.Texture]:
        """The newest frame's textures."""
        return self._sets[0]

    @property
    def empty(self) -> bool:
        """Whether the previous frame left nothing."""
        return self.length <= 1

    def precedes(self, frame: FrameContext) -> bool:
        """Whether `current` is what the frame before this one left; to be asked before `turn`."""
        return self.length > 0 and frame.index == self._newest + 1

    def stays(self, frame: FrameContext, length: int) -> bool:
        """Whether what at least `length` frames up to the one before have left may stand for this frame too, in which
        nothing moves; then it does."""
        if self.length < length or not self.precedes(frame):
            return False
        self._newest = frame.index
        return True

    def turn(self, frame: FrameContext) -> dict[str, spy.Texture]:
        """Begin a frame. Returns what its pass reads and writes: `name` and `previousName` of each texture.

        What is older than the frame before is forgotten: reprojection leads one frame back.
        """
        self._sets.reverse()
        self.length = self.length + 1 if frame.index == self._newest + 1 else 1
        self._newest = frame.index
        previous = {f"previous{name[0].upper()}{name[1:]}": texture for name, texture in self._sets[1].items()}
        return {**self._sets[0], **previous}

    def reset(self) -> None:
        """Forget."""
        self.length, self._newest = 0, -1

    def give_back(self) -> None:
        """Nobody needs these textures any more."""
        self._device.give_back(*(texture for textures in self._sets for texture in textures.values()))

    def resize(self, size: Size, layers: int | None = None) -> None:
        """Make the textures anew, and forget."""
        self.give_back()
        self._sets = [
            {
                name: self._device.texture(f"{self._label} {name}", texture_format, size, layers=layers)
                for name, texture_format in self._formats.items()
            }
            for _ in range(2)
        ]
        self.reset()
