"""KTX 2 pictures for the tests: the Basis Universal encoder has made those beside this file, of RAMP."""

import struct
from pathlib import Path

import numpy as np
import zstandard
from numpy.typing import NDArray

FOLDER = Path(__file__).parent / "ktx2_files"
_SIZE = 32
RAMP = np.zeros((_SIZE, _SIZE, 4), np.uint8)
"""(32, 32, 4): red grows to the right, green downwards, and alpha upwards."""
RAMP[..., 0] = 8 * np.arange(_SIZE)
RAMP[..., 1] = RAMP[..., 0].T
RAMP[..., 2] = 128
RAMP[..., 3] = 255 - RAMP[..., 1]
RGBA8, RGBA8_SRGB, RGB8, R8, BC5 = 37, 43, 23, 9, 141
"""VkFormats."""


def basis(name: str) -> bytes:
    """etc1s, etc1s_alpha, uastc or uastc_zstandard."""
    if name == "uastc_zstandard":
        return _with_zstandard(basis("uastc"))
    return (FOLDER / f"{name}.ktx2").read_bytes()


def plain(pixels: NDArray[np.uint8], vulkan_format: int, zstd: bool = False, claimed: int | None = None) -> bytes:
    """Pixels without block compression; `claimed`: their size in the header, where it is to be another."""
    height, width = pixels.shape[:2]
    data, size = pixels.tobytes(), pixels.nbytes if claimed is None else claimed
    if zstd:
        data = zstandard.ZstdCompressor().compress(data)
    header = struct.pack("<9I", vulkan_format, 1, width, height, 0, 0, 1, 1, 2 if zstd else 0)
    index = struct.pack("<4I2Q", 0, 0, 0, 0, 0, 0) + struct.pack("<3Q", 104, len(data), size)
    return b"\xabKTX 20\xbb\r\n\x1a\n" + header + index + data


def _with_zstandard(content: bytes) -> bytes:
    levels = struct.unpack_from("<I", content, 40)[0]
    entries = [struct.unpack_from("<3Q", content, 80 + 24 * level) for level in range(levels)]
    changed = bytearray(content[: min(start for start, _, _ in entries)])
    struct.pack_into("<I", changed, 44, 2)
    for level in reversed(range(levels)):  # the smallest comes first
        start, length, size = entries[level]
        data = zstandard.ZstdCompressor().compress(content[start : start + length])
        struct.pack_into("<3Q", changed, 80 + 24 * level, len(changed), len(data), size)
        changed += data
    return bytes(changed)
