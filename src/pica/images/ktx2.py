"""KTX 2 pictures (https://registry.khronos.org/KTX/specs/2.0/ktxspec.v2.html), of Basis Universal or of plain pixels;
block_files.py reads those of other blocks.

Those of Basis Universal with mipmap levels become BC7 blocks, others the pixels of their first level. The libraries
decode in this process: mutated pictures neither crashed them nor held them up (docs/guide/security.md).
"""

import struct
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.images.blocks import SIDE, BlockPicture, blocks_of

KTX2 = b"\xabKTX 20\xbb\r\n\x1a\n"
BYTES_PER_PIXEL = 8
"""Memory for decoding: four for the result, at most four for what was compressed again."""

HEADER = struct.Struct("<12s9I4I2Q3Q")
"""With the first entry of the level index (3.1 and 3.9)."""
_UNDEFINED = 0
NO_SCHEME, _BASIS_LZ, ZSTANDARD = 0, 1, 2
"""Supercompression (3.8)."""
_CHANNELS = {9: 1, 15: 1, 16: 2, 22: 2, 23: 3, 29: 3, 37: 4, 43: 4}
"""Of VkFormats with 8 bits for each of red, green, blue and alpha: UNORM and SRGB, whose values are stored alike."""
_MOST_LEVELS = 15
_BLOCK, _BLOCK_BYTES = 4, 16
"""Pixels of a UASTC block along each side."""
_LEVELS_START, _LEVEL = 80, struct.Struct("<3Q")


class UnsupportedPictureError(SceneError):
    """A picture of a format that is not read, which need not be broken."""


class Ktx2Picture(NamedTuple):
    """What the header says."""

    width: int
    height: int
    channels: int
    """Of plain pixels; 0 for Basis Universal."""
    scheme: int
    """Of supercompression (3.8)."""
    start: int
    """Of the first level in the file."""
    length: int
    levels: int
    """Number of mipmap levels."""


def read_header(content: bytes) -> Ktx2Picture:
    """Raises UnsupportedPictureError for what is not one picture of a format that is read, and SceneError where the
    header's sizes do not fit each other."""
    if len(content) < HEADER.size:
        raise SceneError("truncated in its header")
    fields = HEADER.unpack_from(content)
    _, vulkan_format, _, width, height, depth, layers, faces, levels, scheme = fields[:10]
    start, length, uncompressed = fields[-3:]
    if vulkan_format not in (_UNDEFINED, *_CHANNELS) or scheme > ZSTANDARD:
        read = "only Basis Universal, BC6H, BC7 and 8-bit pixels"
        raise UnsupportedPictureError(f"KTX 2 of format {vulkan_format} and scheme {scheme} cannot be read, {read}")
    if depth or layers > 1 or faces != 1 or levels > _MOST_LEVELS or min(width, height) < 1:
        raise UnsupportedPictureError("KTX 2 that is not one two-dimensional picture cannot be read")
    channels = _CHANNELS.get(vulkan_format, 0)
    size = channels * width * height or -(-width // _BLOCK) * -(-height // _BLOCK) * _BLOCK_BYTES
    # The library takes the memory that the index declares before it looks at the data.
    if start + length > len(content) or (scheme != _BASIS_LZ and uncompressed != size):
        raise SceneError(f"its data is not that of {width}x{height} pixels")
    return Ktx2Picture(width, height, channels, scheme, start, length, max(levels, 1))


def decoded(content: bytes, picture: Ktx2Picture) -> NDArray[np.uint8]:
    """(height, width, 4). Raises SceneError, and the libraries' errors."""
    return _plain(content, picture) if picture.channels else _basis_universal(content)


def decoded_texture(content: bytes, picture: Ktx2Picture) -> NDArray[np.uint8] | BlockPicture:
    """As `decoded`, or as blocks: of Basis Universal with mipmap levels down to a block."""
    if picture.channels or max(picture.width, picture.height) >> (picture.levels - 1) > SIDE:
        return decoded(content, picture)
    _check_levels(content, picture)
    library = _library()
    levels = library.open(content).transcode_levels(library.Target.BC7)
    for image, size in zip(levels, _level_sizes(picture), strict=True):
        if image.data.shape[:2] != blocks_of(*size):
            raise SceneError(f"its mipmap levels are not those of {picture.width}x{picture.height} pixels")
    return BlockPicture(picture.width, picture.height, tuple(image.data for image in levels))


def _check_levels(content: bytes, picture: Ktx2Picture) -> None:
    """Raises SceneError unless the index of levels (3.9) fits the picture, as `read_header` does for the first."""
    for level, (width, height) in enumerate(_level_sizes(picture)):
        start, length, uncompressed = level_entry(content, level)
        rows, columns = blocks_of(width, height)
        fits = picture.scheme == _BASIS_LZ or uncompressed == rows * columns * _BLOCK_BYTES
        if start + length > len(content) or not fits:
            raise SceneError(f"its mipmap levels are not those of {picture.width}x{picture.height} pixels")


def level_entry(content: bytes, level: int) -> tuple[int, int, int]:
    """Start, length and length without supercompression of a level (3.9); beyond the file where it has no entry."""
    entry = content[_LEVELS_START + level * _LEVEL.size :][: _LEVEL.size]
    start, length, uncompressed = _LEVEL.unpack(entry.ljust(_LEVEL.size, b"\xff"))
    return start, length, uncompressed


def _level_sizes(picture: Ktx2Picture) -> list[tuple[int, int]]:
    """Width and height of each level."""
    return [(max(picture.width >> level, 1), max(picture.height >> level, 1)) for level in range(picture.levels)]


def _library() -> ModuleType:
    try:
        import opengl_basisu
    except ImportError:
        fault = "KTX 2 of Basis Universal needs the package opengl_basisu, which has no build for this platform"
        raise UnsupportedPictureError(fault) from None
    return opengl_basisu


def _basis_universal(content: bytes) -> NDArray[np.uint8]:
    library = _library()
    pixels: NDArray[Any] = library.open(content).transcode(library.Target.RGBA8).data
    return pixels


def _plain(content: bytes, picture: Ktx2Picture) -> NDArray[np.uint8]:
    _, _, channels, scheme, start, length, _ = picture
    size = channels * picture.width * picture.height
    data = content[start : start + length]
    if scheme == ZSTANDARD:
        data = decompressed(data, size)
    if scheme == _BASIS_LZ or len(data) != size:
        raise SceneError(f"its data is not that of {picture.width}x{picture.height} pixels")
    pixels = np.zeros((picture.height, picture.width, 4), np.uint8)
    pixels[..., 3] = 255  # what a texture lacks is 0, and alpha 1 (Vulkan 1.3, 16.6.1)
    pixels[..., :channels] = np.frombuffer(data, np.uint8).reshape(picture.height, picture.width, channels)
    return pixels


def decompressed(data: bytes, size: int) -> bytes:
    """At most `size` bytes of data that Zstandard has compressed."""
    import zstandard

    with zstandard.ZstdDecompressor().stream_reader(data) as reader:  # unlike decompress, it reads no more than asked
        return reader.read(size)
