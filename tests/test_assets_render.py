"""Every asset in the shared folder renders."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import pica
from pica.scene.gltf.container import Document
from pica.scene.gltf.extensions import unsupported
from tests.assets import ASSETS, needs_assets

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


def test_most_assets_can_be_rendered():
    """A loader that supports nothing does not pass."""
    assert len(FILES) >= 50 and len(RENDERABLE) >= len(FILES) - 10


@pytest.mark.parametrize("name", ["FlightHelmet/FlightHelmet.gltf", "DepthOfFieldExample/DepthOfFieldExample.glb"])
def test_asset_is_path_traced(device, name):
    frame = pica.PathTracer(loaded(ASSETS / name), size=SIZE, device=device).render(2)
    assert np.isfinite(frame.color).all() and frame.color.mean() > 0
