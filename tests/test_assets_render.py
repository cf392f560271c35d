"""Every asset in the shared folder renders."""

import io
import warnings
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import pica
from pica.quality import flip
from pica.scene.gltf.container import Document
from pica.scene.gltf.extensions import unsupported
from tests.assets import ASSETS, needs_assets
from tests.images.ktx2_pictures import RAMP, basis
from tests.scene.gltf_files import GltfFile

pytestmark = needs_assets

SIZE = (160, 90)
FILES = sorted(
    path
    for path in ASSETS.rglob("*")
    if path.suffix in (".gltf", ".glb") and not path.relative_to(ASSETS).parts[0].startswith("invalid_")
)


RENDERABLE = [path for path in FILES if not unsupported(Document(path).root.texts("extensionsRequired"))]
DARK = {"AnisotropyBarnLamp.gltf", "AnisotropyBarnLamp_png.gltf"}
"""Lit by a filament alone, in a bulb whose glass is opaque as long as transmission is not supported."""


def loaded(path: Path) -> pica.Scene:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pica.load(path)


def case(path: Path):
    """Programs with thin films, brushed metal and sheen take minutes to compile."""
    lobes = b"KHR_materials_anisotropy", b"KHR_materials_iridescence", b"KHR_materials_sheen"
    many_lobes = any(name in path.read_bytes() for name in lobes)
    marks = [pytest.mark.slow] if many_lobes else []
    return pytest.param(path, id=str(path.relative_to(ASSETS)), marks=marks)


@pytest.mark.parametrize("path", [case(path) for path in RENDERABLE])
def test_asset_renders(device, path):
    scene = loaded(path)
    frame = pica.Renderer(scene, size=SIZE, device=device).render(2)
    assert np.isfinite(frame.color).all() and frame.color.min() >= 0
    if path.name not in DARK and (scene.triangle_count() or scene.environment is not None):
        assert frame.color.max() > 0 and frame.display.max() > 0


def picture(scene: pica.Scene, device):
    return pica.Renderer(scene, size=SIZE, device=device).render(4).display / np.float32(255)


def test_a_compressed_mesh_looks_like_the_same_without(device):
    names = "Fox/Fox.glb", "Derived_compressed/Fox_meshopt.glb"
    plain, compressed = (picture(loaded(ASSETS / name), device) for name in names)
    assert flip(plain, compressed)[0] < 0.01


@pytest.mark.parametrize(("name", "most"), [("etc1s", 0.04), ("uastc", 0.03)])
def test_a_compressed_texture_looks_like_the_same_without(device, name, most, tmp_path):
    """A ramp of all colours on 8x8 blocks; the mirrored one is 0.24 away."""
    stream = io.BytesIO()
    PIL.Image.fromarray(RAMP[..., :3]).save(stream, "PNG")
    pictures = []
    for content in (stream.getvalue(), basis(name)):
        file = GltfFile()
        file.add("textures", source=file.add("images", bufferView=file.view(content)))
        file.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": 0}, "metallicFactor": 0})
        corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
        uvs = file.accessor([[x, 1 - y] for x, y, _ in corners])
        file.mesh(file.accessor(corners), attributes={"TEXCOORD_0": uvs}, mode=5, material=0)
        pictures.append(picture(loaded(file.write(tmp_path)), device))
    assert flip(*pictures)[0] < most


def test_most_assets_can_be_rendered():
    """A loader that supports nothing does not pass."""
    assert len(FILES) >= 50 and len(RENDERABLE) >= len(FILES) - 10


@pytest.mark.parametrize("name", ["FlightHelmet/FlightHelmet.gltf", "DepthOfFieldExample/DepthOfFieldExample.glb"])
def test_asset_is_path_traced(device, name):
    frame = pica.PathTracer(loaded(ASSETS / name), size=SIZE, device=device).render(2)
    assert np.isfinite(frame.color).all() and frame.color.mean() > 0
