"""Pictures of BC7 and BC6H blocks, which devices sample as they are (Khronos Data Format Specification 1.3, 20)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import PIL.Image
from numpy.typing import NDArray

SIDE, BYTES = 4, 16
"""Texels along each side of a block, and its bytes."""

BlockForm = Literal["BC7", "BC6H", "BC6HS"]
"""BC6H has half floats of red, green and blue: not negative ones, or, as BC6HS, signed ones."""
_NUMBERS = {"BC7": 7, "BC6H": 6, "BC6HS": 6}


@dataclass(frozen=True, eq=False)
class BlockPicture:
    """A picture and its mipmap levels, those of BC7 down to one block at most."""

    width: int
    height: int
    levels: tuple[NDArray[np.uint8], ...]
    """(rows of blocks, columns of blocks, 16) of each level."""

    form: BlockForm = "BC7"

    @property
    def is_float(self) -> bool:
        """Whether the values are linear, and may be above 1."""
        return self.form != "BC7"

    def pixels(self, level: int = 0) -> NDArray[np.uint8]:
        """(height, width, 4) of a level, row 0 on top; of floats those from 0 to 1."""
        width, height = max(self.width >> level, 1), max(self.height >> level, 1)
        content, mode = self.levels[level].tobytes(), "RGB" if self.is_float else "RGBA"
        image = PIL.Image.frombytes(mode, (width, height), content, "bcn", _NUMBERS[self.form], self.form)
        return np.array(image.convert("RGBA"))


def blocks_of(width: int, height: int) -> tuple[int, int]:
    """(rows, columns) of blocks of so many texels."""
    return -(-height // SIDE), -(-width // SIDE)
