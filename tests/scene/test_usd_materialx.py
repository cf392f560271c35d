"""Documents of MaterialX that stages of OpenUSD refer to."""

from pathlib import Path

import numpy as np
import PIL.Image
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")
pytest.importorskip("MaterialX", reason="the extra usd is not installed")

from pxr import Usd, UsdShade, UsdUtils

import pica
from tests.scene.test_usd import SKY, load, node
from tests.scene.usd_files import bind, quad, saved, stage

STANDARD = """
  <nodegraph name="graph">
    <input name="tint" type="color3" value="0.5, 1, 0.25"/>
    <image name="photo" type="color3">
      <input name="file" type="filename" value="a.png" colorspace="srgb_texture"/>
    </image>
    <multiply name="tinted" type="color3">
      <input name="in1" type="color3" nodename="photo"/>
      <input name="in2" type="color3" interfacename="tint"/>
    </multiply>
    <image name="rough" type="float"><input name="file" type="filename" value="a.png"/></image>
    <output name="color_out" type="color3" nodename="tinted"/>
    <output name="rough_out" type="float" nodename="rough"/>
  </nodegraph>
  <standard_surface name="surface" type="surfaceshader">
    <input name="base" type="float" value="1"/>
    <input name="base_color" type="color3" nodegraph="graph" output="color_out"/>
    <input name="specular_roughness" type="float" nodegraph="graph" output="rough_out"/>
    <input name="metalness" type="float" value="0.5"/>
    <input name="coat" type="float" nodename="coated"/>
  </standard_surface>
  <constant name="coated" type="float"><input name="value" type="float" value="0.7"/></constant>
  <surfacematerial name="wood" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="surface"/>
  </surfacematerial>
"""
OPEN_PBR = """
  <open_pbr_surface name="surface" type="surfaceshader">
    <input name="base_color" type="color3" value="0.5, 0.5, 1" colorspace="srgb_texture"/>
    <input name="specular_roughness" type="float" value="0.4"/>
    <input name="specular_ior" type="float" value="1.4"/>
  </open_pbr_surface>
  <surfacematerial name="wood" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="surface"/>
  </surfacematerial>
"""


def document(body: str) -> str:
    return f'<?xml version="1.0"?><materialx version="1.39" colorspace="lin_rec709">{body}</materialx>'


def referring(folder: Path, body: str, name: str = "maps/wood.mtlx") -> Usd.Stage:
    """A stage with two materials that refer to the same document."""
    (folder / "maps").mkdir()
    (folder / "maps" / "wood.mtlx").write_text(body)
    PIL.Image.new("RGB", (2, 2), (200, 100, 50)).save(folder / "maps" / "a.png")
    made = stage(folder / "a.usda")
    for number in range(2):
        material = UsdShade.Material.Define(made, f"/World/Looks/wood{number}")
        material.GetPrim().GetReferences().AddReference(f"./{name}", "/MaterialX/Materials/wood")
        bind(quad(made, f"/World/quad{number}"), material)
    return made


def test_standard_surface_of_a_document(tmp_path: Path) -> None:
    scene = load(saved(referring(tmp_path, document(STANDARD))))
    for name in ("quad0", "quad1"):
        (section,) = node(scene, name).mesh.sections
        wood = section.material
        assert wood.base_color[:3] == (0.5, 1, 0.25)
        assert wood.base_color_texture.image.pixels[0, 0].tolist() == [200, 100, 50, 255]
        assert wood.metallic_roughness_texture.image.pixels[0, 0, 1:3].tolist() == [200, 128]
        assert wood.coats[0].strength == pytest.approx(0.7)


def test_open_pbr_of_a_document(tmp_path: Path) -> None:
    wood = node(load(saved(referring(tmp_path, document(OPEN_PBR)))), "quad0").mesh.sections[0].material
    np.testing.assert_allclose(wood.base_color[:3], (0.2140, 0.2140, 1), atol=1e-4)
    assert (wood.roughness, wood.ior) == pytest.approx((0.4, 1.4))


def test_a_document_in_a_referenced_layer(tmp_path: Path) -> None:
    (tmp_path / "part").mkdir()
    part = saved(referring(tmp_path / "part", document(STANDARD)))
    made = stage(tmp_path / "whole.usda")
    made.DefinePrim("/World/part").GetReferences().AddReference("./part/a.usda")
    wood = node(load(saved(made)), "quad1").mesh.sections[0].material
    assert wood.base_color_texture is not None and part.exists()


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("<materialx", "document './maps/wood.mtlx': cannot be read as MaterialX (XML parse error"),
        (document('<xi:include href="/etc/passwd"/>' + OPEN_PBR), "documents that .mtlx files include are left out"),
        (
            document(OPEN_PBR.replace("open_pbr_surface", "disney_principled")),
            "its shader 'ND_disney_principled_surfaceshader' is not read; the material is white",
        ),
        (
            document(STANDARD.replace("<constant", "<noise2d").replace("</constant", "</noise2d")),
            "shader nodes of type ND_noise2d_float are left out",
        ),
    ],
)
def test_what_does_not_map_is_told(body: str, told: str, tmp_path: Path) -> None:
    with pytest.warns(UserWarning) as caught:
        pica.load(saved(referring(tmp_path, body)), environment=SKY)
    assert any(told in str(each.message) for each in caught), [str(each.message) for each in caught]
    assert len(caught) <= 3


def test_nodes_in_a_circle_end(tmp_path: Path) -> None:
    body = """
      <multiply name="a" type="float"><input name="in1" type="float" nodename="b"/></multiply>
      <multiply name="b" type="float"><input name="in1" type="float" nodename="a"/></multiply>
      <standard_surface name="surface" type="surfaceshader">
        <input name="metalness" type="float" nodename="a"/>
      </standard_surface>
      <surfacematerial name="wood" type="material">
        <input name="surfaceshader" type="surfaceshader" nodename="surface"/>
      </surfacematerial>"""
    with pytest.warns(UserWarning, match="shader nodes of type ND_multiply_float are left out"):
        pica.load(saved(referring(tmp_path, document(body))), environment=SKY)


def test_documents_come_from_the_folder_alone(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    made = referring(folder, "", "../secret.mtlx")
    (tmp_path / "secret.mtlx").write_text(document(OPEN_PBR))
    with pytest.warns(UserWarning, match="lies outside the asset's folder"):
        scene = pica.load(saved(made), environment=SKY)
    assert node(scene, "quad0").mesh.sections[0].material.base_color == (1, 1, 1, 1)


def test_documents_in_packages_are_told(tmp_path: Path) -> None:
    path = saved(referring(tmp_path, document(OPEN_PBR)))
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(tmp_path / "a.usdz"))
    with pytest.warns(UserWarning) as caught:
        pica.load(tmp_path / "a.usdz", environment=SKY)
    told = [str(each.message) for each in caught]
    assert len(told) == 3 and "is in a package, from which documents are not read" in told[0]
