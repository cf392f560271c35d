import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Picture

from pica.errors import SceneError
from pica.scene.anisotropy import Anisotropy
from pica.scene.coat import Coat
from pica.scene.gltf import read
from pica.scene.gltf.element import Element
from pica.scene.gltf.textures import _matrix
from pica.scene.iridescence import Iridescence
from pica.scene.material import AlphaMode, Material, Wrap
from pica.scene.sheen import Sheen
from tests.images.ktx2_pictures import BC5, RAMP, basis, plain
from tests.scene.gltf_files import GltfFile


def picture(kind: str = "PNG", color: tuple[int, ...] = (255, 0, 0)) -> bytes:
    stream = io.BytesIO()
    Picture.new("RGB" if len(color) == 3 else "RGBA", (4, 2), color).save(stream, kind, lossless=True)
    return stream.getvalue()


def file_with(material: dict[str, Any], *names: str) -> GltfFile:
    file = GltfFile()
    file.json |= {"extensionsUsed": list(names), "extensionsRequired": list(names)} if names else {}
    file.mesh(material=file.add("materials", **material))
    return file


def material_of(file: GltfFile, folder: Path) -> Material:
    (node,) = read(file.write(folder)).nodes()
    assert node.mesh is not None
    return node.mesh.sections[0].material


def textured(folder: Path, **texture: Any) -> Material:
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **texture}}})
    file.add("images", bufferView=file.view(picture()), mimeType="image/png")
    file.add("textures", source=0)
    return material_of(file, folder)


def test_defaults_are_those_of_gltf(tmp_path: Path) -> None:
    material = material_of(file_with({}), tmp_path)
    assert material.base_color == (1, 1, 1, 1)
    assert (material.metallic, material.roughness, material.emission) == (1, 1, (0, 0, 0))
    assert (material.alpha_mode, material.alpha_cutoff, material.double_sided) == (AlphaMode.OPAQUE, 0.5, False)
    assert (material.ior, material.specular, material.specular_color, material.unlit) == (1.5, 1, (1, 1, 1), False)


def test_every_factor(tmp_path: Path) -> None:
    description = {
        "name": "paint",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0, "roughnessFactor": 0.25,
        },
        "emissiveFactor": [0.5, 1, 0], "alphaMode": "MASK", "alphaCutoff": 0.7, "doubleSided": True,
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 20},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_specular": {"specularFactor": 0, "specularColorFactor": [1, 0.5, 2]},
            "KHR_materials_transmission": {"transmissionFactor": 0.75},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.6, "clearcoatRoughnessFactor": 0.3},
            "KHR_materials_anisotropy": {"anisotropyStrength": 0.4, "anisotropyRotation": 0.3},
            "KHR_materials_iridescence": {
                "iridescenceFactor": 0.9, "iridescenceIor": 1.7, "iridescenceThicknessMinimum": 300,
                "iridescenceThicknessMaximum": 200,
            },
            "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 0], "sheenRoughnessFactor": 0.8},
            "KHR_materials_unlit": {},
        },
    }  # fmt: skip
    material = material_of(file_with(description, *description["extensions"]), tmp_path)
    assert material.name == "paint"
    assert material.base_color == (0.1, 0.2, 0.3, 0.4)
    assert (material.metallic, material.roughness, material.emission) == (0, 0.25, (10, 20, 0))
    assert (material.alpha_mode, material.alpha_cutoff, material.double_sided) == (AlphaMode.MASK, 0.7, True)
    assert (material.ior, material.specular, material.specular_color) == (1.33, 0, (1, 0.5, 2))
    assert (material.transmission, material.thin_walled, material.unlit) == (0.75, True, True)
    assert material.coats == (Coat(strength=0.6, roughness=0.3, ior=1.5, air_below=True),)
    assert material.anisotropy == Anisotropy(0.4, 0.3)
    assert material.iridescence == Iridescence(0.9, 1.7, 300.0, 200.0)
    assert material.sheen == Sheen((0.5, 0.25, 0), 0.8)


