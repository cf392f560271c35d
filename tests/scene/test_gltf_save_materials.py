"""Scene.save: materials, and the pictures of their textures."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from pica.scene.anisotropy import Anisotropy
from pica.scene.coat import Coat
from pica.scene.iridescence import Iridescence
from pica.scene.loading import load
from pica.scene.material import AlphaMode, Image, Material, Sampler, Texture, Wrap
from pica.scene.mesh import Mesh
from pica.scene.node import Node
from pica.scene.sheen import Sheen
from tests.scene.saved_scenes import check_node, content, saved, shown, triangle


def textures() -> dict[str, Texture]:
    names = [name for name in vars(Material) if name.endswith("_texture")]
    made = {}
    for number, name in enumerate(names):
        pixels = np.full((2, 2, 4), number + 1, np.uint8)
        made[name] = Texture(Image(pixels, name), uv_set=number % 2)
    return made


MATERIALS = {
    "all at once": lambda: Material(
        "all", base_color=(0.1, 0.2, 0.3, 0.4), metallic=0.3, roughness=0.7, emission=(3.3, 0.1, 700.1),
        normal_scale=-0.3,
        occlusion_strength=0.4, alpha_mode=AlphaMode.MASK, alpha_cutoff=0.3, double_sided=True, ior=1.7, specular=0.3,
        specular_color=(1.1, 2.2, 0.3), transmission=0.9, thin_walled=False, absorption=(0.1, 2.3, 0.7), dispersion=0.6,
        diffuse_transmission=0.35, diffuse_transmission_color=(0.1, 0.5, 0.9), scattering=(0.0, 12.3, 1.7),
        scatter_anisotropy=-0.3, coats=[Coat(0.3, 0.1, air_below=True)], coat_normal_scale=0.7,
        iridescence=Iridescence(0.7, 1.4, 120.0, 410.0), anisotropy=Anisotropy(0.7, 0.3),
        sheen=Sheen((0.1, 0.2, 0.9), 0.3), extras={"class": "glass"}, **textures(),
    ),
    "as it is": Material,
    "dark emission": lambda: Material(emission=(0.1, 0.7, 1.0)),
    "blended": lambda: Material(alpha_mode=AlphaMode.BLEND, base_color=(1.0, 1.0, 1.0, 0.3), ior=0.0),
    "unlit": lambda: Material(unlit=True, metallic=0.0),
    "three coats": lambda: Material(
        coats=[Coat(0.0, 0.1), Coat(0.5, 0.3, 1.33, (1.0, 2.0, 3.3), 0.001), Coat()],
        coat_texture=textures()["coat_texture"]
    ),
    "coat with the ior of others": lambda: Material(coats=[Coat(1.0, 0.2)]),
    "absorbing pane": lambda: Material(transmission=1.0, absorption=(0.0, 0.3, 0.0), scattering=(0.1, 0.0, 0.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", MATERIALS)
def test_materials(name: str, tmp_path: Path) -> None:
    section = triangle(MATERIALS[name](), normals=[[0, 0, 1]] * 3)
    check_node(Node(mesh=Mesh([section, triangle()])), tmp_path)


def test_other_programs_see_the_same_medium(tmp_path: Path) -> None:
    """The colours of the extensions, without the extras, which only pica reads."""
    material = Material(transmission=1.0, thin_walled=False, absorption=(0.1, 0.0, 2.0), scattering=(0.3, 5.0, 0.0))
    path = tmp_path / "model.gltf"
    shown(Node(mesh=Mesh([triangle(material)]))).save(path)
    root = json.loads(path.read_text())
    del root["materials"][0]["extras"]
    path.write_text(json.dumps(root))
    mesh = load(path).roots[1].mesh
    assert mesh is not None
    loaded = mesh.sections[0].material
    np.testing.assert_allclose(loaded.absorption, material.absorption, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(loaded.scattering, material.scattering, rtol=1e-3, atol=1e-3)


def test_every_texture_of_a_material_is_compared() -> None:
    assert len(textures()) == 18


TEXTURES = {
    "sampler": {"sampler": Sampler(Wrap.CLAMP_TO_EDGE, Wrap.MIRRORED_REPEAT, linear=False)},
    "shift and scale": {"transform": (2.0, 0.0, 0.1, 0.0, -0.3, 0.7)},
    "turn": {"transform": (math.cos(0.3), math.sin(0.3), 0.0, -math.sin(0.3), math.cos(0.3), 0.0)},
    "shear": {"transform": (1.0, 0.3, 0.0, 0.2, 1.5, 0.1), "uv_set": 1},
}


@pytest.mark.parametrize("name", TEXTURES)
def test_uses_of_textures(name: str, tmp_path: Path) -> None:
    image = Image(np.arange(16, dtype=np.uint8).reshape(2, 2, 4), "tiny")
    material = Material(base_color_texture=Texture(image), emissive_texture=Texture(image, **TEXTURES[name]))
    loaded = check_node(Node(mesh=Mesh([triangle(material)])), tmp_path).mesh
    assert loaded is not None
    kept = loaded.sections[0].material
    assert kept.base_color_texture is not None and kept.emissive_texture is not None
    assert kept.base_color_texture.image is kept.emissive_texture.image


def test_texture_transforms_are_those_of_the_extension(tmp_path: Path) -> None:
    turn = (2 * math.cos(0.3), -3 * math.sin(0.3), 0.0, -2 * math.sin(0.3), -3 * math.cos(0.3), 0.0)
    material = Material(base_color_texture=Texture(Image(np.zeros((1, 1, 4), np.uint8)), transform=turn))
    shown(Node(mesh=Mesh([triangle(material)]))).save(tmp_path / "model.gltf")
    root = json.loads((tmp_path / "model.gltf").read_text())
    info = root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    assert info["extensions"]["KHR_texture_transform"]["rotation"] == pytest.approx(0.3)
    assert info["extensions"]["KHR_texture_transform"]["scale"] == pytest.approx([2, -3])
    assert "KHR_texture_transform" in root["extensionsUsed"]


def test_pictures_are_written_once_and_encodings_kept(tmp_path: Path) -> None:
    pixels = np.full((2, 2, 4), 200, np.uint8)
    images = [Image(pixels), Image(pixels.copy()), Image(pixels, encoding="linear")]
    sections = [triangle(Material(base_color_texture=Texture(image))) for image in images]
    loaded = saved(shown(Node(mesh=Mesh(sections))), tmp_path, ".gltf").roots[1].mesh
    assert loaded is not None
    kept = [section.material.base_color_texture for section in loaded.sections]
    assert [texture.image.encoding for texture in kept if texture] == [None, None, "linear"]
    assert sum(name.endswith(".png") for name in content(tmp_path / "first")) == 2
