"""Large pictures of glTF files are decoded in threads."""

import threading
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.images.pictures import Admit, encoded_png, open_texture
from pica.scene.gltf import pictures, read
from pica.scene.limits import Budget, Limits
from pica.scene.load_progress import REPORTS
from pica.scene.model import Scene
from tests.images import ktx2_pictures
from tests.scene.gltf_files import GltfFile


def noise(seed: int) -> NDArray[np.uint8]:
    """Pixels that compress to more than 64 KB."""
    return np.random.default_rng(seed).integers(0, 255, (160, 160, 4), np.uint8)


def textured(*contents: bytes) -> GltfFile:
    """A file with a mesh and a material for each picture."""
    file = GltfFile()
    for content in contents:
        texture = file.add("textures", source=file.add("images", bufferView=file.view(content)))
        file.mesh(material=file.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": texture}}))
    return file


def images(scene: Scene) -> list[NDArray[np.uint8]]:
    meshes = [node.mesh for node in scene.nodes() if node.mesh is not None]
    textures = [mesh.sections[0].material.base_color_texture for mesh in meshes]
    return [texture.image.pixels for texture in textures if texture is not None]


def test_large_pictures_are_decoded_once_in_other_threads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    threads: list[str] = []

    def recording(content: bytes, label: str, admit: Admit) -> Callable[[], object]:
        decode = open_texture(content, label, admit)

        def recorded() -> object:
            threads.append(threading.current_thread().name)
            return decode()

        return recorded

    monkeypatch.setattr(pictures, "open_texture", recording)
    small = np.full((4, 4, 4), 9, np.uint8)
    contents = [encoded_png(pixels) for pixels in (noise(1), noise(2), noise(1), small)]
    reported: list[tuple[int, int]] = []
    with REPORTS.to(lambda done, total: reported.append((done, total))):
        scene = read(textured(*contents).write(tmp_path))
    for loaded, pixels in zip(images(scene), (noise(1), noise(2), noise(1), small), strict=True):
        np.testing.assert_array_equal(loaded, pixels)
    assert len(threads) == 3 and sum(name.startswith("pica-pictures") for name in threads) == 2
    assert sorted(reported) == [(1, 2), (2, 2)]
    assert not any(thread.name.startswith("pica-pictures") for thread in threading.enumerate())


def test_a_broken_picture_is_named_and_no_thread_stays(tmp_path: Path) -> None:
    content = encoded_png(noise(2))
    file = textured(encoded_png(noise(1)), content[:80_000] + b"x" * (len(content) - 80_000))
    with pytest.raises(SceneError, match=r"model.gltf: images\[1\]: not a readable picture"):
        read(file.write(tmp_path))
    assert not any(thread.name.startswith("pica-pictures") for thread in threading.enumerate())


def test_limits_hold_in_threads(tmp_path: Path) -> None:
    path = textured(encoded_png(noise(1)), encoded_png(noise(2))).write(tmp_path)
    with pytest.raises(SceneError, match=r"images\[1\]: would take 25,600 pixels, 51,200 pixels with all before"):
        read(path, Budget(Limits(pixels=40_000)))


def test_a_format_that_cannot_be_read_gives_way_to_the_other_picture(tmp_path: Path) -> None:
    file = textured(encoded_png(noise(1)), encoded_png(noise(2)))
    unread = ktx2_pictures.plain(noise(3), ktx2_pictures.BC5)
    source = file.add("images", bufferView=file.view(unread))
    file.json["textures"][1]["extensions"] = {"KHR_texture_basisu": {"source": source}}
    with pytest.warns(UserWarning, match=r"images\[2\]: KTX 2 of format 141 .*; left out"):
        scene = read(file.write(tmp_path))
    np.testing.assert_array_equal(images(scene)[1], noise(2))


def test_pictures_that_no_material_uses_are_not_read(tmp_path: Path) -> None:
    file = textured(encoded_png(noise(1)), encoded_png(noise(2)))
    for _ in range(2):
        file.add("textures", source=file.add("images", bufferView=file.view(b"broken" * 20_000)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(images(read(file.write(tmp_path)))) == 2
