"""KTX 2 and DDS files of BC7 and BC6H blocks, which become blocks as they are.

KTX 2.0, 3 (https://registry.khronos.org/KTX/specs/2.0/ktxspec.v2.html); "DDS header" and DDS_HEADER_DXT10
(https://learn.microsoft.com/windows/win32/direct3ddds/dx-graphics-dds-pguide).
"""

import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.images import ktx2
from pica.images.blocks import BYTES, SIDE, BlockForm, BlockPicture, blocks_of

BYTES_PER_PIXEL = 6
"""Memory for decoding: blocks, once more if they are compressed again, and pixels."""
_VULKAN: dict[int, BlockForm] = {143: "BC6H", 144: "BC6HS", 145: "BC7", 146: "BC7"}
_DXGI: dict[int, BlockForm] = {95: "BC6H", 96: "BC6HS", 98: "BC7", 99: "BC7"}
_DDS, _DX10 = b"DDS ", b"DX10"
_DDS_DATA = 148
_TWO_DIMENSIONAL, _CUBE, _OF_CUBES = 3, 0x4, 0x200


class StoredBlocks(NamedTuple):
    """What a header says."""

    width: int
    height: int
    form: BlockForm
    levels: tuple[tuple[int, int], ...]
    """Start and length of each mipmap level in the file."""
    zstandard: bool


def read_header(content: bytes) -> StoredBlocks | None:
    """None for files that do not hold one two-dimensional picture of such blocks. Raises SceneError where the header's
    sizes do not fit each other."""
    if content.startswith(ktx2.KTX2):
        return _ktx2(content)
    return _dds(content) if content.startswith(_DDS) and content[84:88] == _DX10 else None


def decoded(content: bytes, stored: StoredBlocks) -> NDArray[np.uint8]:
    """(height, width, 4) of the first level; those of BC6H are linear, and at most 1. Raises SceneError."""
    return _picture(content, stored, 1).pixels()


def decoded_texture(content: bytes, stored: StoredBlocks) -> NDArray[np.uint8] | BlockPicture:
    """Blocks; pixels of BC7 without mipmap levels down to a block, which the device makes of them."""
    whole = max(stored.width, stored.height) >> (len(stored.levels) - 1) <= SIDE
    return _picture(content, stored, len(stored.levels)) if whole or stored.form != "BC7" else decoded(content, stored)


def _ktx2(content: bytes) -> StoredBlocks | None:
    if len(content) < ktx2.HEADER.size:
        return None
    _, vulkan_format, _, width, height, depth, layers, faces, levels, scheme = ktx2.HEADER.unpack_from(content)[:10]
    form = _VULKAN.get(vulkan_format)
    if form is None or depth or layers > 1 or faces != 1 or scheme not in (ktx2.NO_SCHEME, ktx2.ZSTANDARD):
        return None
    _check_levels(width, height, max(levels, 1))
    places = []
    for level in range(max(levels, 1)):
        start, length, size = ktx2.level_entry(content, level)
        if size != _bytes(width, height, level) or start + length > len(content):
            raise _misfit(width, height)
        places.append((start, length))
    return StoredBlocks(width, height, form, tuple(places), scheme == ktx2.ZSTANDARD)


def _dds(content: bytes) -> StoredBlocks | None:
    if len(content) < _DDS_DATA:
        return None
    height, width, _, _, levels = struct.unpack_from("<5I", content, 12)
    (caps,) = struct.unpack_from("<I", content, 112)
    dxgi, dimension, flags, count = struct.unpack_from("<4I", content, 128)
    form = _DXGI.get(dxgi)
    if form is None or dimension != _TWO_DIMENSIONAL or flags & _CUBE or caps & _OF_CUBES or count > 1:
        return None
    _check_levels(width, height, max(levels, 1))
    places, start = [], _DDS_DATA
    for level in range(max(levels, 1)):
        places.append((start, _bytes(width, height, level)))
        start += places[-1][1]
    if start > len(content):
        raise _misfit(width, height)
    return StoredBlocks(width, height, form, tuple(places), False)


def _check_levels(width: int, height: int, levels: int) -> None:
    if min(width, height) < 1 or levels > max(width, height).bit_length():
        raise SceneError(f"{levels} mipmap levels of {width}x{height} pixels are no picture")


def _size(width: int, height: int, level: int) -> tuple[int, int]:
    """(rows, columns) of a level's blocks."""
    return blocks_of(max(width >> level, 1), max(height >> level, 1))


def _bytes(width: int, height: int, level: int) -> int:
    rows, columns = _size(width, height, level)
    return rows * columns * BYTES


def _picture(content: bytes, stored: StoredBlocks, count: int) -> BlockPicture:
    """The first levels."""
    width, height = stored.width, stored.height
    levels = []
    for level, (start, length) in enumerate(stored.levels[:count]):
        data, size = content[start : start + length], _bytes(width, height, level)
        if stored.zstandard:
            data = ktx2.decompressed(data, size)
        if len(data) != size:
            raise _misfit(width, height)
        levels.append(np.frombuffer(data, np.uint8).reshape(*_size(width, height, level), BYTES))
    return BlockPicture(width, height, tuple(levels), stored.form)


def _misfit(width: int, height: int) -> SceneError:
    return SceneError(f"its data is not that of {width}x{height} pixels")