def test_a_clearcoat_of_no_strength_is_none(tmp_path: Path) -> None:
    clearcoat = {"clearcoatRoughnessFactor": 0.3, "clearcoatTexture": {"index": 0}}
    file = file_with({"extensions": {"KHR_materials_clearcoat": clearcoat}})
    file.add("textures", source=file.add("images", bufferView=file.view(picture()), mimeType="image/png"))
    material = material_of(file, tmp_path)
    assert material.coats == () and material.coat_texture is None


def test_a_sheen_without_colour_is_none(tmp_path: Path) -> None:
    sheen = {"sheenRoughnessFactor": 0.3}
    assert material_of(file_with({"extensions": {"KHR_materials_sheen": sheen}}), tmp_path).sheen is None


@pytest.mark.parametrize(("thickness", "thin"), [(0, True), (0.25, False)])
def test_a_thickness_makes_a_solid(tmp_path: Path, thickness: float, thin: bool) -> None:
    volume = {"KHR_materials_volume": {"thicknessFactor": thickness}}
    assert material_of(file_with({"extensions": volume}), tmp_path).thin_walled == thin


def test_every_texture(tmp_path: Path) -> None:
    infos = {name: {"index": i, "texCoord": i % 2} for i, name in enumerate("abcdefghijklmnop")}
    description = {
        "pbrMetallicRoughness": {"baseColorTexture": infos["a"], "metallicRoughnessTexture": infos["b"]},
        "normalTexture": infos["c"] | {"scale": 0.5},
        "occlusionTexture": infos["d"] | {"strength": 0.25},
        "emissiveTexture": infos["e"],
        "extensions": {
            "KHR_materials_specular": {"specularTexture": infos["f"], "specularColorTexture": infos["g"]},
            "KHR_materials_transmission": {"transmissionTexture": infos["h"]},
            "KHR_materials_clearcoat": {
                "clearcoatFactor": 1, "clearcoatTexture": infos["i"], "clearcoatRoughnessTexture": infos["j"],
                "clearcoatNormalTexture": infos["k"] | {"scale": 0.75},
            },
            "KHR_materials_iridescence": {
                "iridescenceFactor": 1, "iridescenceTexture": infos["l"], "iridescenceThicknessTexture": infos["m"],
            },
            "KHR_materials_anisotropy": {"anisotropyStrength": 1, "anisotropyTexture": infos["n"]},
            "KHR_materials_sheen": {
                "sheenColorFactor": [1, 0, 0], "sheenColorTexture": infos["o"], "sheenRoughnessTexture": infos["p"],
            },
        },
    }  # fmt: skip
    file = file_with(description, *description["extensions"])
    for i in range(len(infos)):
        file.add("images", bufferView=file.view(picture(color=(i, 0, 0))), mimeType="image/png")
        file.add("textures", source=i)
    material = material_of(file, tmp_path)
    textures = [
        material.base_color_texture, material.metallic_roughness_texture, material.normal_texture,
        material.occlusion_texture, material.emissive_texture, material.specular_texture,
        material.specular_color_texture, material.transmission_texture,
        material.coat_texture, material.coat_roughness_texture, material.coat_normal_texture,
        material.iridescence_texture, material.iridescence_thickness_texture, material.anisotropy_texture,
        material.sheen_color_texture, material.sheen_roughness_texture,
    ]  # fmt: skip
    assert [texture and texture.image.pixels[0, 0, 0] for texture in textures] == list(range(len(infos)))
    assert [texture and texture.uv_set for texture in textures] == [i % 2 for i in range(len(infos))]
    assert (material.normal_scale, material.occlusion_strength) == (0.5, 0.25)
    assert material.coat_normal_scale == 0.75


def test_sampler(tmp_path: Path) -> None:
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    file.add("images", bufferView=file.view(picture()), mimeType="image/png")
    file.add("textures", source=0, sampler=file.add("samplers", wrapS=33071, wrapT=33648, magFilter=9728))
    texture = material_of(file, tmp_path).base_color_texture
    assert texture is not None
    sampler = texture.sampler
    assert (sampler.wrap_u, sampler.wrap_v, sampler.linear) == (Wrap.CLAMP_TO_EDGE, Wrap.MIRRORED_REPEAT, False)


