"""Pictures of textures: put into the file as they are where glTF's loader reads them, else as PNG."""

import io
from collections.abc import Sequence
from hashlib import sha256
from pathlib import PurePosixPath
from typing import Any, NamedTuple

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.conversion.conversion import Conversion
from pica.text import first_line

_KEPT = ("PNG", "JPEG", "WEBP", "AVIF", "DDS")
_CONVERTED = ("BMP", "GIF", "TGA", "TIFF")
"""Formats of Pillow that glTF's loader does not read."""
_MOST_PIXELS = 16384 * 8192
_RELIEF = 0.01
"""Height of white in a picture of heights, as a share of the picture's sides."""
FAULTS = (OSError, ValueError, SyntaxError, SceneError, PIL.Image.DecompressionBombError)
"""What Pillow raises for broken pictures."""


class ChannelSource(NamedTuple):
    """One channel of a picture."""

    content: bytes
    """Of the picture's file."""
    name: str
    channel: int
    """0 to 3: red, green, blue, alpha."""
    scale: float = 1.0
    offset: float = 0.0


class Pictures:
    """The pictures of a file, each added once."""

    def __init__(self, conversion: Conversion) -> None:
        self._conversion = conversion
        self._images: dict[object, int | None] = {}

    def add(self, content: bytes, name: str) -> int | None:
        """The index of an image; None, with a warning, where it cannot be read."""
        key = sha256(content).digest()
        if key not in self._images:
            self._images[key] = self._added(content, name)
        return self._images[key]

    def pack(self, channels: Sequence[ChannelSource | float], name: str) -> int | None:
        """The index of an image of red, green, blue and perhaps alpha from channels of others or constants, 0 to 1.

        Smaller pictures are repeated to the largest one's size. None, with a warning, where one cannot be read.
        """
        key = tuple(
            each if isinstance(each, float) else (sha256(each.content).digest(), *each[2:]) for each in channels
        )
        if key not in self._images:
            self._images[key] = self._packed(channels, name)
        return self._images[key]

    def encoded(self, image: int, encoding: str) -> int:
        """An image of the same picture that is decoded as "srgb" or "linear" in every use."""
        entry = self._conversion.asset.entry("images", image)
        return self._conversion.asset.add_once("images", entry | {"extras": {"pica": {"encoding": encoding}}})

    def texture(self, image: int | None, sampler: dict[str, Any] | None = None, **more: Any) -> dict[str, Any] | None:
        """A texture info of an image, with more keys; None without one."""
        if image is None:
            return None
        asset = self._conversion.asset
        entry = {"source": image} | ({"sampler": asset.add_once("samplers", sampler)} if sampler else {})
        return {"index": asset.add_once("textures", entry)} | more

    def warn(self, name: str, error: Exception) -> None:
        """Warn of a picture that cannot be read."""
        kind = "no picture of a format that is read" if isinstance(error, PIL.UnidentifiedImageError) else ""
        self._conversion.warn(f"texture {name!r}: {kind or first_line(error)}; left out")

    def size(self, content: bytes) -> tuple[int, int]:
        """Width and height. Raises one of FAULTS."""
        with PIL.Image.open(io.BytesIO(content), formats=_KEPT + _CONVERTED) as image:
            return image.size

    def normals(self, content: bytes, name: str, strength: float) -> tuple[int | None, float]:
        """The index of an image of normals, and their scale, of a picture of normals or, if it is grey, of heights.

        White is `strength` hundredths of the picture's width above black; the picture repeats. None, with a warning,
        where it cannot be read.
        """
        try:
            pixels = self.pixels(content)
        except FAULTS as error:
            self.warn(name, error)
            return None, 1.0
        if (pixels[..., :1] != pixels[..., 1:3]).any():
            return self.add(content, name), strength
        key = sha256(content).digest(), strength
        if key not in self._images:
            self._images[key] = self._image(png(_normals_of(pixels[..., 0], strength * _RELIEF)), name)
        return self._images[key], 1.0

    def pixels(self, content: bytes) -> NDArray[np.uint8]:
        """(height, width, 4) of a file's content. Raises one of FAULTS."""
        with PIL.Image.open(io.BytesIO(content), formats=_KEPT + _CONVERTED) as image:
            pixels = image.width * image.height
            if pixels > _MOST_PIXELS:
                raise SceneError(f"{image.width}x{image.height} pixels are too many")
            self._conversion.budget.take_picture(pixels, 4 * pixels)
            if image.mode.startswith("I"):  # 16-bit grey, which Pillow would clip at 255
                grey = np.clip(np.asarray(image, np.float32) / 257, 0, 255).round().astype(np.uint8)
                return np.stack([grey, grey, grey, np.full_like(grey, 255)], axis=-1)
            return np.asarray(image.convert("RGBA"))

    def _added(self, content: bytes, name: str) -> int | None:
        try:
            with PIL.Image.open(io.BytesIO(content), formats=_KEPT + _CONVERTED) as image:
                if image.format in _KEPT:
                    return self._image(content, name)
            return self._image(png(self.pixels(content)), name)
        except FAULTS as error:
            self.warn(name, error)
            return None

    def _packed(self, channels: Sequence[ChannelSource | float], name: str) -> int | None:
        planes: list[NDArray[Any]] = []
        for each in channels:
            if isinstance(each, float):
                planes.append(np.full((1, 1), each, np.float32))
                continue
            try:
                plane = self.pixels(each.content)[..., each.channel].astype(np.float32) / 255
            except FAULTS as error:
                self.warn(each.name, error)
                return None
            planes.append(np.clip(plane * each.scale + each.offset, 0, 1))
        height, width = (max(plane.shape[axis] for plane in planes) for axis in (0, 1))
        packed = np.empty((height, width, len(planes)), np.uint8)
        for channel, plane in enumerate(planes):
            rows = np.arange(height) * plane.shape[0] // height
            columns = np.arange(width) * plane.shape[1] // width
            packed[..., channel] = np.round(plane[rows[:, None], columns] * 255)
        return self._image(png(packed), name)

    def _image(self, content: bytes, name: str) -> int:
        entry = {
            "name": PurePosixPath(name.replace("\\", "/")).stem,
            "bufferView": self._conversion.asset.view(content),
        }
        return self._conversion.asset.add("images", entry)


def _normals_of(heights: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    """(height, width, 3) normals of heights, whose white is `scale` times the picture's sides above black."""
    values = heights.astype(np.float32) / 255
    # Central differences; v points up, and rows go down.
    slopes = [
        scale * sign * (np.roll(values, -1, axis) - np.roll(values, 1, axis)) / 2 * values.shape[axis]
        for axis, sign in ((1, -1), (0, 1))
    ]
    normals = np.stack([*slopes, np.ones_like(values)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.round((normals + 1) * 127.5).astype(np.uint8)


def png(pixels: NDArray[np.uint8]) -> bytes:
    """The content of a file."""
    stream = io.BytesIO()
    PIL.Image.fromarray(pixels).save(stream, "PNG", compress_level=1)
    return stream.getvalue()
