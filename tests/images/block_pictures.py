"""KTX 2 and DDS files of blocks for the tests."""

import struct

import numpy as np
import zstandard
from numpy.typing import NDArray

VULKAN = {"BC6H": 143, "BC6HS": 144, "BC7": 145}
DXGI = {"BC6H": 95, "BC6HS": 96, "BC7": 98}


def float_block(color: tuple[float, float, float], signed: bool = False) -> NDArray[np.uint8]:
    """(16,) a BC6H block of one colour: mode 11, with both ends alike (Khronos Data Format Specification 1.3, 20.2)."""
    fields = 0b00011
    for channel, value in enumerate(color):
        half = int(np.float16(abs(value)).view(np.uint16))
        # The inverse of the decoder's "unquantize" and "finish unquantize" for 10 bits.
        bits = round((half * 32 / 31 - 32) / 64) if signed else round((half * 64 / 31 - 32) / 64)
        bits = -bits & 0x3FF if value < 0 else max(bits, 0)
        fields |= bits << (5 + 10 * channel) | bits << (35 + 10 * channel)
    return np.frombuffer(fields.to_bytes(16, "little"), np.uint8)


def levels_of(block: NDArray[np.uint8], side: int, count: int) -> list[NDArray[np.uint8]]:
    """Levels of a square picture whose blocks are all alike."""
    sides = [-(-max(side >> level, 1) // 4) for level in range(count)]
    return [np.broadcast_to(block, (n, n, 16)) for n in sides]


def ktx2_of(form: str, side: int, levels: list[NDArray[np.uint8]], zstd: bool = False) -> bytes:
    """A KTX 2 file."""
    stored = [zstandard.ZstdCompressor().compress(level.tobytes()) if zstd else level.tobytes() for level in levels]
    header = struct.pack("<9I", VULKAN[form], 1, side, side, 0, 0, 1, len(levels), 2 if zstd else 0)
    start = 80 + 24 * len(levels)
    index = b""
    for level, data in zip(levels, stored, strict=True):
        index += struct.pack("<3Q", start, len(data), level.nbytes)
        start += len(data)
    return b"\xabKTX 20\xbb\r\n\x1a\n" + header + bytes(32) + index + b"".join(stored)


def dds_of(form: str, side: int, levels: list[NDArray[np.uint8]]) -> bytes:
    """A DDS file."""
    header = struct.pack("<7I44x", 124, 0x20_1007, side, side, 0, 0, len(levels))
    header += struct.pack("<2I4s5I", 32, 4, b"DX10", 0, 0, 0, 0, 0) + struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    return b"DDS " + header + struct.pack("<5I", DXGI[form], 3, 0, 1, 0) + b"".join(each.tobytes() for each in levels)