def transformed(uv: tuple[float, float], **transform: Any) -> np.ndarray:
    return np.array(_matrix(Element(transform))).reshape(2, 3) @ [*uv, 1]


def test_texture_transform_of_the_extensions_own_example() -> None:
    # "utilizes only the lower left quadrant of the source image, rotated clockwise 90 degrees"
    corners = np.array(
        [transformed(uv, offset=[0, 1], rotation=np.pi / 2, scale=[0.5, 0.5]) for uv in ((0, 0), (1, 1))]
    )
    np.testing.assert_allclose([corners.min(0), corners.max(0)], [[0, 0.5], [0.5, 1]], atol=1e-12)


def test_texture_transform_turns_as_khronos_test_shows() -> None:
    # TextureTransformTest marks where the arrow's tip at (0.7778, 0.7778) is seen when turned the right way
    seen = (-0.07904822439840126 + 0.5, 0.5 + 0.5162674857624154)
    np.testing.assert_allclose(transformed(seen, rotation=0.39269908169872414), [0.7778, 0.7778], atol=2e-3)


def test_texture_transform_scales_before_it_turns() -> None:
    np.testing.assert_allclose(transformed((1, 0), rotation=np.pi / 2, scale=[3, 5], offset=[10, 20]), [10, 17])


def test_texture_transform_may_choose_the_coordinates(tmp_path: Path) -> None:
    transform = {"KHR_texture_transform": {"offset": [0.5, 0], "texCoord": 1}}
    texture = textured(tmp_path, texCoord=0, extensions=transform).base_color_texture
    assert texture is not None
    assert texture.uv_set == 1
    assert texture.transform == (1, 0, 0.5, 0, 1, 0)


@pytest.mark.parametrize(("kind", "mime"), [("PNG", "image/png"), ("JPEG", "image/jpeg")])
def test_image_from_a_buffer_a_data_uri_and_a_file(kind: str, mime: str, tmp_path: Path) -> None:
    import base64

    content = picture(kind)
    (tmp_path / "my picture").write_bytes(content)
    file = file_with({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}},
        "emissiveTexture": {"index": 2},
    })  # fmt: skip
    file.add("images", bufferView=file.view(content), mimeType=mime)
    file.add("images", uri=f"data:{mime};base64," + base64.b64encode(content).decode())
    file.add("images", uri="./my%20picture")
    for i in range(3):
        file.add("textures", source=i)
    material = material_of(file, tmp_path)
    for texture in (material.base_color_texture, material.metallic_roughness_texture, material.emissive_texture):
        assert texture is not None
        assert texture.image.pixels.shape == (2, 4, 4)
        np.testing.assert_allclose(texture.image.pixels[0, 0], [255, 0, 0, 255], atol=2)


def test_webp_is_taken_before_its_fallback(tmp_path: Path) -> None:
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, "EXT_texture_webp")
    file.add("images", bufferView=file.view(picture("PNG", (255, 0, 0))), mimeType="image/png")
    file.add("images", bufferView=file.view(picture("WEBP", (0, 255, 0))), mimeType="image/webp")
    file.add("textures", source=0, extensions={"EXT_texture_webp": {"source": 1}})
    texture = material_of(file, tmp_path).base_color_texture
    assert texture is not None
    np.testing.assert_array_equal(texture.image.pixels[0, 0], [0, 255, 0, 255])


EXTENDED = {
    "KHR_texture_basisu": (basis("uastc"), (32, 32)),
    "EXT_texture_avif": (picture("AVIF", (0, 255, 0)), (2, 4)),
    "MSFT_texture_dds": (picture("DDS", (0, 255, 0)), (2, 4)),
}


