"""OpenUSD that nobody can trust: what lies outside of its folder, broken files, and limits."""

import math
from pathlib import Path

import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Sdf, Usd, UsdGeom

import pica
from pica.errors import SceneError
from pica.scene.conversion import formats
from tests.scene.test_mesh_files import picture
from tests.scene.test_usd import SKY, load, node
from tests.scene.usd_files import bind, cube, material, quad, saved, stage, texture


def test_layers_come_from_the_folder_alone(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    quad(other := stage(tmp_path / "other.usda"))
    saved(other)
    made = stage(folder / "a.usda")
    made.OverridePrim("/World/there").GetReferences().AddReference("../other.usda", "/World")
    path = saved(made)
    with pytest.raises(SceneError, match=r"a.usda: layer '../other.usda' lies outside .*allow_outside=True"):
        load(path)
    assert node(load(path, allow_outside=True), "quad").mesh
    made.OverridePrim("/World/there").GetReferences().SetReferences([Sdf.Reference("/etc/other.usda")])
    with pytest.raises(SceneError, match=r"'/etc/other.usda' is not a path relative to the file"):
        load(saved(made), allow_outside=True)


def test_layers_with_arguments_and_value_clips_are_no_way_out(tmp_path: Path) -> None:
    (folder := tmp_path / "folder").mkdir()
    quad(other := stage(tmp_path / "other.usda"))
    saved(other)
    made = stage(folder / "a.usda")
    references = made.OverridePrim("/World/there").GetReferences()
    references.AddReference("../other.usda:SDF_FORMAT_ARGS:a=b", "/World")
    with pytest.raises(SceneError, match="lies outside"):
        load(saved(made))
    references.ClearReferences()
    clips = Usd.ClipsAPI(made.DefinePrim("/World/clipped"))
    clips.SetClipAssetPaths([Sdf.AssetPath("../other.usda")])
    with pytest.raises(SceneError, match="/World/clipped: has value clips"):
        load(saved(made))


@pytest.mark.parametrize("link", ["sub.usda", "a.png"])
def test_links_out_of_the_folder_are_not_followed(link: str, tmp_path: Path) -> None:
    (folder := tmp_path / "folder").mkdir()
    made = stage(folder / "a.usda")
    painted = material(made, "painted")
    bind(quad(made), painted)
    (folder / link).symlink_to("/etc/hostname")
    if link == "a.png":
        texture(made, painted, "diffuseColor", "a.png")
        with pytest.warns(UserWarning, match="lies outside"):
            pica.load(saved(made), environment=SKY)
        return
    made.GetRootLayer().subLayerPaths.append("sub.usda")
    with pytest.raises(SceneError, match="lies outside"):
        load(saved(made))


@pytest.mark.parametrize(
    ("name", "fault"),
    [("missing.png", "no such file"), ("../outside.png", "allow_outside"), ("/etc/hostname", "not a path relative")],
)
def test_textures_come_from_the_folder_alone(name: str, fault: str, tmp_path: Path) -> None:
    (tmp_path / "outside.png").write_bytes(picture((1, 2, 3)))
    (tmp_path / "folder").mkdir()
    made = stage(tmp_path / "folder" / "a.usda")
    painted = material(made, "painted")
    bind(quad(made), painted)
    texture(made, painted, "diffuseColor", name)
    path = saved(made)
    with pytest.warns(UserWarning, match=f"texture: .*{fault}"):
        scene = pica.load(path, environment=SKY)
    assert node(scene, "quad").mesh.sections[0].material.base_color_texture is None


@pytest.mark.parametrize(
    ("points", "counts", "indices", "fault"),
    [
        ([(0, 0, 0)], [3], [0, 1, 2], "faceVertexIndices: name point 2 of 1"),
        ([(0, 0, 0)] * 3, [4], [0, 1, 2], "faceVertexCounts: ask for 4 corners, and there are 3"),
        ([(0, 0, 0)] * 3, [-3, 6], [0, 1, 2], "faceVertexCounts: ask for 3"),
        ([(0, 0, 0)] * 3, [3], [0, 1, -1], "faceVertexIndices"),
        ([(math.nan, 0, 0)] * 3, [3], [0, 1, 2], "not finite"),
    ],
)
def test_invalid_meshes_are_one_error(points, counts, indices, fault: str, tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = UsdGeom.Mesh.Define(made, "/World/bad")
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(counts)
    mesh.CreateFaceVertexIndicesAttr(indices)
    with pytest.raises(SceneError, match=f"a.usda: .*{fault}"):
        load(saved(made))


@pytest.mark.parametrize("name", ["a.usda", "a.usdc", "a.usdz", "a.usd"])
@pytest.mark.parametrize("content", [b"", b"#usda 1.0\ndef Mesh", b"PXR-USDC" + b"\xff" * 80, b"PK\3\4" + b"\0" * 90])
def test_broken_files_are_one_error(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError, match=name) as caught:
        load(tmp_path / name)
    assert "Error" not in str(caught.value) and "pxrInternal" not in str(caught.value)


def test_the_missing_library_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formats, "find_spec", lambda name: None)
    (tmp_path / "a.usdz").write_bytes(b"")
    with pytest.raises(SceneError, match=r"""a.usdz: its format needs the extra 'usd': pip install "pica\[usd\]"$"""):
        load(tmp_path / "a.usdz")


def test_limits_hold(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    cube(made, scheme="catmullClark")
    path = saved(made)
    with pytest.raises(SceneError, match=r"/World/cube: would take \d+ vertices.*the limit is 100 vertices"):
        load(path, limits=pica.Limits(vertices=100))
