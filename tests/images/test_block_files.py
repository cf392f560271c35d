"""Files of BC6H and BC7 blocks."""

import struct

import numpy as np
import pytest

from pica.errors import SceneError
from pica.images import pictures
from pica.images.blocks import BlockPicture
from tests.images.block_pictures import dds_of, float_block, ktx2_of, levels_of
from tests.images.ktx2_pictures import basis

GREY = float_block((0.5, 0.25, 4.0))
BC7 = pictures.open_texture(basis("uastc"), "ramp")().levels


@pytest.mark.parametrize("file", ["ktx2", "zstandard", "dds"])
@pytest.mark.parametrize(("form", "block"), [("BC6H", GREY), ("BC6HS", float_block((0.5, 0.25, -4.0), signed=True))])
def test_floats_stay_blocks_with_the_levels_that_there_are(file: str, form: str, block: np.ndarray) -> None:
    for count in (1, 5):
        levels = levels_of(block, 16, count)
        content = dds_of(form, 16, levels) if file == "dds" else ktx2_of(form, 16, levels, file == "zstandard")
        picture = pictures.open_texture(content, "name")()
        assert isinstance(picture, BlockPicture) and picture.form == form and picture.is_float
        for given, read in zip(levels, picture.levels, strict=True):
            np.testing.assert_array_equal(read, given)
        pixels = pictures.read_image(content, "name")
        assert pixels.shape == (16, 16, 4)
        blue = 255 if form == "BC6H" else 0
        np.testing.assert_allclose(pixels[3, 5], (127, 63, blue, 255), atol=4)


@pytest.mark.parametrize("of", [ktx2_of, dds_of])
def test_bc7_stays_blocks_with_all_levels_alone(of) -> None:  # type: ignore[no-untyped-def]
    whole = pictures.open_texture(of("BC7", 32, list(BC7)), "name")()
    assert isinstance(whole, BlockPicture) and len(whole.levels) == 6 and whole.form == "BC7"
    single = pictures.open_texture(of("BC7", 32, list(BC7[:1])), "name")()
    assert isinstance(single, np.ndarray)
    np.testing.assert_array_equal(single, whole.pixels())


def changed(content: bytes, at: int, value: int, form: str = "<I") -> bytes:
    copy = bytearray(content)
    struct.pack_into(form, copy, at, value)
    return bytes(copy)


KTX2, DDS = (of("BC6H", 16, levels_of(GREY, 16, 5)) for of in (ktx2_of, dds_of))
ZSTANDARD = ktx2_of("BC6H", 16, levels_of(GREY, 16, 1), True)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (KTX2[:-1], "its data is not that of 16x16 pixels"),
        (DDS[:-1], "its data is not that of 16x16 pixels"),
        (KTX2[:90], "(truncated|its data is not that of 16x16 pixels)"),
        (changed(KTX2, 40, 40), "40 mipmap levels of 16x16 pixels are no picture"),
        (changed(DDS, 28, 1 << 31), "2147483648 mipmap levels of 16x16 pixels are no picture"),
        (changed(KTX2, 20, 0), "5 mipmap levels of 0x16 pixels are no picture"),
        (changed(changed(DDS, 12, 1 << 30), 16, 1 << 30), "its data is not that of 1073741824x1073741824 pixels"),
        (changed(KTX2, 80, 1 << 62, "<Q"), "its data is not that of 16x16 pixels"),
        (changed(KTX2, 96, 1 << 40, "<Q"), "its data is not that of 16x16 pixels"),
        (changed(ZSTANDARD, 106, 0xFFFFFFFF), "(not a readable picture|its data is not that of)"),
    ],
    ids=range(10),
)
def test_forged_files_are_one_error(content: bytes, fault: str) -> None:
    with pytest.raises(SceneError, match=f"^name: .*{fault}") as caught:
        pictures.open_texture(content, "name")()
    assert "\n" not in str(caught.value)


def test_memory_is_admitted_first() -> None:
    def admit(pixels: int, taken: int) -> None:
        raise SceneError(f"{pixels} pixels, {taken} bytes")

    with pytest.raises(SceneError, match=r"^name: 256 pixels, 1536 bytes$"):
        pictures.open_texture(KTX2, "name", admit)
