"""Environments from cube maps of KTX 2."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.images import pictures
from pica.scene.loading import read_environment
from tests.assets import ASSETS, needs_assets
from tests.images.ktx2_cube_maps import (
    BC6H,
    FLOAT,
    FLOAT_RGBA,
    HALF,
    HALF_RGBA,
    SHARED_EXPONENT,
    SMALL_FLOATS,
    cube_map,
)

CAMERAS = [
    ((-1, 0, 0), (0, 1, 0)), ((1, 0, 0), (0, 1, 0)), ((0, 1, 0), (0, 0, -1)),
    ((0, -1, 0), (0, 0, 1)), ((0, 0, 1), (0, 1, 0)), ((0, 0, -1), (0, 1, 0)),
]  # fmt: skip
"""Where cameras in the world look, and what is up for them, that see the faces +X, -X, +Y, -Y, +Z, -Z."""


def seen(environment: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """(6, side, side, 3): what cameras see of a latitude-longitude picture, 90 degrees wide, without interpolation."""
    height, width, _ = environment.shape
    places = (np.arange(side) + 0.5) / side * 2 - 1
    faces = []
    for ahead, up in CAMERAS:
        right = np.cross(ahead, up)
        view = np.array(ahead) + places[None, :, None] * right - places[:, None, None] * np.array(up)
        x, y, z = (view / np.linalg.norm(view, axis=-1, keepdims=True)).transpose(2, 0, 1)
        column = ((0.5 + np.arctan2(z, x) / (2 * np.pi)) * width).astype(int) % width
        row = np.minimum((np.arccos(y) / np.pi * height).astype(int), height - 1)
        faces.append(environment[row, column])
    return np.stack(faces)


def smooth() -> NDArray[np.float32]:
    """A sky whose colours tell all directions apart."""
    polar = (np.arange(256)[:, None] + 0.5) / 256 * np.pi
    azimuth = ((np.arange(512)[None] + 0.5) / 512 - 0.5) * 2 * np.pi
    x, z = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return np.float32(np.stack([2 + x, 2 + np.cos(polar) + 0 * x, 2 + z], -1))


def encoded(faces: NDArray[np.float32], kind: int) -> bytes:
    alpha = np.concatenate([faces, np.ones_like(faces[..., :1])], -1)
    match kind:
        case 90 | 97:
            return (faces if kind == HALF else alpha).astype("<f2").tobytes()
        case 106 | 109:
            return (faces if kind == FLOAT else alpha).astype("<f4").tobytes()
        case 122:
            bits = faces.astype(np.float16).view(np.uint16).astype(np.uint32)
            return (bits[..., 0] >> 4 | bits[..., 1] >> 4 << 11 | bits[..., 2] >> 5 << 22).astype("<u4").tobytes()
        case _:
            exponent = np.ceil(np.log2(faces.max(-1) * 512 / 511)).astype(int)
            r, g, b = np.rint(np.ldexp(faces, 9 - exponent[..., None])).astype(np.uint32).transpose(3, 0, 1, 2)
            return (r | g << 9 | b << 18 | (exponent + 15).astype(np.uint32) << 27).astype("<u4").tobytes()


@pytest.mark.parametrize("zstd", [False, True])
@pytest.mark.parametrize("kind", [HALF, HALF_RGBA, FLOAT, FLOAT_RGBA, SMALL_FLOATS, SHARED_EXPONENT])
def test_formats_and_orientation(kind: int, zstd: bool, tmp_path: Path) -> None:
    sky = smooth()
    path = tmp_path / "sky.ktx2"
    path.write_bytes(cube_map(encoded(seen(sky, 128), kind), 128, kind, zstd))
    radiance = read_environment(path).radiance
    assert radiance.shape == sky.shape
    np.testing.assert_allclose(radiance, sky, atol=0.02 if kind != SMALL_FLOATS else 0.07)


@needs_assets
def test_a_cube_map_is_the_same_environment_as_its_picture(tmp_path: Path) -> None:
    sky = pictures.read_radiance(ASSETS / "env" / "courtyard.hdr")
    side = sky.shape[0] // 2
    path = tmp_path / "sky.ktx2"
    path.write_bytes(cube_map(encoded(seen(sky, side), FLOAT), side, FLOAT))
    radiance = read_environment(path).radiance
    solid_angle = np.sin((np.arange(len(sky)) + 0.5) / len(sky) * np.pi)[:, None, None]
    sky, radiance = np.minimum(sky, 10), np.minimum(radiance, 10)  # else one pixel of the sun would decide
    error = (np.abs(radiance - sky) * solid_angle).sum() / (sky * solid_angle).sum()
    mirrored = (np.abs(radiance[:, ::-1] - sky) * solid_angle).sum() / (sky * solid_angle).sum()
    assert error < 0.08 < 3 * 0.08 < mirrored


DATA = bytes(6 * 4 * 4 * 6)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (cube_map(DATA, 4, HALF)[:90], "truncated in its header"),
        (cube_map(DATA, 4, HALF)[:-1], "its data is not that of six faces of 4x4 texels"),
        (cube_map(DATA, 4, HALF, uncompressed=1 << 40), "its data is not that of six faces of 4x4 texels"),
        (cube_map(DATA, 4, HALF, zstd=True, uncompressed=1 << 40), "its data is not that of six faces"),
        (cube_map(DATA[:-6], 4, HALF, zstd=True, uncompressed=len(DATA)), "its data is not that of six faces"),
        (cube_map(DATA, 4, HALF, start=1 << 62), "its data is not that of six faces"),
        (cube_map(DATA, 4, BC6H), "KTX 2 of format 143 and scheme 0 cannot be read as an environment"),
        (cube_map(DATA, 4, HALF, scheme=3), "KTX 2 of format 90 and scheme 3 cannot be read"),
        (cube_map(DATA, 4, HALF, faces=1), "KTX 2 that is not one cube map"),
        (cube_map(b"", 1 << 14, HALF, uncompressed=6 * 6 << 28), "65536x32768 pixels are too many"),
    ],
    ids=range(10),
)
def test_broken_cube_maps(content: bytes, fault: str, tmp_path: Path) -> None:
    path = tmp_path / "sky.ktx2"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=rf"sky.ktx2: .*{fault}") as caught:
        read_environment(path)
    assert "\n" not in str(caught.value)


def test_radiance_that_is_not_finite_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "sky.ktx2"
    path.write_bytes(cube_map(np.full(96 * 3, np.nan, "<f2").tobytes(), 4, HALF))
    with pytest.raises(SceneError, match=r"sky.ktx2: holds radiance that is not finite"):
        read_environment(path)
