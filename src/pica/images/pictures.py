"""Reading and writing picture files. No graphics device is opened."""

import io
import warnings
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from pica.errors import PicaError, SceneError
from pica.files import open_file, read_file, size_of
from pica.images import block_files, cube_maps, ktx2
from pica.images.blocks import BlockPicture
from pica.images.headers import EXR, check_scans, radiance_size
from pica.images.saving import write_whole
from pica.text import first_line, printable

if TYPE_CHECKING:  # imported by the functions that need it: with PyTorch beside it, it takes a second
    import slangpy

MAX_PIXELS, MAX_SIDE = 16384 * 8192, 16384
"""Larger pictures are rejected: a small broken file can claim any size, and not every device supports more."""

Admit = Callable[[int, int], object]
"""Called with a picture's number of pixels and of bytes, before these are allocated; raises SceneError, with or
without the picture's name, if that is too much."""

_Decoded = TypeVar("_Decoded")
_TEXTURE_FORMATS = ("PNG", "JPEG", "WEBP", "AVIF", "DDS")
_HIGHEST = {".png": (1 << 16) - 1, ".exr": (1 << 32) - 1}
"""The largest label that a file holds."""
_LONGEST = 200
"""Characters of a message that may hold text of a file."""
_filtering = Lock()
_STRIP = 1 << 16
"""Pixels that are converted at once: few enough to stay in a processor's cache."""


def _admit_all(*_: int) -> None:
    pass


def read_image(data: bytes | memoryview | Path, name: str, admit: Admit = _admit_all) -> NDArray[np.uint8]:
    """Decode a PNG, JPEG, WebP, AVIF, DDS or KTX 2 picture to (height, width, 4) uint8, row 0 on top.

    Colour profiles are ignored, as glTF requires (glTF 2.0, 3.8). `name` is the picture's name in errors.
    Raises SceneError if the picture is missing, broken or too large, UnsupportedPictureError if its kind is not read.
    """
    content = read_file(data, name) if isinstance(data, Path) else bytes(data)
    return _opened(content, name, admit, block_files.decoded, ktx2.decoded)()


def open_texture(
    data: bytes | memoryview, name: str, admit: Admit = _admit_all
) -> Callable[[], NDArray[np.uint8] | BlockPicture]:
    """What decodes a picture as `read_image`, in any thread, but leaves KTX 2 and DDS compressed, as blocks: those of
    Basis Universal and BC7 with mipmap levels, and of BC6H. Its size is checked and admitted at once. Both raise
    SceneError as `read_image`."""
    return _opened(bytes(data), name, admit, block_files.decoded_texture, ktx2.decoded_texture)


def _opened(
    content: bytes,
    name: str,
    admit: Admit,
    decode_blocks: Callable[[bytes, block_files.StoredBlocks], _Decoded],
    decode_ktx2: Callable[[bytes, ktx2.Ktx2Picture], _Decoded],
) -> Callable[[], NDArray[np.uint8] | _Decoded]:
    with _faults_named(name):
        stored = block_files.read_header(content)
        if stored is not None:
            _check_size(stored.width, stored.height)
            pixels = stored.width * stored.height
            admit(pixels, block_files.BYTES_PER_PIXEL * pixels)
            return partial(_decoded, name, partial(decode_blocks, content, stored))
        if content.startswith(ktx2.KTX2):
            picture = ktx2.read_header(content)
            _check_size(picture.width, picture.height)
            pixels = picture.width * picture.height
            admit(pixels, ktx2.BYTES_PER_PIXEL * pixels)
            return partial(_decoded, name, partial(decode_ktx2, content, picture))
        check_scans(content)
        with _any_size():
            image = PIL.Image.open(io.BytesIO(content), formats=_TEXTURE_FORMATS)
        _check_size(*image.size)
        admit(image.width * image.height, 4 * image.width * image.height)
        return partial(_decoded, name, partial(_eight_bits, image))


def _decoded(name: str, decode: Callable[[], _Decoded]) -> _Decoded:
    with _faults_named(name):
        return decode()


