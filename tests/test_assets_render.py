"""Every asset in the shared folder renders."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from tests.assets import ASSETS, needs_assets

pytestmark = needs_assets

SIZE = (160, 90)
FILES = sorted(
    path
    for path in ASSETS.rglob("*")
    if path.suffix in (".gltf", ".glb") and not path.relative_to(ASSETS).parts[0].startswith("invalid_")
)


def loaded(path: Path) -> pica.Scene:
    """The scene, or a skip where the loader says that the file requires what is not supported."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return pica.load(path)
        except SceneError as error:
            if "extension" not in str(error):
                raise
            pytest.skip(str(error))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ASSETS)))
def test_asset_renders(device, path):
    scene = loaded(path)
    frame = pica.Renderer(scene, SIZE, device=device).render(2)
    assert np.isfinite(frame.color).all() and frame.color.min() >= 0
    if scene.triangle_count() or scene.environment is not None:
        assert frame.color.max() > 0 and frame.display.max() > 0


def test_most_assets_can_be_loaded():
    """The skips above are few: a loader that refuses everything does not pass."""
    refused = 0
    for path in FILES:
        try:
            loaded(path)
        except pytest.skip.Exception:
            refused += 1
    assert len(FILES) >= 50 and refused <= 10


@pytest.mark.parametrize("name", ["FlightHelmet/FlightHelmet.gltf", "playcanvas/chess-board/chess-board.glb"])
def test_asset_is_path_traced(device, name):
    frame = pica.PathTracer(loaded(ASSETS / name), SIZE, device=device).render(2)
    assert np.isfinite(frame.color).all() and frame.color.mean() > 0
