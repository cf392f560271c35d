"""Tensors of other libraries in place of arrays."""

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.host_arrays import host_array
from tests.building import lambert

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)
TRIANGLE = [(0, 1, 2)]


class OnCard:
    """A tensor in the memory of a card, as its library shows it to others."""

    def __init__(self, array):
        self._array = array

    def __dlpack__(self, **_):
        raise BufferError("this is not memory of the processor")

    def __dlpack_device__(self):
        return 2, 0  # kDLCUDA


class OfPyTorch(OnCard):
    def detach(self):
        return OfPyTorch(self._array)

    def cpu(self):
        return self._array


class OfCuPy(OnCard):
    def get(self):
        return self._array


class OfJax(OnCard):
    def __array__(self, dtype=None, copy=None):
        return self._array


class WithInterface:
    """A library that knows nothing of DLPack."""

    def __init__(self, array):
        self._array, self.__array_interface__ = array, array.__array_interface__


class OnHost:
    def __init__(self, array):
        self._array = array

    def __dlpack__(self, **options):
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self):
        return 1, 0


def shared(values, array):
    return np.shares_memory(values, array)


@pytest.mark.parametrize("library", [OnHost, WithInterface, OfPyTorch, OfCuPy, OfJax, np.asarray, np.ndarray.tolist])
def test_tensors_of_any_library_are_arrays(library):
    section = pica.Section.from_arrays(library(CORNERS), library(np.array(TRIANGLE)))
    np.testing.assert_array_equal(section.positions, CORNERS)
    node = pica.Node()
    node.transform = library(np.diag([2.0, 2, 2, 1]))
    assert node.world[0, 0] == 2
    texels = np.full((2, 3, 4), 7, np.uint8)
    assert (pica.Texture.from_array(library(texels.astype("f4") / 255), encoding="linear").image.pixels == 7).all()
    image = pica.Image(library(texels))
    assert image.size == (3, 2) and image.pixels.dtype == np.uint8


@pytest.mark.parametrize("library", [OnHost, WithInterface])
def test_memory_of_the_processor_is_shared(library):
    assert shared(pica.Section.from_arrays(library(CORNERS), TRIANGLE).positions, CORNERS)
    image = np.zeros((2, 2, 4), np.uint8)
    assert shared(pica.Image(library(image)).pixels, image)


def test_tensors_of_pytorch():
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    positions = torch.tensor(CORNERS, requires_grad=True)
    section = pica.Section.from_arrays(positions, torch.tensor(TRIANGLE))
    assert shared(section.positions, positions.detach().numpy()) and not section.positions.flags.writeable
    section.colors = torch.full((3, 4), 51, dtype=torch.uint8)
    np.testing.assert_allclose(section.colors, 0.2)
    cloth = pica.DynamicVertices(pica.Node("flag", mesh=pica.Mesh([section])))
    cloth.set(2 * positions)
    np.testing.assert_array_equal(cloth.positions, 2 * CORNERS)
    picture = torch.full((4, 2), 0.2, dtype=torch.float64, requires_grad=True)
    assert pica.Texture.from_array(picture, encoding="srgb").image.pixels[0, 0].tolist() == [51, 51, 51, 255]
    light = pica.Environment(torch.ones(2, 4, 3))
    assert light.radiance.shape == (2, 4, 3)
    material = lambert()
    material.base_color, material.roughness = torch.tensor([0.5, 0.25, 0.0, 1.0]), torch.tensor(0.5)
    assert material.base_color == (0.5, 0.25, 0.0, 1.0) and material.roughness == 0.5


def test_unfit_tensors_are_refused_in_a_line():
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    section = pica.Section.from_arrays(CORNERS, TRIANGLE)
    for given, says in [
        (torch.zeros(3, 3, dtype=torch.bfloat16), r"section: positions: is not an array of numbers \(.*dtype.*\)"),
        (torch.zeros(3, 3, dtype=torch.complex64), "section: positions: an array of complex64 is not an array of num"),
        (torch.zeros(3, 2), r"section: positions: has the shape \(3, 2\), not \(vertices, 3\)"),
        (torch.zeros(3, 3, device="meta"), "section: positions: is not an array of numbers"),
        (torch.zeros(3, 3).to_sparse(), "section: positions: is not an array of numbers"),
        (torch.full((3, 3), torch.nan), "section: positions: row 0 is not finite"),
        (OnCard(CORNERS), "section: positions: a OnCard is not an array of numbers"),
    ]:
        with pytest.raises(SceneError, match=says) as caught:
            section.positions = given
        assert "\n" not in str(caught.value)
    with pytest.raises(SceneError, match="environment: radiance: an array of uint8 is not radiance"):
        pica.Environment(torch.zeros(2, 4, 3, dtype=torch.uint8))


def test_others_stay_as_they_are():
    for values in (CORNERS, [1, 2], 3.0, None, WithInterface(CORNERS)):
        assert host_array(values) is values
