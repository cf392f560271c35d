"""KHR_materials_pbrSpecularGlossiness becomes metallic-roughness."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Picture

from pica.color import srgb_encode
from pica.scene.gltf.specular_glossiness import converted
from pica.scene.gltf.texture_places import SPECULAR_GLOSSINESS as EXTENSION
from pica.scene.material import Material
from tests.scene.test_gltf_materials import file_with, material_of


def material(folder: Path, pictures: list[NDArray[np.uint8]] | None = None, **values: Any) -> Material:
    file = file_with(
        {"pbrMetallicRoughness": {"metallicFactor": "unread"}, "extensions": {EXTENSION: values}}, EXTENSION
    )
    for pixels in pictures or []:
        stream = io.BytesIO()
        Picture.fromarray(pixels).save(stream, "PNG")
        file.add("textures", source=file.add("images", bufferView=file.view(stream.getvalue())))
    return material_of(file, folder)


def test_a_metal(tmp_path: Path) -> None:
    gold = material(tmp_path, diffuseFactor=[0, 0, 0, 1], specularFactor=[1, 0.766, 0.336], glossinessFactor=0.9)
    assert gold.metallic == pytest.approx(1, abs=1e-4) and gold.roughness == pytest.approx(0.1)
    np.testing.assert_allclose(gold.base_color, [1, 0.766, 0.336, 1], atol=1e-4)


def test_a_dielectric(tmp_path: Path) -> None:
    plastic = material(tmp_path, diffuseFactor=[0.5, 0.25, 0.1, 0.7], specularFactor=[0.04] * 3, glossinessFactor=0.25)
    assert plastic.metallic == pytest.approx(0, abs=1e-4) and plastic.roughness == pytest.approx(0.75)
    np.testing.assert_allclose(plastic.base_color, [0.5, 0.25, 0.1, 0.7], atol=1e-4)


def test_energy_is_left_to_the_brightest_channel(tmp_path: Path) -> None:
    tinted = material(tmp_path, diffuseFactor=[0.5, 0.25, 0.1, 1], specularFactor=[0.04, 0.02, 0], glossinessFactor=1)
    assert tinted.metallic == 0 and tinted.roughness == 0
    np.testing.assert_allclose(tinted.base_color, [0.5, 0.25, 0.1, 1], atol=1e-5)


def test_defaults_are_those_of_the_extension(tmp_path: Path) -> None:
    white = material(tmp_path)
    np.testing.assert_allclose([white.metallic, white.roughness], [1, 0], atol=1e-5)
    np.testing.assert_allclose(white.base_color, [1, 1, 1, 1], atol=1e-4)


def test_the_conversion_goes_both_ways() -> None:
    random = np.random.default_rng(3)
    grey = random.uniform(0.1, 1, (50, 1)).astype(np.float32)  # the brightness of both colours is exact for greys
    base, metallic = np.repeat(grey, 3, 1), random.uniform(0, 1, 50).astype(np.float32)
    specular = 0.04 + (base - 0.04) * metallic[:, None]
    rest = np.maximum(1 - specular.max(axis=1, keepdims=True), 1e-6)
    diffuse = base * 0.96 * (1 - metallic[:, None]) / rest
    color, solved = converted(diffuse.astype(np.float32), specular.astype(np.float32))
    np.testing.assert_allclose(solved, metallic, atol=2e-3)
    np.testing.assert_allclose(color, base, atol=2e-3)


def encoded(color: list[float]) -> NDArray[np.uint8]:
    return np.rint(srgb_encode(np.array(color)) * 255).astype(np.uint8)


def test_textures_of_different_sizes(tmp_path: Path) -> None:
    diffuse = np.zeros((2, 2, 4), np.uint8)
    diffuse[..., :3], diffuse[..., 3] = encoded([0.4, 0.2, 0.1]), [[10, 20], [30, 40]]
    shiny = np.zeros((1, 4, 4), np.uint8)
    shiny[..., :3], shiny[..., 3] = encoded([0.04] * 3), [255, 255, 0, 51]
    shiny[0, 3, :3] = 255
    made = material(
        tmp_path, [diffuse, shiny], diffuseTexture={"index": 0}, specularGlossinessTexture={"index": 1},
        diffuseFactor=[1, 1, 1, 0.5], glossinessFactor=0.5,
    )  # fmt: skip
    assert (made.base_color, made.metallic, made.roughness) == ((1, 1, 1, 0.5), 1, 1)
    assert made.base_color_texture is not None and made.metallic_roughness_texture is not None
    base, packed = made.base_color_texture.image.pixels, made.metallic_roughness_texture.image.pixels
    assert base.shape == packed.shape == (2, 4, 4)
    np.testing.assert_array_equal(base[..., 3], [[10, 10, 20, 20], [30, 30, 40, 40]])
    np.testing.assert_allclose(base[0, 0, :3], diffuse[0, 0, :3], atol=2)
    np.testing.assert_array_equal(base[0, 3, :3], [255, 255, 255])
    np.testing.assert_array_equal(packed[0, :, 1], [128, 128, 255, 230])  # 1 - glossiness
    np.testing.assert_allclose(packed[0, :, 2], [0, 0, 0, 255], atol=4)


def test_one_texture_is_enough(tmp_path: Path) -> None:
    diffuse = np.full((2, 2, 3), 188, np.uint8)
    made = material(tmp_path, [diffuse], diffuseTexture={"index": 0}, specularFactor=[0, 0, 0], glossinessFactor=0)
    assert made.base_color_texture is not None and made.metallic_roughness_texture is not None
    expected = 255 * srgb_encode(np.array(0.503 / 0.96))
    np.testing.assert_allclose(made.base_color_texture.image.pixels[..., :3], expected, atol=1)
    np.testing.assert_array_equal(made.metallic_roughness_texture.image.pixels[0, 0], [255, 255, 0, 255])


def test_another_placing_is_said(tmp_path: Path) -> None:
    grey = np.full((2, 2, 3), 100, np.uint8)
    moved = {"index": 1, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}}
    with pytest.warns(UserWarning, match=r"specularGlossinessTexture: placed as the diffuse texture is"):
        material(tmp_path, [grey, grey], diffuseTexture={"index": 0}, specularGlossinessTexture=moved)