@pytest.mark.parametrize("name", EXTENDED)
@pytest.mark.parametrize("fallback", [False, True])
def test_pictures_of_extensions(name: str, fallback: bool, tmp_path: Path) -> None:
    content, size = EXTENDED[name]
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, name)
    file.add("images", bufferView=file.view(content))
    file.add("images", bufferView=file.view(picture()), name="fallback")
    file.add("textures", extensions={name: {"source": 0}}, **({"source": 1} if fallback else {}))
    texture = material_of(file, tmp_path).base_color_texture
    assert texture is not None
    if fallback and name == "MSFT_texture_dds":
        assert texture.image.name == "fallback"
    else:
        assert texture.image.pixels.shape[:2] == size and texture.image.name != "fallback"


def test_basis_universal_comes_before_other_extensions(tmp_path: Path) -> None:
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    file.add("images", bufferView=file.view(basis("etc1s")))
    file.add("images", bufferView=file.view(picture("WEBP")))
    file.add("textures", extensions={"EXT_texture_webp": {"source": 1}, "KHR_texture_basisu": {"source": 0}})
    texture = material_of(file, tmp_path).base_color_texture
    assert texture is not None and texture.image.pixels.shape == (32, 32, 4)


OTHER_DDS = picture("DDS")[:80] + b"\4\0\0\0UYVY" + picture("DDS")[88:]


@pytest.mark.parametrize("content", [plain(RAMP, BC5), OTHER_DDS])
def test_pictures_that_cannot_be_read_are_left_out_with_a_warning(content: bytes, tmp_path: Path) -> None:
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    file.add("images", bufferView=file.view(content))
    file.add("textures", source=0)
    with pytest.warns(UserWarning, match=r"model.gltf: images\[0\]: .*cannot be read.*; left out$"):
        assert material_of(file, tmp_path).base_color_texture is None


def test_another_picture_takes_the_place_of_one_that_cannot_be_read(tmp_path: Path) -> None:
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    file.add("images", bufferView=file.view(plain(RAMP, BC5)))
    file.add("images", bufferView=file.view(picture()), name="fallback")
    file.add("textures", source=1, extensions={"KHR_texture_basisu": {"source": 0}})
    with pytest.warns(UserWarning, match=r"images\[0\]: .*cannot be read.*; left out$"):
        texture = material_of(file, tmp_path).base_color_texture
    assert texture is not None and texture.image.name == "fallback"


def test_a_texture_without_a_picture_is_left_out_with_a_warning(tmp_path: Path) -> None:
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    file.add("textures")
    with pytest.warns(UserWarning, match=r"model.gltf: textures\[0\]: left out, it has no picture"):
        assert material_of(file, tmp_path).base_color_texture is None


@pytest.mark.parametrize(
    ("image", "fault"),
    [
        ({"uri": "missing.png"}, r"images\[0\].uri: 'missing.png': no such file"),
        ({"uri": "broken.png"}, r"images\[0\].uri: 'broken.png': .*"),
        ({"uri": "/etc/passwd"}, "is not a path relative to the file"),
        ({"uri": "https://example.com/a.png"}, "is not a path relative to the file"),
        ({"uri": "data:image/png;base64,???"}, "broken base64"),
        ({}, r"images\[0\]: has neither a uri nor a buffer view"),
    ],
)
def test_unreadable_pictures_are_named(image: dict[str, Any], fault: str, tmp_path: Path) -> None:
    (tmp_path / "broken.png").write_bytes(picture()[:40])
    file = file_with({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    file.add("images", **image)
    file.add("textures", source=0)
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}") as caught:
        read(file.write(tmp_path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("material", "fault"),
    [
        ({"alphaMode": "GLASS"}, r"materials\[0\].alphaMode: 'GLASS' is not one of OPAQUE, MASK, BLEND"),
        ({"pbrMetallicRoughness": {"metallicFactor": 2}}, "metallicFactor: 2 is not a number from 0 to 1"),
        ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1]}}, "is not a list of 4 numbers"),
        ({"emissiveFactor": [0, -1, 0]}, r"emissiveFactor\[1\]: -1 is not a number of at least 0"),
        ({"extensions": {"KHR_materials_ior": {"ior": 0.5}}}, "ior: 0.5 is not a number of at least 1"),
        (
            {"extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 2}}},
            "anisotropyStrength: 2 is not a number",
        ),
        (
            {"extensions": {"KHR_materials_iridescence": {"iridescenceThicknessMaximum": -1}}},
            "KHR_materials_iridescence.iridescenceThicknessMaximum: -1 is not a number from 0 to 100000",
        ),
        (
            {"extensions": {"KHR_materials_sheen": {"sheenColorFactor": [0, 2, 0]}}},
            r"KHR_materials_sheen.sheenColorFactor\[1\]: 2 is not a number from 0 to 1",
        ),
        ({"normalTexture": {"index": 4}}, r"normalTexture.index: 4 is out of range"),
        ({"normalTexture": {"index": 0, "texCoord": "a"}}, "normalTexture.texCoord: 'a' is not a whole number"),
    ],
)
def test_faults_are_named(material: dict[str, Any], fault: str, tmp_path: Path) -> None:
    file = file_with(material)
    file.add("textures", source=file.add("images", bufferView=file.view(picture()), mimeType="image/png"))
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


