"""Cube maps of radiance in KTX 2 files (https://registry.khronos.org/KTX/specs/2.0/ktxspec.v2.html)."""

import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.images.headers import PictureSize
from pica.images.ktx2 import KTX2

_HEADER = struct.Struct("<12s9I4I2Q3Q")
"""With the first entry of the level index (3.1 and 3.9)."""
_PLAIN, _ZSTANDARD = 0, 2
_FACES = 6
_PIXEL_BYTES = 36
"""Memory per texel of the result during conversion, of which it has 12 in the end."""
_ROWS = 64
"""Rows of the result that are converted at once."""

Floats = NDArray[np.float32]


class CubeMap(NamedTuple):
    """What the header says."""

    side: int
    """Texels along each side of a face."""
    format: int
    """A VkFormat."""
    scheme: int
    """Of supercompression."""
    start: int
    length: int
    """Of the largest level in the file."""

    @property
    def size(self) -> PictureSize:
        """Of the latitude-longitude picture: at its horizon and poles as fine as the faces in their middle."""
        return PictureSize(4 * self.side, 2 * self.side, _PIXEL_BYTES)

    @property
    def bytes(self) -> int:
        """Of all faces without supercompression."""
        return _FACES * self.side * self.side * _FORMATS[self.format].size


def read_header(content: bytes) -> CubeMap:
    """Raises SceneError for what is not a cube map of radiance."""
    if len(content) < _HEADER.size or not content.startswith(KTX2):
        raise SceneError("truncated in its header")
    fields = _HEADER.unpack_from(content)
    _, vulkan_format, _, width, height, depth, layers, faces, _, scheme = fields[:10]
    start, length, uncompressed = fields[-3:]
    if faces != _FACES or depth or layers > 1 or width != height or width < 1:
        raise SceneError("KTX 2 that is not one cube map cannot be read as an environment")
    if vulkan_format not in _FORMATS or scheme not in (_PLAIN, _ZSTANDARD):
        raise SceneError(
            f"KTX 2 of format {vulkan_format} and scheme {scheme} cannot be read as an environment, only 16-bit and "
            "32-bit floats, RGB9E5 and R11G11B10, plain or with Zstandard"
        )
    cube = CubeMap(width, vulkan_format, scheme, start, length)
    if start + length > len(content) or uncompressed not in (cube.bytes, 0 if scheme == _PLAIN else cube.bytes):
        raise SceneError(f"its data is not that of six faces of {width}x{width} texels")
    return cube


def decoded(content: bytes, cube: CubeMap) -> Floats:
    """(2 side, 4 side, 3): the environment as a latitude-longitude picture (pica.Environment). Raises SceneError."""
    data = content[cube.start : cube.start + cube.length]
    if cube.scheme == _ZSTANDARD:
        import zstandard

        with zstandard.ZstdDecompressor().stream_reader(data) as reader:  # it reads no more than asked
            data = reader.read(cube.bytes)
    if len(data) != cube.bytes:
        raise SceneError(f"its data is not that of six faces of {cube.side}x{cube.side} texels")
    faces = _FORMATS[cube.format].decode(data).reshape(_FACES, cube.side, cube.side, 3)
    width, height = cube.size.width, cube.size.height
    picture = np.empty((height, width, 3), np.float32)
    for top in range(0, height, _ROWS):
        rows = np.arange(top, min(top + _ROWS, height))
        picture[rows] = _looked_up(faces, _directions(rows, width, height))
    return picture


def _directions(rows: NDArray[np.intp], width: int, height: int) -> Floats:
    """(rows, width, 3) of the texels of a latitude-longitude picture, in the world."""
    polar = ((rows + 0.5) / height * np.pi)[:, None]
    azimuth = ((np.arange(width) + 0.5) / width - 0.5)[None] * 2 * np.pi
    x, z = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return np.stack([x, np.broadcast_to(np.cos(polar), x.shape), z], -1).astype(np.float32)


def _looked_up(faces: Floats, directions: Floats) -> Floats:
    """Radiance from directions in the world, interpolated within faces."""
    # Cube maps are left-handed, with +Y up and +Z ahead; the world is right-handed.
    x, y, z = -directions[..., 0], directions[..., 1], directions[..., 2]
    # Vulkan 1.3, 16.5.4, "Cube Map Face Selection and Transformations"
    absolute = np.abs(np.stack([x, y, z]))
    axis = np.argmax(absolute, axis=0)
    negative = np.take_along_axis(np.stack([x, y, z]), axis[None], 0)[0] < 0
    face = 2 * axis + negative
    across = np.choose(face, [-z, z, x, x, x, -x])
    down = np.choose(face, [-y, -y, z, -z, -y, -y])
    major = absolute.max(axis=0)
    side = faces.shape[1]
    column = np.clip((across / major + 1) / 2 * side - 0.5, 0, side - 1)
    row = np.clip((down / major + 1) / 2 * side - 0.5, 0, side - 1)
    left, top = column.astype(np.intp), row.astype(np.intp)
    right, bottom = np.minimum(left + 1, side - 1), np.minimum(top + 1, side - 1)
    u, v = (column - left)[..., None], (row - top)[..., None]
    upper = faces[face, top, left] * (1 - u) + faces[face, top, right] * u
    lower = faces[face, bottom, left] * (1 - u) + faces[face, bottom, right] * u
    mixed: Floats = upper * (1 - v) + lower * v
    return mixed


def _floats(kind: str, channels: int) -> Callable[[bytes], Floats]:
    def decode(data: bytes) -> Floats:
        return np.frombuffer(data, kind).reshape(-1, channels)[:, :3].astype(np.float32)

    return decode


def _shared_exponent(data: bytes) -> Floats:
    """RGB9E5 (Vulkan 1.3, 3.11): nine bits for each colour from the lowest on, five for the exponent of all."""
    words = np.frombuffer(data, "<u4")
    mantissas = np.stack([words >> shift & 0x1FF for shift in (0, 9, 18)], -1)
    return np.ldexp(mantissas.astype(np.float32), ((words >> 27).astype(np.int32) - 24)[:, None])


def _small_floats(data: bytes) -> Floats:
    """R11G11B10: floats without sign, with the exponents of 16-bit ones and fewer bits after them."""
    words = np.frombuffer(data, "<u4")
    halves = np.stack([(words & 0x7FF) << 4, (words >> 11 & 0x7FF) << 4, words >> 22 << 5], -1)
    return halves.astype(np.uint16).view(np.float16).astype(np.float32)


class _Format(NamedTuple):
    size: int
    """Bytes per texel."""
    decode: Callable[[bytes], Floats]
    """(texels, 3)."""


_FORMATS = {
    90: _Format(6, _floats("<f2", 3)),
    97: _Format(8, _floats("<f2", 4)),
    106: _Format(12, _floats("<f4", 3)),
    109: _Format(16, _floats("<f4", 4)),
    122: _Format(4, _small_floats),
    123: _Format(4, _shared_exponent),
}
"""By VkFormat."""
