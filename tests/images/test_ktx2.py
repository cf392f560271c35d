import struct
import sys

import numpy as np
import pytest

from pica.errors import SceneError
from pica.images import pictures
from pica.images.blocks import BlockPicture
from pica.images.ktx2 import BYTES_PER_PIXEL, UnsupportedPictureError
from tests.images.ktx2_pictures import BC5, R8, RAMP, RGB8, RGBA8, RGBA8_SRGB, basis, plain


@pytest.mark.parametrize(
    ("name", "channels", "error"), [("etc1s", 3, 6), ("etc1s_alpha", 4, 6), ("uastc", 4, 2), ("uastc_zstandard", 4, 2)]
)
def test_basis_universal(name: str, channels: int, error: float) -> None:
    pixels = pictures.read_image(basis(name), name)
    assert pixels.shape == RAMP.shape and pixels.dtype == np.uint8
    difference = np.abs(pixels.astype(float) - RAMP)[..., :channels]
    assert difference.mean() < error and difference.max() < 8 * error
    if channels == 3:
        assert (pixels[..., 3] == 255).all()


@pytest.mark.parametrize(("name", "error"), [("etc1s", 6), ("etc1s_alpha", 6), ("uastc", 3), ("uastc_zstandard", 3)])
def test_textures_stay_compressed_with_their_mipmaps(name: str, error: float) -> None:
    blocks = pictures.open_texture(basis(name), "name")()
    assert isinstance(blocks, BlockPicture)
    assert [level.shape for level in blocks.levels] == [(n, n, 16) for n in (8, 4, 2, 1, 1, 1)]
    channels = slice(0, 3 if name == "etc1s" else 4)
    difference = blocks.pixels()[..., channels].astype(float) - RAMP[..., channels]
    assert np.abs(difference).mean() < error
    quarter = RAMP.reshape(8, 4, 8, 4, 4).mean((1, 3))
    assert np.abs(blocks.pixels(2)[..., channels].astype(float) - quarter[..., channels]).mean() < 4 * error


def test_pictures_without_mipmaps_become_pixels() -> None:
    single = changed(basis("uastc"), 40, 1)
    np.testing.assert_array_equal(pictures.open_texture(single, "name")(), pictures.read_image(single, "name"))


@pytest.mark.parametrize(
    ("offset", "value"), [(80 + 24, 1 << 62), (80 + 24 + 8, 1 << 40), (80 + 24 + 16, 1 << 40)], ids=range(3)
)
def test_forged_mipmaps(offset: int, value: int) -> None:
    forged = changed(basis("uastc_zstandard"), offset, value, form="<Q")
    with pytest.raises(SceneError, match=r"^name: its mipmap levels are not those of 32x32 pixels"):
        pictures.open_texture(forged, "name")()


def test_zstandard_changes_no_pixel() -> None:
    first, second = (pictures.read_image(basis(name), name) for name in ("uastc", "uastc_zstandard"))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("zstd", [False, True])
def test_plain_pixels(zstd: bool) -> None:
    for vulkan_format in (RGBA8, RGBA8_SRGB):
        np.testing.assert_array_equal(pictures.read_image(plain(RAMP, vulkan_format, zstd), "rgba"), RAMP)
    rgb = pictures.read_image(plain(np.ascontiguousarray(RAMP[:5, :7, :3]), RGB8, zstd), "rgb")
    np.testing.assert_array_equal(rgb[..., :3], RAMP[:5, :7, :3])
    assert (rgb[..., 3] == 255).all()
    red = pictures.read_image(plain(np.ascontiguousarray(RAMP[..., :1]), R8, zstd), "red")
    np.testing.assert_array_equal(red[0, 5], [40, 0, 0, 255])


def test_memory_is_admitted_first() -> None:
    admitted: list[tuple[int, int]] = []

    def admit(pixels: int, taken: int) -> None:
        admitted.append((pixels, taken))
        raise SceneError("too much")

    with pytest.raises(SceneError, match=r"^name: too much$"):
        pictures.read_image(basis("uastc"), "name", admit)
    assert admitted == [(32 * 32, 32 * 32 * BYTES_PER_PIXEL)]


def changed(content: bytes, at: int, *values: int, form: str = "<I") -> bytes:
    copy = bytearray(content)
    for value in values:
        struct.pack_into(form, copy, at, value)
        at += struct.calcsize(form)
    return bytes(copy)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (basis("uastc")[:100], "truncated in its header"),
        (basis("uastc")[:700], "its data is not that of 32x32 pixels"),
        (changed(basis("uastc"), 20, 1 << 20, 1 << 20), "its data is not that of 1048576x1048576 pixels"),
        (changed(basis("etc1s"), 20, 1 << 20, 1 << 20), "1048576x1048576 pixels are too many"),
        (changed(basis("uastc_zstandard"), 96, 1 << 40, form="<Q"), "its data is not that of 32x32 pixels"),
        (changed(basis("etc1s"), 80, 1 << 62, form="<Q"), "its data is not that of 32x32 pixels"),
        (plain(RAMP, RGBA8, zstd=True, claimed=1 << 33), "its data is not that of 32x32 pixels"),
        (plain(RAMP, RGBA8)[:-1], "its data is not that of 32x32 pixels"),
        (changed(plain(RAMP, RGBA8, zstd=True), 112, *[1 << 31] * 20), "(its data is|not a readable picture)"),
    ],
    ids=range(9),
)
def test_forged_pictures(content: bytes, fault: str) -> None:
    with pytest.raises(SceneError, match=f"^name: .*{fault}") as caught:
        pictures.read_image(content, "name")
    assert "\n" not in str(caught.value) and not isinstance(caught.value, UnsupportedPictureError)


@pytest.mark.parametrize(
    "content",
    [
        plain(RAMP, BC5),
        changed(basis("uastc"), 28, 4),  # depth
        changed(basis("uastc"), 32, 2),  # layers
        changed(basis("uastc"), 36, 6),  # faces
        changed(basis("uastc"), 44, 3),  # zlib
    ],
)
def test_other_kinds_are_not_called_broken(content: bytes) -> None:
    with pytest.raises(UnsupportedPictureError, match=r"^name: KTX 2 .* cannot be read"):
        pictures.read_image(content, "name")


def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opengl_basisu", None)
    with pytest.raises(UnsupportedPictureError, match="needs the package opengl_basisu"):
        pictures.read_image(basis("uastc"), "name")
    assert pictures.read_image(plain(RAMP, RGBA8), "name").shape == RAMP.shape
