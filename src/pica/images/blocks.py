"""Pictures of BC7 blocks, which devices sample as they are (Khronos Data Format Specification 1.3, 20)."""

from dataclasses import dataclass

import numpy as np
import PIL.Image
from numpy.typing import NDArray

SIDE, BYTES = 4, 16
"""Texels along each side of a block, and its bytes."""


@dataclass(frozen=True, eq=False)
class BlockPicture:
    """A picture and its mipmap levels, down to one block at most."""

    width: int
    height: int
    levels: tuple[NDArray[np.uint8], ...]
    """(rows of blocks, columns of blocks, 16) of each level."""

    def pixels(self, level: int = 0) -> NDArray[np.uint8]:
        """(height, width, 4) of a level, row 0 on top."""
        width, height = max(self.width >> level, 1), max(self.height >> level, 1)
        image = PIL.Image.frombytes("RGBA", (width, height), self.levels[level].tobytes(), "bcn", 7, "BC7")
        return np.array(image)


def blocks_of(width: int, height: int) -> tuple[int, int]:
    """(rows, columns) of blocks of so many texels."""
    return -(-height // SIDE), -(-width // SIDE)