def read_radiance(
    path: str | Path, admit: Admit = _admit_all, admit_file: Callable[[int], object] = _admit_all
) -> NDArray[np.float32]:
    """Read .hdr, .exr, .png or .jpg as linear radiance, (height, width, 3); eight-bit pictures are decoded as sRGB.
    A cube map in .ktx2 becomes a latitude-longitude picture.

    `admit_file` is called before `admit`, with the bytes of the file, and may raise likewise.
    Raises SceneError if the file is missing, broken, too large or of another kind.
    """
    cube_map = _cube_map(Path(path), admit, admit_file)
    if cube_map is not None:
        return cube_map
    import slangpy

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


def _cube_map(path: Path, admit: Admit, admit_file: Callable[[int], object]) -> NDArray[np.float32] | None:
    """A cube map of KTX 2 as `read_radiance` gives it; None for other files."""
    name = printable(path)
    with open_file(path, name) as file, _faults_named(name):
        if file.read(len(ktx2.KTX2)) != ktx2.KTX2:
            return None
        admit_file(size_of(file))
        file.seek(0)
        content = file.read()
        cube = cube_maps.read_header(content)
        _check_size(cube.size.width, cube.size.height)
        admit(cube.size.pixels, cube.size.pixels * cube.size.pixel_bytes)
        return cube_maps.decoded(content, cube)


def whole_size(path: Path) -> tuple[int, int]:
    """(width, height) of a .png or .exr. Raises SceneError where any of it is missing or broken."""
    if path.suffix.lower() == ".exr":
        height, width, _ = read_radiance(path).shape
        return width, height
    name = printable(path)
    with open_file(path, name) as file, _faults_named(name):
        with _any_size():
            image = PIL.Image.open(file, formats=("PNG",))
        image.verify()  # all chunks by their checksums, which is faster than to decode them
        return image.size


def read_exr(
    path: str | Path, admit: Admit = _admit_all, admit_file: Callable[[int], object] = _admit_all
) -> dict[str, NDArray[Any]]:
    """The channels of an OpenEXR file by name, (height, width) each, with the file's types.

    `admit` and `admit_file` as read_radiance's. Raises SceneError likewise.
    """
    name = printable(path)
    with open_file(Path(path), name) as file:
        if file.read(len(EXR)) != EXR:
            raise SceneError(f"{name}: not an OpenEXR picture")
    bitmap = _open_bitmap(path, admit, admit_file)
    with _faults_named(name):
        pixels = np.asarray(bitmap).reshape(bitmap.height, bitmap.width, -1)
        return {channel: pixels[..., index] for index, channel in enumerate(bitmap.channel_names)}


def write_png(path: str | Path, pixels: NDArray[np.uint8] | NDArray[np.uint16], fast: bool = False) -> None:
    """Write (height, width, 3) uint8 as PNG, (height, width, 4) with straight alpha, or grey (height, width) of 8 or 16
    bits. `fast`: in a quarter of the time, by run lengths alone; rendered pictures become hardly larger. Raises
    PicaError when the file cannot be written.
    """
    options = {"compress_level": 1, "compress_type": zlib.Z_RLE} if fast else {}
    write_whole(Path(path), lambda temporary: PIL.Image.fromarray(pixels).save(temporary, "PNG", **options))


def encoded_png(pixels: NDArray[np.uint8]) -> bytes:
    """The bytes of (height, width, 3 or 4) uint8 as PNG."""
    stream = io.BytesIO()
    PIL.Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


def write_exr(path: str | Path, channels: Mapping[str, NDArray[Any]]) -> None:
    """Write named channels, (height, width) each, as 32-bit OpenEXR: floats, or whole numbers where all are unsigned.
    Raises PicaError.

    Layers are written as `layer.X`; R, G, B without a layer are the picture itself.
    """
    import slangpy

    whole = all(np.asarray(channel).dtype.kind in "bu" for channel in channels.values())
    kind = np.uint32 if whole else np.float32
    pixels = np.stack([np.asarray(channel, kind) for channel in channels.values()], axis=-1)
    bitmap = slangpy.Bitmap(pixels, slangpy.Bitmap.PixelFormat.multi_channel, list(channels))
    write_whole(Path(path), lambda temporary: bitmap.write(temporary, slangpy.Bitmap.FileFormat.exr))


