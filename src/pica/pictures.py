"""Reading and writing picture files. No graphics device is opened."""

import io
import re
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import PIL.Image
import slangpy
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.saving import write_whole

MAX_PIXELS = 16384 * 8192
"""Pictures larger than this are refused: a small broken file can claim any size."""

_TEXTURE_FORMATS = ("PNG", "JPEG", "WEBP")


def read_image(data: bytes | Path, name: str) -> NDArray[np.uint8]:
    """Decode a PNG, JPEG or WebP picture to (height, width, 4) uint8, row 0 on top.

    Colour profiles are ignored, as glTF asks (glTF 2.0, 3.8). `name` is what errors call the picture.
    Raises SceneError when the picture is missing, broken or too large.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PIL.Image.DecompressionBombWarning)
            source = data if isinstance(data, Path) else io.BytesIO(data)
            with PIL.Image.open(source, formats=_TEXTURE_FORMATS) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise SceneError(f"{name}: {image.width}x{image.height} pixels are too many (limit {MAX_PIXELS})")
                return _eight_bits(image)
    except PIL.UnidentifiedImageError:
        raise SceneError(f"{name}: not a PNG, JPEG or WebP picture") from None
    except PIL.Image.DecompressionBombError as error:
        raise SceneError(f"{name}: {error}") from None
    except OSError as error:
        raise SceneError(f"{name}: cannot be read ({error.strerror or _first_line(error)})") from None
    except (ValueError, SyntaxError, IndexError, TypeError, EOFError, MemoryError) as error:
        raise SceneError(f"{name}: broken picture ({_first_line(error)})") from None


def read_radiance(path: str | Path) -> NDArray[np.float32]:
    """Read .hdr, .exr, .png or .jpg as linear radiance, (height, width, 3); eight-bit pictures are taken as sRGB.

    Raises SceneError when the file is missing, broken or of another kind.
    """
    bitmap = _open_bitmap(path)
    formats = slangpy.Bitmap.PixelFormat
    if bitmap.pixel_format == formats.multi_channel:
        channels = _channels(bitmap)
        if not {"R", "G", "B"} <= channels.keys():
            raise SceneError(f"{path}: holds no channels named R, G and B, but {', '.join(channels)}")
        return np.stack([channels[name] for name in "RGB"], axis=-1)
    try:
        linear = bitmap.convert(formats.rgb, slangpy.Bitmap.ComponentType.float32, False)
    except RuntimeError as error:
        raise SceneError(f"{path}: cannot be converted to radiance ({_first_line(error)})") from None
    return np.array(linear, np.float32)


def read_exr_channels(path: str | Path) -> dict[str, NDArray[np.float32]]:
    """The channels of an OpenEXR file by name, (height, width) each. Raises SceneError."""
    return _channels(_open_bitmap(path))


def write_png(path: str | Path, pixels: NDArray[np.uint8]) -> None:
    """Write (height, width, 3) uint8 as PNG. Raises PicaError when the file cannot be written."""
    image = PIL.Image.fromarray(pixels)
    write_whole(Path(path), lambda temporary: image.save(temporary, "PNG"))


def write_exr(path: str | Path, channels: Mapping[str, NDArray[np.floating]]) -> None:
    """Write named channels, (height, width) each, as 32-bit OpenEXR. Raises PicaError.

    Layers are written as `layer.X`; R, G, B without a layer are the picture itself.
    """
    pixels = np.stack([np.asarray(channel, np.float32) for channel in channels.values()], axis=-1)
    bitmap = slangpy.Bitmap(pixels, slangpy.Bitmap.PixelFormat.multi_channel, list(channels))
    write_whole(Path(path), lambda temporary: bitmap.write(temporary, slangpy.Bitmap.FileFormat.exr))


def _eight_bits(image: PIL.Image.Image) -> NDArray[np.uint8]:
    if image.mode.startswith("I"):  # 16-bit grey, which Pillow would clip at 255 instead of scaling
        grey = np.clip(np.round(np.asarray(image, np.float32) / 257), 0, 255).astype(np.uint8)
        return np.dstack([grey, grey, grey, np.full_like(grey, 255)])
    return np.asarray(image.convert("RGBA"), np.uint8)


def _open_bitmap(path: str | Path) -> slangpy.Bitmap:
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"{path}: no such file")
    try:
        _check_radiance_size(path)
        return slangpy.Bitmap(path)
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror})") from None
    except (RuntimeError, MemoryError) as error:
        raise SceneError(f"{path}: not a readable picture ({_first_line(error)})") from None


def _check_radiance_size(path: Path) -> None:
    """The reader fills what an uncompressed .hdr lacks with whatever is in memory, so its size is checked here."""
    with path.open("rb") as file:
        start = file.read(8192)
    resolution = re.search(rb"\n\n[-+][XY] (\d+) [-+][XY] (\d+)\n", start)
    if not start.startswith(b"#?") or resolution is None:
        return
    pixels = int(resolution[1]) * int(resolution[2])
    if pixels > MAX_PIXELS:
        raise SceneError(f"{path}: {pixels} pixels are too many (limit {MAX_PIXELS})")
    compressed = start[resolution.end() :][:2] == b"\x02\x02"
    if not compressed and path.stat().st_size - resolution.end() < 4 * pixels:
        raise SceneError(f"{path}: truncated, {pixels} pixels do not fit in the file")


def _channels(bitmap: slangpy.Bitmap) -> dict[str, NDArray[np.float32]]:
    pixels = np.array(bitmap, np.float32).reshape(bitmap.height, bitmap.width, -1)
    return {name: pixels[..., i] for i, name in enumerate(bitmap.channel_names)}


def _first_line(error: BaseException) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
