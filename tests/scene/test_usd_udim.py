"""Textures of UDIM tiles in OpenUSD."""

from pathlib import Path

import numpy as np
import PIL.Image
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Usd, UsdGeom, UsdUtils

import pica
from pica.scene.conversion import udim
from pica.scene.conversion.conversion import Conversion, CountingBudget
from pica.scene.conversion.pictures import Pictures
from pica.scene.limits import Limits
from tests.scene.test_mesh_files import picture
from tests.scene.test_usd import SKY, load, node
from tests.scene.usd_files import bind, material, quad, saved, stage, texture

COLORS = {1002: (250, 0, 0), 1003: (0, 250, 0), 1012: (0, 0, 250), 1013: (250, 250, 0)}


def tiled(path: Path, tiles: dict[int, tuple[int, int, int]], name: str = "maps/a.<UDIM>.png") -> Usd.Stage:
    """A quad whose coordinates go from (1, 0) to (3, 2)."""
    made = stage(path / "a.usda")
    painted = material(made, "painted")
    bind(quad(made), painted)
    st = UsdGeom.PrimvarsAPI(made.GetPrimAtPath("/World/quad")).GetPrimvar("st")
    st.Set([(1, 0), (3, 0), (3, 2), (1, 2)])
    texture(made, painted, "diffuseColor", name)
    (path / "maps").mkdir()
    for number, color in tiles.items():
        (path / "maps" / f"a.{number}.png").write_bytes(picture(color))
    return made


def colors_at(section: pica.scene.mesh.Section, places: list[tuple[float, float]]) -> list[tuple[int, ...]]:
    """The texels at texture coordinates of the file."""
    base = section.material.base_color_texture
    matrix = np.array(base.transform).reshape(2, 3)
    height, width = base.image.pixels.shape[:2]
    found = []
    for u, v in places:
        x, y = matrix @ (u, 1 - v, 1)
        found.append(tuple(base.image.pixels[int(y * height), int(x * width), :3].tolist()))
    return found


@pytest.mark.parametrize("packed", [False, True])
def test_tiles_lie_where_their_coordinates_are(packed: bool, tmp_path: Path) -> None:
    path = saved(tiled(tmp_path, COLORS))
    if packed:
        assert UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "a.usdz"))
        path = tmp_path / "a.usdz"
    (section,) = node(load(path), "quad").mesh.sections
    assert section.material.base_color_texture.sampler.wrap_u is pica.Wrap.CLAMP_TO_EDGE
    places = [(1.2, 0.2), (2.7, 0.9), (1.9, 1.1), (2.1, 1.9)]
    assert colors_at(section, places) == list(COLORS.values())


def test_one_tile_is_the_picture_itself(tmp_path: Path) -> None:
    (section,) = node(load(saved(tiled(tmp_path, {1012: (1, 2, 3)}))), "quad").mesh.sections
    assert section.material.base_color_texture.image.pixels.shape == (2, 2, 4)
    assert colors_at(section, [(1.5, 1.5)]) == [(1, 2, 3)]


def test_larger_tiles_set_the_size(tmp_path: Path) -> None:
    made = tiled(tmp_path, {1002: (250, 0, 0)})
    large = np.full((8, 4, 3), (0, 250, 0), np.uint8)
    PIL.Image.fromarray(large).save(tmp_path / "maps" / "a.1003.png")
    (section,) = node(load(saved(made)), "quad").mesh.sections
    assert section.material.base_color_texture.image.pixels.shape == (8, 8, 4)
    assert colors_at(section, [(1.5, 0.5), (2.5, 0.5)]) == [(250, 0, 0), (0, 250, 0)]


@pytest.mark.parametrize(
    ("tiles", "told"),
    [
        ({1002: (1, 1, 1), 1013: (2, 2, 2)}, "of its tiles 1003, 1012 are missing; black there"),
        ({}, "'maps/a.<UDIM>.png' has no tiles; left out"),
    ],
)
def test_missing_tiles_are_told_in_one_line(tiles: dict, told: str, tmp_path: Path) -> None:
    with pytest.warns(UserWarning) as caught:
        pica.load(saved(tiled(tmp_path, tiles)), environment=SKY)
    assert [told in str(each.message) for each in caught] == [True]


def test_a_broken_tile_is_told_and_left_out(tmp_path: Path) -> None:
    made = tiled(tmp_path, COLORS)
    (tmp_path / "maps" / "a.1003.png").write_bytes(b"no picture")
    with pytest.warns(UserWarning, match=r"a.<UDIM>.png': no picture of a format that is read; left out"):
        scene = pica.load(saved(made), environment=SKY)
    assert node(scene, "quad").mesh.sections[0].material.base_color_texture is None


def test_tiles_outside_the_folder_are_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    made = tiled(folder, {}, "../a.<UDIM>.png")
    (tmp_path / "a.1001.png").write_bytes(picture((1, 2, 3)))
    with pytest.warns(UserWarning, match="lies outside the asset's folder"):
        pica.load(saved(made), environment=SKY)


def test_tiles_that_are_too_large_together_are_halved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(udim, "_LONGEST_SIDE", 2)
    monkeypatch.setattr(CountingBudget, "_set_limits", lambda self: None)
    conversion = Conversion(tmp_path / "a.usda", CountingBudget(Limits()), False, None)
    pictures = Pictures(conversion)
    made = udim.joined(conversion, pictures, {1001: picture((1, 2, 3)), 1002: picture((4, 5, 6))}, "a")
    assert made is not None and pictures.size(made.content) == (2, 1)
    assert conversion.warnings == ["texture 'a': its tiles together are too large, so each is 1x1"]
    assert made.transform == (0.5, 0, 0, 0, 1, 0)