def test_diffuse_transmission_and_scattering(tmp_path):
    """The attenuation coefficient is that of scattering and absorption together."""
    extensions = {
        "KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 0.8,
            "diffuseTransmissionColorFactor": [0.9, 0.5, 0.1],
        },
        "KHR_materials_volume": {
            "thicknessFactor": 1,
            "attenuationDistance": 0.1,
            "attenuationColor": [0.5, 0.5, 0.5],
        },
        "KHR_materials_volume_scatter": {"multiscatterColor": [0, 0.5, 1], "scatterAnisotropy": 0.3},
    }
    material = material_of(file_with({"extensions": extensions}), tmp_path)
    assert (material.diffuse_transmission, material.scatter_anisotropy) == (0.8, 0.3)
    assert material.diffuse_transmission_color == (0.9, 0.5, 0.1)
    extinction = np.array(material.absorption) + material.scattering
    np.testing.assert_allclose(extinction, np.log(2) / 0.1)
    single = np.array(material.scattering) / extinction
    assert single[0] == pytest.approx(0, abs=0.002)
    assert single[2] == pytest.approx(1, abs=0.002)
    # A half-space of that medium has the colour again (van de Hulst 1980).
    s = np.sqrt(1 - single[1])
    assert (1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s) == pytest.approx(0.5, abs=0.01)


def with_sets(*sets: int) -> GltfFile:
    """A triangle with eight sets of texture coordinates, all of which are their number; textures use the given ones."""
    infos = [{"index": 0, "texCoord": number} for number in sets]
    names = ["normalTexture", "occlusionTexture", "emissiveTexture"]
    file = file_with(dict(zip(names, infos, strict=False)))
    file.add("images", bufferView=file.view(picture()))
    file.add("textures", source=0)
    coordinates = {f"TEXCOORD_{number}": file.accessor([[number, number]] * 3) for number in range(8)}
    file.json["meshes"][0]["primitives"][0]["attributes"] |= coordinates
    return file


@pytest.mark.parametrize(
    ("sets", "numbers"), [((5, 5, 2), (2, 5)), ((0, 7), (0, 7)), ((6,), (0, 6)), ((1, 0, 1), (0, 1)), ((1,), (0, 1))]
)
def test_sets_of_texture_coordinates_have_any_number(
    sets: tuple[int, ...], numbers: tuple[int, int], tmp_path: Path
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = read(with_sets(*sets).write(tmp_path))
    section = next(node for node in scene.nodes() if node.mesh).mesh.sections[0]
    assert (section.uv0[0, 0], section.uv1[0, 0]) == numbers
    material = section.material
    textures = (material.normal_texture, material.occlusion_texture, material.emissive_texture)
    assert [numbers[texture.uv_set] for texture in textures if texture] == list(sets)


def test_a_third_set_of_a_material_is_told(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"Texture: left out, it uses TEXCOORD_7; of its material 3 and 5 are read$"):
        material = material_of(with_sets(5, 3, 7), tmp_path)
    assert material.normal_texture is not None and material.emissive_texture is None
