import warnings
from pathlib import Path

import numpy as np
import pytest

from pica.errors import SceneError
from pica.images import pictures
from pica.scene.environment import Environment
from pica.scene.loading import default_environment, load, read_environment
from tests.assets import ASSETS, needs_assets
from tests.scene.gltf_files import GltfFile


def triangle(folder: Path, **node: object) -> Path:
    file = GltfFile()
    file.mesh(node=node)
    return file.write(folder)


def test_a_scene_without_light_gets_a_sky_and_says_so(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"model.gltf: has no light") as caught:
        scene = load(triangle(tmp_path))
    assert len(caught) == 1
    assert scene.environment is not None


def test_a_light_or_an_emissive_material_is_enough(tmp_path: Path) -> None:
    assert load(triangle(tmp_path, extras={"pica": {"light": {"type": "sphere"}}})).environment is None
    file = GltfFile()
    file.mesh(material=file.add("materials", emissiveFactor=[0, 1, 1]))
    assert load(file.write(tmp_path)).environment is None


@pytest.mark.parametrize("emission", [[0, 0, 0], [0.02, 0.02, 0.02], [0, 0, 0.1]])
def test_a_material_that_emits_a_little_does_not_take_the_sky_away(tmp_path: Path, emission: list[float]) -> None:
    file = GltfFile()
    file.mesh(material=file.add("materials", emissiveFactor=emission))
    with pytest.warns(UserWarning, match="so a neutral sky lights it") as caught:
        assert load(file.write(tmp_path)).environment is not None
    assert len(caught) == 1


def test_what_is_emitted_is_over_the_size_of_the_scene(tmp_path: Path) -> None:
    """A lamp that is enough for itself is not for a hall of a hundred times the size."""
    for size, lit_by_itself in ((1, True), (100, False)):
        file = GltfFile()
        lamp = file.mesh(material=file.add("materials", emissiveFactor=[1, 1, 1]), node={"scale": [2, 2, 2]})
        hall = file.mesh(node={"scale": [size] * 3})
        file.json |= {"scenes": [{"nodes": [lamp, hall]}], "scene": 0}
        with warnings.catch_warnings(record=True):
            assert (load(file.write(tmp_path)).environment is None) == lit_by_itself


def test_a_light_of_no_strength_is_none(tmp_path: Path) -> None:
    for light in ({"radiance": 0}, {"color": [0, 0, 0]}):
        with pytest.warns(UserWarning, match="has no light"):
            load(triangle(tmp_path, extras={"pica": {"light": {"type": "sphere", **light}}}))


def test_default_environment_is_one_nit_brightest_upper_right_front() -> None:
    radiance = default_environment().radiance
    assert radiance.shape == (128, 256, 3)
    rows, columns = np.indices(radiance.shape[:2]) + 0.5
    theta, phi = rows / 128 * np.pi, (columns / 256 - 0.5) * 2 * np.pi
    assert np.average(radiance[..., 0], weights=np.sin(theta)) == pytest.approx(1, abs=1e-4)
    brightest = np.unravel_index(radiance[..., 0].argmax(), radiance.shape[:2])
    assert np.cos(theta[brightest]) > 0.5 and np.sin(phi[brightest]) > 0.5 and np.cos(phi[brightest]) > 0.5


def test_an_environment_from_memory_is_kept(tmp_path: Path) -> None:
    sky = Environment(np.ones((2, 4, 3), np.float32))
    assert load(triangle(tmp_path), environment=sky).environment is sky


def test_a_file_with_z_up_is_turned_upright(tmp_path: Path) -> None:
    path = triangle(tmp_path, translation=[1, 2, 3])
    sky = Environment(np.ones((2, 4, 3), np.float32))
    as_it_is, upright = (load(path, environment=sky, up=up) for up in ("y", "z"))
    (node,) = (node for node in upright.nodes() if node.mesh)
    assert np.allclose(node.world[:3, 3], (1, 3, -2))
    assert np.allclose(node.world[:3, 2], (0, 1, 0)) and np.linalg.det(node.world) > 0
    assert len(list(upright.nodes())) == 1 + len(list(as_it_is.nodes()))
    assert np.allclose(load(path, environment=sky).bounds(), as_it_is.bounds())
    for wrong in ("x", "Z", 2):
        with pytest.raises(SceneError, match=r"^load: up: .* is not one of y, z$"):
            load(path, up=wrong)  # type: ignore[arg-type]


@needs_assets
def test_environments_from_files(tmp_path: Path) -> None:
    for name in ("courtyard.hdr", "zip_exr/bl_studio.exr"):
        environment = load(triangle(tmp_path), environment=ASSETS / "env" / name).environment
        assert environment is not None
        assert environment.radiance.shape == (512, 1024, 3)


def test_a_missing_environment_is_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"sky.hdr: no such file"):
        load(triangle(tmp_path), environment=tmp_path / "sky.hdr")


def test_an_environment_of_eight_bits_is_srgb_of_0_to_1_nit(tmp_path):
    pixels = np.full((2, 4, 3), 188, np.uint8)
    pixels[0] = 255
    pictures.write_png(tmp_path / "sky.png", pixels)
    radiance = read_environment(tmp_path / "sky.png").radiance
    assert radiance[0] == pytest.approx(1.0) and radiance[1] == pytest.approx(0.503, abs=2e-3)
