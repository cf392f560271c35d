"""Reading and writing picture files. No graphics device is opened."""

import io
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import PIL.Image
import slangpy
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.files import open_file, read_file, size_of
from pica.picture_headers import check_scans, radiance_size
from pica.saving import write_whole
from pica.text import first_line, printable

MAX_PIXELS, MAX_SIDE = 16384 * 8192, 16384
"""Pictures larger than this are refused: a small broken file can claim any size, and not every device takes more."""

Admit = Callable[[int, int], object]
"""Called with the pixels of a picture and the bytes that it takes, before it takes them; raises SceneError, which need
not name the picture, if that is too much."""

_TEXTURE_FORMATS = ("PNG", "JPEG", "WEBP")
_LONGEST = 200
"""Characters of a message that may hold text of a file."""
_STRIP = 1 << 16
"""Pixels that are converted at once: few enough to stay in a processor's cache."""


def _admit_all(*_: int) -> None:
    pass


def read_image(data: bytes | memoryview | Path, name: str, admit: Admit = _admit_all) -> NDArray[np.uint8]:
    """Decode a PNG, JPEG or WebP picture to (height, width, 4) uint8, row 0 on top.

    Colour profiles are ignored, as glTF asks (glTF 2.0, 3.8). `name` is what errors call the picture.
    Raises SceneError when the picture is missing, broken or too large.
    """
    content = read_file(data, name) if isinstance(data, Path) else bytes(data)
    with _faults_named(name):
        check_scans(content)
        with PIL.Image.open(io.BytesIO(content), formats=_TEXTURE_FORMATS) as image:
            _check_size(*image.size)
            admit(image.width * image.height, 4 * image.width * image.height)
            return _eight_bits(image)


def read_radiance(
    path: str | Path, admit: Admit = _admit_all, admit_file: Callable[[int], object] = _admit_all
) -> NDArray[np.float32]:
    """Read .hdr, .exr, .png or .jpg as linear radiance, (height, width, 3); eight-bit pictures are taken as sRGB.

    `admit_file` is called before `admit`, with the bytes of the file, and may raise likewise.
    Raises SceneError when the file is missing, broken, too large or of another kind.
    """
    bitmap = _open_bitmap(path, admit, admit_file)
    rgb, float32 = slangpy.Bitmap.PixelFormat.rgb, slangpy.Bitmap.ComponentType.float32
    with _faults_named(printable(path)):
        if bitmap.pixel_format == slangpy.Bitmap.PixelFormat.multi_channel:
            names = bitmap.channel_names
            if not {"R", "G", "B"} <= set(names):
                raise SceneError(f"holds no channels named R, G and B, but {', '.join(names)}"[:_LONGEST])
            pixels = np.asarray(bitmap).reshape(bitmap.height, bitmap.width, -1)
            return np.stack([pixels[..., names.index(name)].astype(np.float32, copy=False) for name in "RGB"], axis=-1)
        if (bitmap.pixel_format, bitmap.component_type) != (rgb, float32):
            bitmap = bitmap.convert(rgb, float32, False)
        return np.asarray(bitmap)


def whole_size(path: Path) -> tuple[int, int]:
    """(width, height) of a .png or .exr. Raises SceneError where any of it is missing or broken."""
    if path.suffix.lower() == ".exr":
        height, width, _ = read_radiance(path).shape
        return width, height
    name = printable(path)
    with open_file(path, name) as file, _faults_named(name), PIL.Image.open(file, formats=("PNG",)) as image:
        image.verify()  # all chunks by their checksums, which takes less time than to decode them
        return image.size


def read_exr_channels(path: str | Path) -> dict[str, NDArray[np.float32]]:
    """The channels of an OpenEXR file by name, (height, width) each. Raises SceneError."""
    return _channels(_open_bitmap(path, _admit_all, _admit_all))


def write_png(path: str | Path, pixels: NDArray[np.uint8]) -> None:
    """Write (height, width, 3) uint8 as PNG, or (height, width, 4) with straight alpha.

    Raises PicaError when the file cannot be written.
    """
    image = PIL.Image.fromarray(pixels)
    write_whole(Path(path), lambda temporary: image.save(temporary, "PNG"))


def write_exr(path: str | Path, channels: Mapping[str, NDArray[np.floating]]) -> None:
    """Write named channels, (height, width) each, as 32-bit OpenEXR. Raises PicaError.

    Layers are written as `layer.X`; R, G, B without a layer are the picture itself.
    """
    pixels = np.stack([np.asarray(channel, np.float32) for channel in channels.values()], axis=-1)
    bitmap = slangpy.Bitmap(pixels, slangpy.Bitmap.PixelFormat.multi_channel, list(channels))
    write_whole(Path(path), lambda temporary: bitmap.write(temporary, slangpy.Bitmap.FileFormat.exr))


def _check_size(width: int, height: int) -> None:
    if width * height > MAX_PIXELS or max(width, height) > MAX_SIDE:
        raise SceneError(
            f"{width}x{height} pixels are too many (limit {MAX_PIXELS}, and {MAX_SIDE} in a row or column)"
        )


def _eight_bits(image: PIL.Image.Image) -> NDArray[np.uint8]:
    """(height, width, 4), in strips: copies of the whole picture take several times its memory."""
    pixels = np.empty((image.height, image.width, 4), np.uint8)
    rows = max(_STRIP // image.width, 1)
    for top in range(0, image.height, rows):
        whole = rows >= image.height  # a crop would copy it
        strip = image if whole else image.crop((0, top, image.width, min(top + rows, image.height)))
        if image.mode.startswith("I"):  # 16-bit grey, which Pillow would clip at 255 instead of scaling
            grey = np.clip(np.round(np.asarray(strip, np.float32) / 257), 0, 255)
            pixels[top : top + rows, :, :3], pixels[top : top + rows, :, 3] = grey[..., None], 255
        else:
            pixels[top : top + rows] = np.asarray(strip.convert("RGBA"))
    return pixels


def _open_bitmap(path: str | Path, admit: Admit, admit_file: Callable[[int], object]) -> slangpy.Bitmap:
    path, name = Path(path), printable(path)
    with open_file(path, name) as file, _faults_named(name):
        admit_file(size_of(file))
        size = radiance_size(file)
        _check_size(size.width, size.height)
        admit(size.pixels, size.pixels * size.pixel_bytes)
        return slangpy.Bitmap(path)


@contextmanager
def _faults_named(name: str) -> Iterator[None]:
    """Makes one line, with the name, of whatever the libraries that read pictures raise for broken ones."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PIL.Image.DecompressionBombWarning)
            yield
    except SceneError as error:
        raise SceneError(f"{name}: {error}") from None
    except PIL.UnidentifiedImageError:
        raise SceneError(f"{name}: not a PNG, JPEG or WebP picture") from None
    except PIL.Image.DecompressionBombError as error:
        raise SceneError(f"{name}: too many pixels ({error})") from None
    except MemoryError:
        raise SceneError(f"{name}: takes more memory than there is") from None
    except Exception as error:  # they say nowhere which ones: struct.error, SyntaxError and EOFError are among them
        raise SceneError(f"{name}: not a readable picture ({first_line(error)[:_LONGEST]})") from None


def _channels(bitmap: slangpy.Bitmap) -> dict[str, NDArray[np.float32]]:
    pixels = np.array(bitmap, np.float32).reshape(bitmap.height, bitmap.width, -1)
    return {name: pixels[..., i] for i, name in enumerate(bitmap.channel_names)}
