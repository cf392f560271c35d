"""KTX 2 cube maps of radiance for the tests."""

import struct

import zstandard

HALF, HALF_RGBA, FLOAT, FLOAT_RGBA, SMALL_FLOATS, SHARED_EXPONENT, BC6H = 90, 97, 106, 109, 122, 123, 143
"""VkFormats."""


def cube_map(data: bytes, side: int, kind: int, zstd: bool = False, **changes: int) -> bytes:
    """Six faces of texels; `changes`: of the header."""
    packed = zstandard.ZstdCompressor().compress(data) if zstd else data
    fields = {"format": kind, "type": 2, "width": side, "height": side, "depth": 0, "layers": 0, "faces": 6}
    fields |= {"levels": 1, "scheme": 2 if zstd else 0}
    sizes = {"start": 104, "length": len(packed), "uncompressed": len(data)}
    values = fields | sizes | changes
    header = struct.pack("<9I", *[values[name] for name in fields]) + struct.pack("<4I2Q", 0, 0, 0, 0, 0, 0)
    return b"\xabKTX 20\xbb\r\n\x1a\n" + header + struct.pack("<3Q", *[values[name] for name in sizes]) + packed