def write_labels(path: str | Path, labels: NDArray[Any]) -> None:
    """Write a mask or labels, (height, width) truth values or whole numbers, without any loss.

    .png: grey, 8 bits for masks (0 and 255) and for uint8, else 16 bits. .exr: a channel Y of 32-bit whole numbers.
    .npy: the array as it is, of any shape and type. Raises PicaError for values that the file cannot hold.
    """
    path, array = Path(path), np.asarray(labels)
    suffix = path.suffix.lower()
    if suffix == ".npy":
        write_whole(path, partial(_write_npy, array))
        return
    if suffix not in (".png", ".exr"):
        raise PicaError(f"cannot write {path}: the name of labels must end in .png, .exr or .npy")
    if array.ndim != 2 or array.dtype.kind not in "biu":
        what = f"{array.dtype} of shape {array.shape}"
        raise PicaError(f"cannot write {path}: {what} are no labels (height, width); .npy holds any array")
    low, high = int(array.min(initial=0)), int(array.max(initial=0))
    if low < 0 or high > _HIGHEST[suffix]:
        others = ".exr or .npy" if low >= 0 and high <= _HIGHEST[".exr"] else ".npy"
        fault = f"holds {low if low < 0 else high}, and {suffix} 0 to {_HIGHEST[suffix]}"
        raise PicaError(f"cannot write {path}: {fault}; end the name in {others}")
    if suffix == ".exr":
        write_exr(path, {"Y": array.astype(np.uint32)})
    elif array.dtype.kind == "b":
        write_png(path, array.astype(np.uint8) * 255)
    else:
        write_png(path, array if array.dtype == np.uint8 else array.astype(np.uint16))


def _write_npy(array: NDArray[Any], path: Path) -> None:
    with path.open("wb") as file:  # np.save adds ".npy" to other names, such as those in capitals
        np.save(file, array, allow_pickle=False)


def _check_size(width: int, height: int) -> None:
    if width * height > MAX_PIXELS or max(width, height) > MAX_SIDE:
        raise SceneError(
            f"{width}x{height} pixels are too many (limit {MAX_PIXELS}, and {MAX_SIDE} in a row or column)"
        )


def _eight_bits(image: PIL.Image.Image) -> NDArray[np.uint8]:
    """(height, width, 4), in strips: copies of the whole picture would need several times its memory."""
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


def _open_bitmap(path: str | Path, admit: Admit, admit_file: Callable[[int], object]) -> "slangpy.Bitmap":
    import slangpy

    path, name = Path(path), printable(path)
    with open_file(path, name) as file, _faults_named(name):
        admit_file(size_of(file))
        with _any_size():
            size = radiance_size(file)
        _check_size(size.width, size.height)
        admit(size.pixels, size.pixels * size.pixel_bytes)
        return slangpy.Bitmap(path)


@contextmanager
def _any_size() -> Iterator[None]:
    """Pillow does not warn of large pictures, whose size is checked here; in one thread at a time, as filters of
    warnings are those of the process."""
    with _filtering, warnings.catch_warnings():
        warnings.simplefilter("ignore", PIL.Image.DecompressionBombWarning)
        yield


@contextmanager
def _faults_named(name: str) -> Iterator[None]:
    """Converts all errors of the picture libraries into one line with the name."""
    try:
        yield
    except SceneError as error:
        raise type(error)(f"{name}: {error}") from None
    except NotImplementedError as error:
        raise ktx2.UnsupportedPictureError(f"{name}: cannot be read ({first_line(error)[:_LONGEST]})") from None
    except PIL.UnidentifiedImageError:
        raise SceneError(f"{name}: not a PNG, JPEG, WebP, AVIF, DDS or KTX 2 picture") from None
    except PIL.Image.DecompressionBombError as error:
        raise SceneError(f"{name}: too many pixels ({error})") from None
    except MemoryError:
        raise SceneError(f"{name}: takes more memory than there is") from None
    except Exception as error:  # undocumented: struct.error, SyntaxError and EOFError are among them
        raise SceneError(f"{name}: not a readable picture ({first_line(error)[:_LONGEST]})") from None
