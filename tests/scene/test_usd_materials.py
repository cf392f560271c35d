"""Shaders of OpenUSD: what their inputs and textures become."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdShade

import pica
from tests.scene.test_mesh_files import picture
from tests.scene.usd_files import bind, material, quad, saved, stage, texture

SKY = pica.Environment(np.ones((2, 4, 3)))
TYPES = Sdf.ValueTypeNames


def loaded(made: Usd.Stage) -> dict[str, pica.Material]:
    """The materials by their names; nothing may be left out."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = pica.load(saved(made), environment=SKY)
    sections = [section for node in scene.nodes() if node.mesh for section in node.mesh.sections]
    return {section.material.name: section.material for section in sections}


def bound(made: Usd.Stage, name: str, shader: str = "UsdPreviewSurface", **inputs: object) -> UsdShade.Material:
    result = material(made, name, shader, **inputs)
    bind(quad(made, f"/World/quad_{name}"), result)
    return result


def test_textures_of_preview_surfaces(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(picture((10, 20, 30)))
    made = stage(tmp_path / "a.usda")
    turned = bound(made, "turned", opacity=0.4)
    sampler = texture(made, turned, "diffuseColor", "a.png", wrapS="mirror", scale=(0.5, 0.6, 0.7, 1.0))
    transform = UsdShade.Shader.Define(made, "/World/turned/transform")
    transform.CreateIdAttr("UsdTransform2d")
    transform.CreateInput("scale", TYPES.Float2).Set((2, 3))
    transform.CreateInput("rotation", TYPES.Float).Set(30.0)
    transform.CreateInput("translation", TYPES.Float2).Set((0.1, 0.2))
    reader = UsdShade.Shader(made.GetPrimAtPath("/World/turned/st"))
    transform.CreateInput("in", TYPES.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
    sampler.GetInput("st").ConnectToSource(transform.ConnectableAPI(), "result")
    bumpy = bound(made, "bumpy")
    scaled = {"scale": (1.0, 1.0, 1.0, 1.0), "bias": (-0.5, -0.5, -0.5, 0.0), "sourceColorSpace": "raw"}
    texture(made, bumpy, "normal", "a.png", **scaled)
    shining = bound(made, "shining")
    texture(made, shining, "emissiveColor", "a.png", scale=(4.0, 2.0, 0.0, 1.0), sourceColorSpace="raw")
    packed = bound(made, "packed", clearcoat=0.5)
    for key, output in (("roughness", "g"), ("metallic", "b"), ("occlusion", "r")):
        texture(made, packed, key, "a.png", output)
    materials = loaded(made)

    base = materials["turned"].base_color_texture
    assert materials["turned"].base_color == pytest.approx((0.5, 0.6, 0.7, 0.4))
    assert materials["turned"].alpha_mode is pica.AlphaMode.BLEND
    assert base.sampler.wrap_u is pica.Wrap.MIRRORED_REPEAT
    u, v = 0.3, 0.8  # v up: scaled, turned, moved, and then pointing down
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    wanted = (c * 2 * u - s * 3 * v + 0.1, 1 - (s * 2 * u + c * 3 * v + 0.2))
    assert tuple(np.reshape(base.transform, (2, 3)) @ (u, 1 - v, 1)) == pytest.approx(wanted)

    assert materials["bumpy"].normal_scale == pytest.approx(0.5)
    assert materials["bumpy"].normal_texture.image.encoding == "linear"
    assert materials["shining"].emission == (4, 2, 0)
    assert materials["shining"].emissive_texture.image.encoding == "linear"
    one = materials["packed"]
    assert one.metallic_roughness_texture.image is one.occlusion_texture.image  # as it is in the file
    assert (one.metallic, one.roughness) == (1, 1) and one.coats[0].strength == 0.5


def test_workflows_colors_and_other_shaders(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    dark = {"diffuseColor": (0.0, 0.0, 0.0), "specularColor": (0.9, 0.8, 0.7)}
    bound(made, "specular", roughness=0.25, **dark).GetPrim()
    surface = UsdShade.Shader(made.GetPrimAtPath("/World/specular/surface"))
    surface.CreateInput("useSpecularWorkflow", TYPES.Int).Set(1)
    film = {"thin_film_weight": 1.0, "thin_film_thickness": 0.4, "thin_film_ior": 1.35}
    bound(made, "film", "ND_open_pbr_surface_surfaceshader", **film)
    mesh = quad(made, "/World/painted")
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("displayColor", TYPES.Color3fArray, "constant").Set([(0.1, 0.2, 0.3)])
    UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("displayOpacity", TYPES.FloatArray, "constant").Set([0.5])
    materials = loaded(made)
    assert materials["specular"].metallic > 0.9  # as KHR_materials_pbrSpecularGlossiness is converted
    assert materials["specular"].roughness == pytest.approx(0.25)
    layer = materials["film"].iridescence
    assert (layer.strength, layer.ior, layer.thickness_maximum) == pytest.approx((1.0, 1.35, 400.0), rel=1e-5)
    assert materials[""].alpha_mode is pica.AlphaMode.BLEND
    (node,) = (each for each in pica.load(saved(made), environment=SKY).nodes() if each.name == "painted")
    np.testing.assert_allclose(node.mesh.sections[0].colors[0], (0.1, 0.2, 0.3, 0.5), atol=1e-6)


def test_images_of_materialx(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(picture((10, 20, 30)))
    made = stage(tmp_path / "a.usda")
    made_material = bound(made, "oak", "ND_standard_surface_surfaceshader", base=1.0, specular_roughness=0.5)
    image = UsdShade.Shader.Define(made, made_material.GetPath().AppendChild("image"))
    image.CreateIdAttr("ND_tiledimage_color3")
    file = image.CreateInput("file", TYPES.Asset)
    file.Set("a.png")
    file.GetAttr().SetColorSpace("srgb_texture")
    image.CreateInput("uvtiling", TYPES.Float2).Set((4, 2))
    surface = UsdShade.Shader(made.GetPrimAtPath("/World/oak/surface"))
    surface.CreateInput("base_color", TYPES.Color3f).ConnectToSource(image.ConnectableAPI(), "out")
    oak = loaded(made)["oak"]
    assert oak.base_color_texture.image.pixels[0, 0].tolist() == [10, 20, 30, 255]
    assert oak.base_color_texture.image.encoding == "srgb"
    assert oak.base_color_texture.transform[0] == 4 and oak.base_color_texture.transform[4] == 2
    assert oak.roughness == 0.5


def test_an_unknown_shader_is_white_and_told(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    bound(made, "odd", "SomeRendererSurface")
    with pytest.warns(UserWarning, match=r"/World/odd: its shader 'SomeRendererSurface' is not read; .* white"):
        scene = pica.load(saved(made), environment=SKY)
    (section,) = (section for node in scene.nodes() if node.mesh for section in node.mesh.sections)
    assert section.material.base_color == (1, 1, 1, 1)


def test_color_temperature_and_normalize(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    quad(made)
    light = UsdLux.RectLight.Define(made, "/World/light")
    light.CreateIntensityAttr(12.0)
    light.CreateWidthAttr(2.0)
    light.CreateHeightAttr(3.0)
    light.CreateNormalizeAttr(True)
    light.CreateEnableColorTemperatureAttr(True)
    light.CreateColorTemperatureAttr(2700.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (read,) = (node.light for node in pica.load(saved(made), environment=SKY).nodes() if node.light)
    assert read.radiance == pytest.approx(2.0) and (read.width, read.height) == (2, 3)
    assert read.color == pytest.approx(tuple(UsdLux.BlackbodyTemperatureAsRgb(2700.0)), rel=1e-5)
    assert read.color[0] > read.color[1] > read.color[2]


def test_a_material_for_previews_alone_is_bound(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    shown = quad(made)
    UsdShade.MaterialBindingAPI.Apply(shown.GetPrim()).Bind(
        material(made, "green", diffuseColor=(0.0, 1.0, 0.0)), materialPurpose=UsdShade.Tokens.preview
    )
    assert loaded(made)["green"].base_color == (0, 1, 0, 1)
    UsdShade.MaterialBindingAPI(shown).Bind(material(made, "full"), materialPurpose=UsdShade.Tokens.full)
    assert set(loaded(made)) == {"full"}


def test_names_of_files_as_written_on_windows(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "a.png").write_bytes(picture((10, 20, 30)))
    (tmp_path / "maps" / "b.1002.png").write_bytes(picture((40, 50, 60)))
    made = stage(tmp_path / "a.usda")
    texture(made, bound(made, "one"), "diffuseColor", ".\\maps\\a.png")
    texture(made, bound(made, "tiles"), "diffuseColor", "maps\\b.<UDIM>.png")
    materials = loaded(made)
    colors = [materials[name].base_color_texture.image.pixels[0, 0, 0] for name in ("one", "tiles")]
    assert colors == [10, 40]
