"""A cube and a sphere look the same from each format as from glTF."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import pica
from pica.quality import flip
from pica.rhi.device import Device
from tests.scene import mesh_files

SIZE = (64, 36)
MOST = 0.01
SKY = pica.Environment(np.ones((2, 4, 3)) * (0.2, 0.3, 0.4))


def picture(scene: pica.Scene, device: Device) -> np.ndarray:
    sun = pica.Node("sun", light=pica.DirectionalLight(illuminance=2.0))
    sun.transform = pica.Camera.look_at((2, 3, 1), (0, 0, 0)).transform
    scene.add(sun)
    camera = pica.Camera.look_at((1.2, 1.4, 2.2), (0, 0.1, 0))
    return pica.Renderer(scene, size=SIZE, device=device).render(4, camera=camera).display / np.float32(255)


def of_gltf(shape: mesh_files.Shape, folder: Path, smooth: bool, roughness: float) -> pica.Scene:
    scene = pica.Scene("same", environment=SKY)
    normals = shape.normals if smooth else None
    material = pica.Material(metallic=0.0, roughness=roughness, double_sided=True)
    mesh = pica.Mesh.from_arrays(
        shape.positions, shape.triangles, normals=normals, smooth=smooth, uv=shape.uv, material=material
    )
    scene.add(pica.Node("shape", mesh=mesh))
    scene.save(folder / "same.glb")
    return pica.load(folder / "same.glb")


@pytest.mark.parametrize("name", ["a.obj", "a.ply", "a.stl", "a.3mf", "a.dae"])
@pytest.mark.parametrize("shape", [mesh_files.cube, mesh_files.sphere])
def test_formats_look_the_same(name: str, shape, device: Device, tmp_path: Path) -> None:
    made = shape()
    has_normals = name not in ("a.stl", "a.3mf")
    path = mesh_files.write(tmp_path, name, made)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loaded = pica.load(path, up="y", environment=SKY)
    ((section,),) = [node.mesh.sections for node in loaded.nodes() if node.mesh]
    expected = picture(of_gltf(made, tmp_path, has_normals, section.material.roughness), device)
    assert expected.std() > 0.05
    assert flip(expected, picture(loaded, device))[0] <= MOST
