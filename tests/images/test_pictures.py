import io
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import slangpy
from PIL import Image

import pica
from pica.errors import PicaError, SceneError
from pica.images import pictures
from tests.assets import ASSETS, needs_assets

GRADIENT = (np.arange(6 * 8).reshape(6, 8) * 5).astype(np.uint8)


def encoded(image: Image.Image, kind: str = "PNG", **options: object) -> bytes:
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


def test_grey_becomes_four_equal_channels() -> None:
    pixels = pictures.read_image(encoded(Image.fromarray(GRADIENT)), "grey")
    np.testing.assert_array_equal(pixels, np.dstack([GRADIENT] * 3 + [np.full_like(GRADIENT, 255)]))


def test_sixteen_bit_grey_is_scaled() -> None:
    wide = GRADIENT.astype(np.uint16) * 257
    np.testing.assert_array_equal(pictures.read_image(encoded(Image.fromarray(wide)), "grey")[..., 0], GRADIENT)


def test_palette_with_transparency() -> None:
    image = Image.fromarray(np.array([[0, 1]], np.uint8), "P")
    image.putpalette([255, 0, 0, 0, 0, 255])
    pixels = pictures.read_image(encoded(image, transparency=1), "palette")
    np.testing.assert_array_equal(pixels, [[[255, 0, 0, 255], [0, 0, 255, 0]]])


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_kinds(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "picture"
    path.write_bytes(encoded(Image.new("RGB", (16, 8), (200, 100, 50)), kind))
    pixels = pictures.read_image(path, "picture")
    assert pixels.shape == (8, 16, 4) and pixels.dtype == np.uint8
    np.testing.assert_allclose(pixels[4, 8], [200, 100, 50, 255], atol=4)


def huge_png() -> bytes:
    """A few bytes that claim to be 60000 by 60000 pixels."""
    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    chunk = b"IHDR" + header
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"no picture",
        encoded(Image.effect_noise((64, 64), 50))[:2000],
        encoded(Image.fromarray(GRADIENT), "BMP"),
        huge_png(),
    ],
    ids=["empty", "text", "truncated", "another kind", "huge"],
)
def test_broken_pictures_end_in_one_line(data: bytes) -> None:
    with pytest.raises(SceneError, match=r"wall.png: ") as caught:
        pictures.read_image(data, "wall.png")
    assert "\n" not in str(caught.value)


def test_a_missing_picture_is_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"wall.png: no such file"):
        pictures.read_image(tmp_path / "gone.png", "wall.png")


@needs_assets
@pytest.mark.parametrize("name", ["courtyard.hdr", "nvpro_std_env.hdr", "zip_exr/bl_studio.exr"])
def test_radiance(name: str) -> None:
    radiance = pictures.read_radiance(ASSETS / "env" / name)
    assert radiance.dtype == np.float32 and radiance.shape[2] == 3 and radiance.max() > 1


def test_eight_bit_pictures_become_linear(tmp_path: Path) -> None:
    pictures.write_png(tmp_path / "a.png", np.full((2, 3, 3), 188, np.uint8))
    np.testing.assert_allclose(pictures.read_radiance(tmp_path / "a.png"), 0.5029, atol=1e-3)


@needs_assets
@pytest.mark.parametrize("size", [0, 40, 1000, 1_000_000, 2_097_201])
def test_a_truncated_radiance_file_is_refused(size: int, tmp_path: Path) -> None:
    path = tmp_path / "sky.hdr"
    path.write_bytes((ASSETS / "env" / "courtyard.hdr").read_bytes()[:size])
    with pytest.raises(SceneError, match=r"sky.hdr: ") as caught:
        pictures.read_radiance(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["a.exr", "a.hdr", "a.png"])
def test_what_is_no_radiance_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"this is no picture at all, whatever the name says")
    with pytest.raises(SceneError, match=name) as caught:
        pictures.read_radiance(tmp_path / name)
    assert "\n" not in str(caught.value)
    with pytest.raises(SceneError, match="no such file"):
        pictures.read_radiance(tmp_path / f"missing-{name}")


