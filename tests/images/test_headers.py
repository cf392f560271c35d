"""Pictures that claim much, hold little, or take long."""

import io
import re
import resource
import struct
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
import slangpy
from PIL import Image

from pica.errors import SceneError
from pica.images import pictures
from pica.scene.limits import Budget, Limits
from pica.scene.loading import read_environment

NOISE = np.random.default_rng(0).random((16, 32, 3)).astype(np.float32)
NOISE[4:8] = 0.5  # lines of long runs


def hdr(radiance: np.ndarray, folder: Path) -> bytes:
    """A Radiance picture as SlangPy writes it, in runs."""
    path = folder / "whole.hdr"
    slangpy.Bitmap(np.ascontiguousarray(radiance), slangpy.Bitmap.PixelFormat.rgb).write(path)
    return path.read_bytes()


def flat_hdr(size: str, pixels: int, comment: str = "") -> bytes:
    return f"#?RADIANCE\n{comment}FORMAT=32-bit_rle_rgbe\n\n{size}\n".encode() + b"\x80\x40\x20\x81" * pixels


def exr(width: int, height: int, channels: str = "BGR", tile: tuple[int, int] | None = None, origin: int = 0) -> bytes:
    """The header of an OpenEXR picture, and nothing of its content."""

    def attribute(name: str, kind: str, value: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value

    each = b"".join(name.encode() + b"\0" + struct.pack("<iBBBBii", 1, 0, 0, 0, 0, 1, 1) for name in channels)
    window = struct.pack("<4i", origin, origin, origin + width - 1, origin + height - 1)
    return (
        struct.pack("<II", 20000630, 2 | (0x200 if tile else 0))
        + attribute("channels", "chlist", each + b"\0")
        + attribute("compression", "compression", b"\3")
        + attribute("dataWindow", "box2i", window)
        + attribute("displayWindow", "box2i", window)
        + attribute("lineOrder", "lineOrder", b"\0")
        + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
        + attribute("screenWindowCenter", "v2f", bytes(8))
        + attribute("screenWindowWidth", "float", struct.pack("<f", 1))
        + (attribute("tiles", "tiledesc", struct.pack("<IIB", *tile, 0)) if tile else b"")
        + b"\0"
    )


def chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(width: int, height: int, depth: int = 8, color: int = 2, *more: bytes) -> bytes:
    """A PNG picture of a size, with as much content as one of 4 by 4 pixels has."""
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, 0))
    content = chunk(b"IDAT", zlib.compress(b"\0" * 4 * (4 * depth // 8 * {0: 1, 2: 3, 3: 1, 6: 4}[color] + 1)))
    return b"\x89PNG\r\n\x1a\n" + header + b"".join(more) + content + chunk(b"IEND", b"")


def peak_memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


@pytest.mark.parametrize("format", ["hdr", "exr", "png"])
@pytest.mark.parametrize(("width", "height"), [(30000, 10000), (60000, 15000), (2**30, 2), (16000, 8400), (16385, 1)])
def test_enormous_environments_are_refused_by_their_headers(
    format: str, width: int, height: int, tmp_path: Path
) -> None:
    path = tmp_path / f"sky.{format}"
    content = {"exr": exr, "png": png}.get(format)
    path.write_bytes(content(width, height) if content else flat_hdr(f"-Y {height} +X {width}", 9))
    before, start = peak_memory(), time.process_time()
    with pytest.raises(SceneError, match=rf"sky.{format}: (.*{width}x{height}|too many pixels)"):
        read_environment(path)
    assert peak_memory() - before < 50e6 and time.process_time() - start < 1


@pytest.mark.parametrize(
    "content",
    [exr(16, 16, tile=(40000, 40000)), exr(16, 16, tile=(2**32 - 1, 2**32 - 1)), exr(2**31 - 1, 1), exr(0, 16),
     exr(-5, 16), exr(16, 16, ""), exr(2**32 - 2, 1, origin=-(2**31))],
)  # fmt: skip
def test_headers_of_exr_that_cannot_be_meant(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "sky.exr"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"sky.exr: -?\d+x-?\d+ pixels (are too many|of \d+ channels)"):
        read_environment(path)


@pytest.mark.parametrize("name", ["a.hdr", "a.exr", "a.png"])
def test_headers_that_are_cut_short(name: str, tmp_path: Path) -> None:
    whole = {"a.hdr": flat_hdr("-Y 2 +X 2", 4), "a.exr": exr(2, 2), "a.png": png(4, 4)}[name]
    needed = whole.index(b"IEND") - 8 if name == "a.png" else len(whole)  # check sums and the end are not missed
    for length in range(needed):
        (tmp_path / name).write_bytes(whole[:length])
        with pytest.raises(SceneError, match=rf"{name}: ") as caught:
            pictures.read_radiance(tmp_path / name)
        assert str(caught.value).isprintable() and len(str(caught.value)) < 400


@pytest.mark.parametrize("comment", ["", "#" + "c" * 9000 + "\n", "A=b\n" * 30_000], ids=["none", "one", "many"])
def test_a_flat_hdr_is_whole_or_refused_however_long_its_header(comment: str, tmp_path: Path) -> None:
    path = tmp_path / "sky.hdr"
    path.write_bytes(flat_hdr("-Y 4 +X 7", 28, comment))
    np.testing.assert_allclose(pictures.read_radiance(path)[3, 6], [1, 0.5, 0.25])
    for missing in (1, 4, 100):
        path.write_bytes(flat_hdr("-Y 4 +X 7", 28, comment)[:-missing])
        with pytest.raises(SceneError, match=r"sky.hdr: truncated, 7x4 pixels do not fit in the file"):
            pictures.read_radiance(path)


def test_an_hdr_in_runs_is_whole_or_refused(tmp_path: Path) -> None:
    """Cut anywhere, also where a line ends, for which the reader then gives what lies in memory."""
    whole = hdr(NOISE, tmp_path)
    path = tmp_path / "sky.hdr"
    for length in range(whole.index(b"\n\n") + 2, len(whole)):
        path.write_bytes(whole[:length])
        with pytest.raises(SceneError, match=r"sky.hdr: "):
            pictures.read_radiance(path)
    path.write_bytes(whole + b"more")
    np.testing.assert_allclose(pictures.read_radiance(path), NOISE, atol=0.01)


def test_an_hdr_whose_values_look_like_the_start_of_a_line_is_read(tmp_path: Path) -> None:
    mark = bytes([2, 2, 0, 32])
    line = mark + (bytes([32]) + bytes(range(16)) + mark + bytes(range(12))) * 4
    path = tmp_path / "sky.hdr"
    path.write_bytes(flat_hdr("-Y 3 +X 32", 0) + 3 * line)
    assert pictures.read_radiance(path).shape == (3, 32, 3)
    path.write_bytes(flat_hdr("-Y 3 +X 32", 0) + 3 * line[:-1])
    with pytest.raises(SceneError, match=r"sky.hdr: "):
        pictures.read_radiance(path)


def test_a_flat_hdr_may_begin_like_one_in_runs(tmp_path: Path) -> None:
    path = tmp_path / "sky.hdr"
    path.write_bytes(flat_hdr("-Y 1 +X 9", 0) + b"\2\2\x80\x81" * 9)
    np.testing.assert_allclose(pictures.read_radiance(path)[0, 8], [2 / 128, 2 / 128, 1], atol=0.01)


@pytest.mark.parametrize(
    "size", ["-Y 0 +X 0", "-Y 0 +X 4", "-Y 4 +X 0", "+Y 2 +X 2", "-X 2 +Y 2", "-Y 2 -X 2", "-Y -2 +X 2", "-Y 2.0 +X 2",
             "-Y +X", "", "-Y 99999999999999999999 +X 1", "x" * 5000],
)  # fmt: skip
def test_sizes_of_hdr_that_are_none(size: str, tmp_path: Path) -> None:
    path = tmp_path / "sky.hdr"
    path.write_bytes(flat_hdr(size, 4))
    with pytest.raises(SceneError, match=r"sky.hdr: (no size after its header|\dx\d pixels are no picture)"):
        read_environment(path)


@pytest.mark.parametrize("name", ["a.tga", "a.bmp", "a.hdr", "a.gif", "a.exr"])
def test_other_formats_are_refused_whatever_the_name_says(name: str, tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.new("RGB", (4, 2)).save(stream, "BMP" if name == "a.bmp" else "GIF" if name == "a.gif" else "TGA")
    (tmp_path / name).write_bytes(stream.getvalue())
    with pytest.raises(SceneError, match=f"{name}: not a .hdr, .exr, .ktx2, .png or .jpg picture"):
        pictures.read_radiance(tmp_path / name)


def test_an_environment_counts_in_the_limits(tmp_path: Path) -> None:
    path = tmp_path / "sky.hdr"
    path.write_bytes(flat_hdr("-Y 10 +X 20", 200))
    read_environment(path, Budget(Limits(pixels=200)))
    with pytest.raises(SceneError, match=r"sky.hdr: would take 200 pixels; the limit is 199 pixels"):
        read_environment(path, Budget(Limits(pixels=199)))
    with pytest.raises(SceneError, match=r"sky.hdr: would take .* MB of memory"):
        read_environment(path, Budget(Limits(bytes=900)))


def test_a_flat_environment_of_a_few_kilobytes_takes_no_gigabytes(tmp_path: Path) -> None:
    path = tmp_path / "sky.png"
    Image.new("L", (16000, 8000), 9).save(path)
    with pytest.raises(SceneError, match=r"sky.png: would take 2.56 GB of memory; files of \d+ bytes may become 500"):
        read_environment(path)


def bomb(count: int, kind: bytes) -> list[bytes]:
    """Text chunks that take a thousand times their size."""
    packed = zlib.compress(b"\0" * 900_000, 9)
    content = {b"zTXt": b"a\0\0" + packed, b"iTXt": b"a\0\1\0\0\0" + packed, b"iCCP": b"a\0\0" + packed}[kind]
    return [chunk(kind, content)] * count


@pytest.mark.parametrize("kind", [b"zTXt", b"iTXt", b"iCCP"])
def test_texts_in_png_take_neither_memory_nor_time(kind: bytes, tmp_path: Path) -> None:
    content = png(4, 4, 8, 2, *bomb(2000, kind))
    path = tmp_path / "a.png"
    path.write_bytes(content)
    packed, start = zlib.compress(b"\0" * 900_000, 9), time.process_time()
    for _ in range(200):
        zlib.decompress(packed)
    inflating = 10 * (time.process_time() - start)
    before, start = peak_memory(), time.process_time()
    for read in (lambda: pictures.read_image(content, "a.png"), lambda: pictures.read_radiance(path)):
        try:
            read()
        except SceneError as error:
            assert re.match(r".*a\.png: not a readable picture", str(error))
    assert peak_memory() - before < 300e6
    assert time.process_time() - start < 3 * inflating + 1, "both go through it once"


def test_a_jpeg_that_is_gone_through_for_minutes_is_refused(tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.effect_noise((64, 64), 50).save(stream, "JPEG", progressive=True)
    content = stream.getvalue()
    assert pictures.read_image(content, "a.jpg").shape == (64, 64, 4)
    last = content.rindex(b"\xff\xda")
    bomb = content[:last] + content[last:-2] * 500 + content[-2:]
    (tmp_path / "a.jpg").write_bytes(bomb)
    for read in (lambda: pictures.read_image(bomb, "a.jpg"), lambda: pictures.read_radiance(tmp_path / "a.jpg")):
        with pytest.raises(SceneError, match=r"a.jpg: 5\d\d scans are too many for a JPEG picture"):
            read()


@pytest.mark.parametrize(("depth", "color"), [(16, 0), (8, 0), (8, 3), (16, 2), (16, 6), (1, 0)])
def test_textures_are_counted_before_they_are_decoded(depth: int, color: int) -> None:
    palette = [chunk(b"PLTE", bytes(range(6)))] if color == 3 else []
    admitted = []
    pictures.read_image(png(4, 4, depth, color, *palette), "a.png", lambda *amounts: admitted.append(amounts))
    assert admitted == [(16, 64)]

    def refuse(pixels: int, taken: int) -> None:
        raise SceneError(f"{pixels} are too many")

    with pytest.raises(SceneError, match=r"a.png: 100000000 are too many"):
        pictures.read_image(png(10000, 10000, depth, color, *palette), "a.png", refuse)
    with pytest.raises(SceneError, match=r"a.png: (16000x8400 pixels are too many|too many pixels)"):
        pictures.read_image(png(16000, 8400, depth, color, *palette), "a.png")


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16"])
def test_a_picture_of_many_strips_is_the_same_as_of_one(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(1).integers(0, 256, (37, 29), np.uint8)
    image = Image.fromarray(values.astype(np.uint16) * 257) if mode == "I;16" else Image.fromarray(values).convert(mode)
    stream = io.BytesIO()
    image.save(stream, "PNG")
    whole = pictures.read_image(stream.getvalue(), "a")
    monkeypatch.setattr(pictures, "_STRIP", 100)
    np.testing.assert_array_equal(pictures.read_image(stream.getvalue(), "a"), whole)
    assert whole.flags.writeable and (mode not in ("L", "I;16") or (whole[..., 0] == values).all())
