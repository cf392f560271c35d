"""A scene that was saved and loaded again looks the same."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import pica
from pica.quality import flip
from pica.rhi.device import Device
from tests.assets import ASSETS

SIZE = (64, 36)
MOST = 0.001


def fox() -> pica.Scene:
    path = ASSETS / "Fox" / "Fox.glb"
    if not path.exists():
        pytest.skip("test assets are not there")
    return pica.load(path, environment=pica.Environment(np.ones((2, 4, 3))))


SCENES = {
    "cornell": pica.scenes.cornell,
    "sphere_grid": pica.scenes.sphere_grid,
    "corridor": pica.scenes.corridor,
    "fox": fox,
}


def picture(scene: pica.Scene, device: Device) -> np.ndarray:
    return pica.Renderer(scene, size=SIZE, device=device).render(4).display / np.float32(255)


@pytest.mark.parametrize("name", SCENES)
def test_pictures_before_and_after(name: str, device: Device, tmp_path: Path) -> None:
    scene = SCENES[name]()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.save(tmp_path / "scene.glb")
        loaded = pica.load(tmp_path / "scene.glb")
    for each in (scene, loaded):
        each.animate(0.3)
    before, after = picture(scene, device), picture(loaded, device)
    assert before.std() > 0.01
    assert flip(before, after)[0] <= MOST
