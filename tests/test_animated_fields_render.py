"""Pictures follow animations of KHR_animation_pointer: colours, transforms of textures, lights, visibility."""

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pica
from pica.images.pictures import encoded_png
from pica.rhi.device import Device
from tests.scene.gltf_files import GltfFile
from tests.scene.test_gltf_pointers import animate

SIZE = (96, 54)
QUAD = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
LIGHTS, VISIBILITY = "KHR_lights_punctual", "KHR_node_visibility"


def four_quads() -> GltfFile:
    """From left to right: red becomes blue, black shines, stripes are shifted by one, and a quad goes."""
    file = GltfFile()
    stripes = np.zeros((1, 2, 4), np.uint8)
    stripes[:, 0], stripes[:, 1] = (255, 255, 255, 255), (0, 0, 0, 255)
    positions, indices = file.accessor(QUAD), file.accessor([0, 1, 2, 0, 2, 3], "u2")
    coordinates = file.accessor([[0, 1], [1, 1], [1, 0], [0, 0]])
    shape = {"positions": positions, "indices": indices, "attributes": {"TEXCOORD_0": coordinates}}
    file.add("samplers", magFilter=9728, minFilter=9728)
    file.add("textures", source=0, sampler=0)
    file.add("images", bufferView=file.view(encoded_png(stripes)), mimeType="image/png")
    file.add("materials", pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 1], "metallicFactor": 0})
    file.add("materials", pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0})
    file.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": 0}, "metallicFactor": 0})
    file.add("materials", pbrMetallicRoughness={"metallicFactor": 0})
    for row in range(4):
        file.mesh(material=row, node={"translation": [2.5 * row - 3.75, 0, 0]}, **dict(shape))
    file.json["extensions"] = {LIGHTS: {"lights": [{"type": "directional", "intensity": 3}]}}
    file.add("nodes", extensions={LIGHTS: {"light": 0}})
    camera = file.add("cameras", type="perspective", perspective={"yfov": 0.6, "znear": 0.1})
    file.add("nodes", camera=camera, translation=[0, 0, 10])
    transform = "extensions/KHR_texture_transform"
    animate(file, "/materials/0/pbrMetallicRoughness/baseColorFactor", [[1, 0, 0, 1], [0, 0, 1, 1]])
    animate(file, "/materials/1/emissiveFactor", [[0, 0, 0], [0, 1, 0]])
    animate(file, f"/materials/2/pbrMetallicRoughness/baseColorTexture/{transform}/offset", [[0, 0], [0.5, 0]])
    animate(file, f"/nodes/3/extensions/{VISIBILITY}/visible", [1, 0], interpolation="STEP", dtype="u1")
    return file


def quads(picture: NDArray[np.uint8]) -> list[NDArray[np.float64]]:
    """(3,) the mean colour in the left half of each quad."""
    height, width, _ = picture.shape
    scale = height / 2 / (10 * np.tan(0.3))
    centres = [width / 2 + scale * (2.5 * row - 3.75 - 0.5) for row in range(4)]
    rows = slice(height // 2 - 4, height // 2 + 4)
    return [picture[rows, int(centre) - 1 : int(centre) + 2].reshape(-1, 3).mean(0) for centre in centres]


def test_pictures_of_two_times(device: Device, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = pica.load(four_quads().write(tmp_path), environment=pica.Environment(np.full((2, 4, 3), 0.5)))
    renderer = pica.Renderer(scene, size=SIZE, device=device)
    scene.animate(0)
    first = renderer.render(8).display
    scene.animate(1)
    second = renderer.render(16).display
    before, after = quads(first), quads(second)
    assert before[0][0] > 60 + before[0][2] and after[0][2] > 60 + after[0][0]
    assert before[1].max() < 60 < after[1][1]
    assert before[2].min() > 60 + after[2].max()
    assert before[3].min() > 60 + after[3].max()
