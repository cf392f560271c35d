"""Headers of picture files: sizes, checked before memory is allocated for pixels."""

import re
import struct
from dataclasses import dataclass
from typing import BinaryIO

import PIL.Image

from pica.errors import SceneError
from pica.files import size_of

EXR = b"\x76\x2f\x31\x01"
_PNG, _JPEG, _HDR = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"#?"
_MOST_ATTRIBUTES = 1000
_LONGEST_HEADER = 1 << 20
"""Bytes of a .hdr header; they hold a few hundred."""
_MOST_SCANS = 100
"""Maximum number of scans of a progressive JPEG picture, each as slow as a whole one: encoders write about ten."""
_TRIES = 16
"""Maximum number of candidates for the start of the last line."""
_SCAN = b"\xff\xda"
_SIGNATURES = {
    "PNG": (0, _PNG),
    "JPEG": (0, _JPEG),
    "AVIF": (4, b"ftyp"),
    "DDS": (0, b"DDS "),
    "KTX 2": (0, b"\xabKTX 20"),
}
"""Where a signature begins in a file, and the signature."""


@dataclass(frozen=True)
class PictureSize:
    """A picture's size, and the bytes per pixel during its conversion to radiance, which has 12 in the end."""

    width: int
    height: int
    pixel_bytes: int = 20

    @property
    def pixels(self) -> int:
        """How many pixels it has."""
        return self.width * self.height


def radiance_size(file: BinaryIO) -> PictureSize:
    """The size of a .hdr, .exr, .png or .jpg picture, recognized by its content.

    Raises SceneError for any other, for a broken header, and for a .hdr picture that lacks pixels, for which its reader
    returns uninitialized memory. For broken .png and .jpg pictures raises Pillow's errors.
    """
    file.seek(0)
    start = file.read(8)
    file.seek(0)
    if start.startswith(_HDR):
        return _hdr_size(file.read())
    if start.startswith((_PNG, _JPEG)):
        check_scans(file.read())
        with PIL.Image.open(file, formats=("PNG", "JPEG")) as image:
            return PictureSize(*image.size)
    if not start.startswith(EXR):
        raise SceneError("not a .hdr, .exr, .ktx2, .png or .jpg picture")
    try:
        return _exr_size(file)
    except struct.error:
        raise SceneError("truncated in its header") from None


def file_format(start: bytes) -> str:
    """The format of a texture's file by its first twelve bytes; empty for others than are read."""
    if start[:4] == b"RIFF":
        return "WebP" if start[8:12] == b"WEBP" else ""
    return next((name for name, (at, sign) in _SIGNATURES.items() if start[at : at + len(sign)] == sign), "")


def check_scans(content: bytes) -> None:
    """Raises SceneError for a JPEG picture with so many scans that decoding would take minutes."""
    if content.startswith(_JPEG) and content.count(_SCAN) > _MOST_SCANS:
        raise SceneError(f"{content.count(_SCAN)} scans are too many for a JPEG picture")


def _exr_size(file: BinaryIO) -> PictureSize:
    """By the header of the first part (https://openexr.com/en/latest/OpenEXRFileLayout.html)."""
    file.seek(8)
    attributes: dict[bytes, bytes] = {}
    for _ in range(_MOST_ATTRIBUTES):
        name = _text(file)
        if not name:
            break
        _text(file)  # its type
        (length,) = struct.unpack("<I", file.read(4))
        if length > size_of(file) - file.tell():
            raise SceneError(f"truncated in its header, at {length} bytes of an attribute")
        attributes[name] = file.read(length)
    left, top, right, bottom = struct.unpack("<4i", attributes.get(b"dataWindow", b""))
    # each channel: its name, a NUL, 16 bytes
    channels = len(re.findall(rb"[^\0]+\0.{16}", attributes.get(b"channels", b""), re.DOTALL))
    width, height = right - left + 1, bottom - top + 1
    if min(width, height, channels) < 1:
        raise SceneError(f"{width}x{height} pixels of {channels} channels are no picture")
    if b"tiles" in attributes:  # a tile is read as a whole, however little of it the picture shows
        tile_width, tile_height = struct.unpack("<2I", attributes[b"tiles"][:8])
        width, height = max(width, tile_width), max(height, tile_height)
    return PictureSize(width, height, 12 + 4 * channels)


def _text(file: BinaryIO) -> bytes:
    """The text up to the next NUL, of at most 255 bytes."""
    start = file.tell()
    text, end, _ = file.read(256).partition(b"\0")
    if not end:
        raise SceneError("broken in its header")
    file.seek(start + len(text) + 1)
    return text


def _hdr_size(content: bytes) -> PictureSize:
    """Of a whole Radiance picture (Larson and Shakespeare 1998, "Rendering with Radiance"; its ray/doc/filefmts)."""
    end = content.find(b"\n\n", 0, _LONGEST_HEADER)
    size = re.compile(rb"-Y (\d{1,18}) \+X (\d{1,18})\n").match(content, end + 2) if end >= 0 else None
    if size is None:
        raise SceneError("no size after its header, such as -Y 512 +X 1024")
    height, width = int(size[1]), int(size[2])
    if min(width, height) < 1:
        raise SceneError(f"{width}x{height} pixels are no picture")
    start = size.end()
    if 8 <= width < 1 << 15 and content[start : start + 2] == b"\2\2" and content[start + 2 : start + 3] < b"\x80":
        complete = _has_all_lines(content, start, width, height)
    else:
        complete = len(content) - start >= 4 * width * height
    if not complete:
        raise SceneError(f"truncated, {width}x{height} pixels do not fit in the file")
    return PictureSize(width, height, 16)


def _has_all_lines(content: bytes, start: int, width: int, height: int) -> bool:
    """Whether lines of runs, each of which begins with 2, 2 and its width, are there to the end of the last one."""
    mark = b"\2\2" + width.to_bytes(2, "big")
    if content.count(mark, start) < height:
        return False
    last = at = content.rfind(mark)
    for _ in range(_TRIES):
        end = _end_of_line(content, at + len(mark), width)
        if end is not None and (at == last or end > last):
            return True
        at = content.rfind(mark, start, at + len(mark) - 1)  # the mark may have been part of a line's values
        if at < 0:
            break
    return False


def _end_of_line(content: bytes, at: int, width: int) -> int | None:
    """Where the runs of a line's four channels end; None where they reach past the content or the line."""
    for _ in range(4):
        left = width
        while left > 0:
            if at >= len(content) or content[at] == 0:
                return None
            count = content[at]  # over 128: a run of one value, of this length less 128; otherwise so many values
            left -= count - 128 if count > 128 else count
            at += 2 if count > 128 else count + 1
        if left < 0:
            return None
    return at if at <= len(content) else None
