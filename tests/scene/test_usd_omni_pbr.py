"""OmniPBR materials of files from Omniverse."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr", reason="the extra usd is not installed")

from pxr import Sdf, UsdShade

import pica
from tests.scene.test_mesh_files import picture
from tests.scene.test_usd import SKY, load, node
from tests.scene.usd_files import bind, quad, saved, stage

_TYPES = {bool: Sdf.ValueTypeNames.Bool, float: Sdf.ValueTypeNames.Float, str: Sdf.ValueTypeNames.Asset}


def path_of(folder: Path, name: str = "OmniPBR", **inputs: Any) -> Path:
    """A stage of a quad with such a material."""
    (folder / "a.png").write_bytes(picture((200, 100, 50)))
    made = stage(folder / "a.usda")
    material = UsdShade.Material.Define(made, "/World/Looks/paint")
    shader = UsdShade.Shader.Define(made, "/World/Looks/paint/Shader")
    shader.SetSourceAsset(Sdf.AssetPath("OmniPBR.mdl"), "mdl")
    shader.SetSourceAssetSubIdentifier(name, "mdl")
    for key, value in inputs.items():
        pair = Sdf.ValueTypeNames.Float2 if isinstance(value, tuple) and len(value) == 2 else Sdf.ValueTypeNames.Color3f
        shader.CreateInput(key, _TYPES.get(type(value), pair)).Set(value)
    for output in ("surface", "displacement", "volume"):
        material.CreateOutput(f"mdl:{output}", Sdf.ValueTypeNames.Token).ConnectToSource(shader.ConnectableAPI(), "out")
    bind(quad(made), material)
    return saved(made)


def paint(folder: Path, **inputs: Any) -> pica.Material:
    return node(load(path_of(folder, **inputs)), "quad").mesh.sections[0].material


def test_constants_and_defaults(tmp_path: Path) -> None:
    default = paint(tmp_path)
    np.testing.assert_allclose(default.base_color, (0.2, 0.2, 0.2, 1), atol=1e-6)
    assert (default.roughness, default.metallic, default.specular) == (0.5, 0, 1)
    inputs = {"diffuse_color_constant": (0.2, 0.4, 0.8), "diffuse_tint": (1.0, 0.5, 1.0), "specular_level": 0.25}
    given = paint(tmp_path, reflection_roughness_constant=0.25, metallic_constant=1.0, **inputs)
    np.testing.assert_allclose(given.base_color, (0.2, 0.2, 0.8, 1), atol=1e-6)
    assert (given.roughness, given.metallic, given.specular) == (0.25, 1, 0.5)


def test_textures(tmp_path: Path) -> None:
    shown = paint(
        tmp_path,
        diffuse_texture="a.png",
        enable_ORM_texture=True,
        ORM_texture="a.png",
        reflection_roughness_texture_influence=0.5,
        reflection_roughness_constant=1.0,
        metallic_texture_influence=1.0,
        normalmap_texture="a.png",
        bump_factor=0.75,
        texture_scale=(2.0, 3.0),
    )
    assert shown.base_color_texture.image.pixels[0, 0].tolist() == [200, 100, 50, 255]
    _, roughness, metallic = shown.metallic_roughness_texture.image.pixels[0, 0, :3].tolist()
    assert (roughness, metallic) == (round(0.5 * 100 + 0.5 * 255), 50)
    assert shown.occlusion_texture is not None and shown.normal_scale == pytest.approx(0.75)
    np.testing.assert_allclose(shown.base_color_texture.transform, (2, 0, 0, 0, 3, -2), atol=1e-6)
    without = paint(tmp_path, reflectionroughness_texture="a.png")  # whose influence is 0 by default
    assert without.metallic_roughness_texture is None and without.roughness == 0.5


def test_emission_and_opacity(tmp_path: Path) -> None:
    shining = paint(tmp_path, enable_emission=True, emissive_color=(1.0, 0.5, 0.0), emissive_intensity=100.0)
    np.testing.assert_allclose(shining.emission, (100, 50, 0), rtol=1e-5)
    assert paint(tmp_path, emissive_color=(1.0, 0.5, 0.0)).emission == (0, 0, 0)
    faint = paint(tmp_path, enable_opacity=True, opacity_constant=0.25)
    assert faint.base_color[3] == 0.25 and faint.alpha_mode is pica.AlphaMode.BLEND
    cut = paint(
        tmp_path, enable_opacity=True, enable_opacity_texture=True, opacity_texture="a.png", opacity_threshold=0.5
    )
    assert cut.alpha_mode is pica.AlphaMode.MASK and cut.base_color_texture.image.pixels[0, 0, 3] == 200


def test_another_material_of_mdl_is_told(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="its shader 'OmniGlass' is not read; the material is white"):
        pica.load(path_of(tmp_path, "OmniGlass"), environment=SKY)