def test_exr_keeps_named_channels(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    names = ["R", "G", "B", "depth.Z", "normal.X", "normal.Y", "normal.Z", "instance.Y"]
    channels = {name: random.normal(size=(5, 7)).astype(np.float32) * 1e4 for name in names}
    channels["depth.Z"][2, 3] = np.inf
    pictures.write_exr(tmp_path / "a.exr", channels)
    back = pictures.read_exr(tmp_path / "a.exr")
    assert set(back) == set(names)
    for name in names:
        np.testing.assert_array_equal(back[name], channels[name])
    np.testing.assert_array_equal(pictures.read_radiance(tmp_path / "a.exr")[..., 1], channels["G"])


def test_exr_of_one_channel(tmp_path: Path) -> None:
    pictures.write_exr(tmp_path / "a.exr", {"depth.Z": np.ones((2, 3), np.float32)})
    assert [(name, values.shape) for name, values in pictures.read_exr(tmp_path / "a.exr").items()] == [
        ("depth.Z", (2, 3))
    ]


def test_png_round_trip_leaves_no_other_file(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)
    pictures.write_png(tmp_path / "a.png", pixels)
    np.testing.assert_array_equal(pictures.read_image(tmp_path / "a.png", "a")[..., :3], pixels)
    assert os.listdir(tmp_path) == ["a.png"]


def test_a_picture_appears_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    with path.open("rb") as seen_before:
        pictures.write_png(path, np.zeros((2, 2, 3), np.uint8))
        assert seen_before.read() == b"old"  # the new file took the old one's name, not its place on the disk


def test_a_failed_write_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(b"old")

    def fail(self: Image.Image, target: Path, kind: str) -> None:
        Path(target).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", fail)
    with pytest.raises(PicaError, match=r"a.png: cannot be written \(No space left on device\)"):
        pictures.write_png(path, np.zeros((2, 2, 3), np.uint8))
    assert path.read_bytes() == b"old" and os.listdir(tmp_path) == ["a.png"]


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_missing_folder_is_one_line(name: str, tmp_path: Path) -> None:
    with pytest.raises(PicaError, match=f"{name}: cannot be written") as caught:
        if name.endswith("png"):
            pictures.write_png(tmp_path / "gone" / name, np.zeros((2, 2, 3), np.uint8))
        else:
            pictures.write_exr(tmp_path / "gone" / name, {"R": np.zeros((2, 2), np.float32)})
    assert "\n" not in str(caught.value)


def test_only_exr_files_are_read_as_such(tmp_path: Path) -> None:
    pictures.write_png(tmp_path / "a.exr", np.zeros((2, 2, 3), np.uint8))
    for name, says in (("a.exr", "not an OpenEXR picture"), ("gone.exr", "no such file"), (".", "it is a folder")):
        with pytest.raises(SceneError, match=says) as caught:
            pica.read_exr(tmp_path / name)
        assert "\n" not in str(caught.value)
    with pytest.raises(SceneError, match="path: 7 is not the path of a file"):
        pica.read_exr(7)  # type: ignore[arg-type]


def test_exr_keeps_types(tmp_path: Path) -> None:
    for kind in (np.float16, np.float32, np.uint32):
        pixels = np.arange(24).reshape(2, 3, 4).astype(kind)
        path = tmp_path / "a.exr"
        slangpy.Bitmap(pixels, slangpy.Bitmap.PixelFormat.rgba).write(path)
        channels = pica.read_exr(path)
        assert set(channels) == set("RGBA")
        for index, name in enumerate("RGBA"):
            assert channels[name].dtype == kind
            np.testing.assert_array_equal(channels[name], pixels[..., index])


def test_exr_keeps_to_limits(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    pictures.write_exr(path, {name: np.zeros((1000, 1000), np.float32) for name in "RGB"})
    with pytest.raises(SceneError, match=r"would take 24 MB of memory.*the limit is 20 MB"):
        pica.read_exr(path, limits=pica.Limits(bytes=20e6))
    assert pica.read_exr(path)["R"].shape == (1000, 1000)


@pytest.mark.parametrize("size", [4, 40, 200, 400])
def test_a_truncated_exr_is_one_line(size: int, tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    pictures.write_exr(path, {name: np.random.default_rng(0).random((8, 8)) for name in "RGB"})
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(SceneError, match=r"a\.exr: ") as caught:
        pica.read_exr(path)
    assert "\n" not in str(caught.value)
