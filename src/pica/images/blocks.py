"""Pictures of BC7 blocks, which devices sample as they are (Khronos Data Format Specification 1.3, 20)."""

import io
import struct
from dataclasses import dataclass

import numpy as np
import PIL.Image
from numpy.typing import NDArray

SIDE, BYTES = 4, 16
"""Texels along each side of a block, and its bytes."""

_DXGI_BC7, _TEXTURE_2D = 98, 3


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
        # A DDS file of one level: Pillow decodes blocks in no other form.
        flags, texture, four_cc = 0x81007, 0x1000, 4
        header = struct.pack("<7I44x", 124, flags, height, width, self.levels[level].nbytes, 0, 1)
        header += struct.pack("<2I4s20x", 32, four_cc, b"DX10") + struct.pack("<I16x", texture)
        header += struct.pack("<5I", _DXGI_BC7, _TEXTURE_2D, 0, 1, 0)
        with PIL.Image.open(io.BytesIO(b"DDS " + header + self.levels[level].tobytes()), formats=("DDS",)) as image:
            return np.asarray(image.convert("RGBA")).copy()


def blocks_of(width: int, height: int) -> tuple[int, int]:
    """(rows, columns) of blocks of so many texels."""
    return -(-height // SIDE), -(-width // SIDE)
