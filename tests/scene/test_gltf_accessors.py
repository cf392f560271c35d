from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.gltf import read
from pica.scene.gltf.accessors import read_accessor, read_floats
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from tests.scene.gltf_files import TRIANGLE, GltfFile


def floats(file: GltfFile, index: int, folder: Path, kind: str) -> NDArray[np.float32]:
    return read_floats(Document(file.write(folder)), Element({"values": index}), "values", (kind,))


@pytest.mark.parametrize(
    ("dtype", "stored", "expected"),
    [
        ("u1", [0, 51, 255], [0.0, 0.2, 1.0]),
        ("i1", [-128, -127, 127], [-1.0, -1.0, 1.0]),
        ("u2", [0, 13107, 65535], [0.0, 0.2, 1.0]),
        ("i2", [-32768, 0, 32767], [-1.0, 0.0, 1.0]),
    ],
)
def test_normalized_integers_become_fractions(
    dtype: str, stored: list[int], expected: list[float], tmp_path: Path
) -> None:
    file = GltfFile()
    index = file.accessor(stored, dtype, normalized=True)
    np.testing.assert_allclose(floats(file, index, tmp_path, "SCALAR")[:, 0], expected, atol=1e-7)


def test_integers_that_are_not_normalized_keep_their_value(tmp_path: Path) -> None:
    file = GltfFile()
    index = file.accessor([[-3, 200, 7]], "i2")
    np.testing.assert_array_equal(floats(file, index, tmp_path, "VEC3"), [[-3, 200, 7]])


def test_strided_values_share_a_view(tmp_path: Path) -> None:
    rows = np.arange(20, dtype="<f4").reshape(4, 5)  # three values of one accessor, two of the next
    file = GltfFile()
    view = file.view(rows.tobytes(), byteStride=20)
    for offset, kind in ((0, "VEC3"), (12, "VEC2")):
        file.add("accessors", bufferView=view, byteOffset=offset, componentType=5126, count=4, type=kind)
    np.testing.assert_array_equal(floats(file, 0, tmp_path, "VEC3"), rows[:, :3])
    np.testing.assert_array_equal(floats(file, 1, tmp_path, "VEC2"), rows[:, 3:])


def test_sparse_values_replace_some(tmp_path: Path) -> None:
    file = GltfFile()
    sparse = {
        "count": 2,
        "indices": {"bufferView": file.view(np.array([1, 3], "<u2").tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(np.array([[7, 8], [9, 10]], "<f4").tobytes())},
    }
    on_base = file.accessor(np.arange(8).reshape(4, 2), sparse=sparse)
    on_zeros = file.add("accessors", componentType=5126, count=4, type="VEC2", sparse=sparse)
    np.testing.assert_array_equal(floats(file, on_base, tmp_path, "VEC2"), [[0, 1], [7, 8], [4, 5], [9, 10]])
    np.testing.assert_array_equal(floats(file, on_zeros, tmp_path, "VEC2"), [[0, 0], [7, 8], [0, 0], [9, 10]])


def test_matrix_columns_start_at_multiples_of_four_bytes(tmp_path: Path) -> None:
    file = GltfFile()
    columns = np.array([[1, 2, 3, 99], [4, 5, 6, 99], [7, 8, 9, 99]], "u1")
    file.add("accessors", bufferView=file.view(columns.tobytes()), componentType=5121, count=1, type="MAT3")
    values = read_accessor(Document(file.write(tmp_path)), Element({"values": 0}), "values", ("MAT3",))
    np.testing.assert_array_equal(values, [[1, 2, 3, 4, 5, 6, 7, 8, 9]])


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"count": 4}, r"accessors\[0\]: reaches past its buffer view \(byte 48 of 36\)"),
        ({"byteOffset": 4}, "reaches past its buffer view"),
        ({"count": 0}, r"accessors\[0\].count: 0 is not a whole number of at least 1"),
        ({"count": "many"}, "many"),
        ({"type": "VEC5"}, "'VEC5' is not one of SCALAR"),
        ({"type": "SCALAR"}, "must be VEC3, not SCALAR"),
        ({"componentType": 5124}, "5124 is not one of"),
        ({"bufferView": 1}, r"accessors\[0\].bufferView: 1 is out of range \(count 1\)"),
        ({"bufferView": None, "count": 10**10}, r"attributes.POSITION: would take 160 GB of memory"),
        ({"sparse": {"count": 9}}, "sparse.count: 9 is not a whole number from 1 to 3"),
        ({"sparse": {"count": 1}}, r"accessors\[0\].sparse.indices: is missing"),
    ],
)
def test_faults_are_named(change: dict[str, object], fault: str, tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(file.accessor(TRIANGLE, **change))
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"byteStride": 8}, r"accessors\[0\].bufferView: elements of 12 bytes overlap at a byteStride of 8"),
        ({"byteLength": 400}, r"bufferViews\[0\]: reaches past its buffer \(bytes 0 to 400 of 36\)"),
        ({"byteOffset": -4}, "byteOffset: -4 is not a whole number"),
        ({"buffer": 5}, r"bufferViews\[0\].buffer: 5 is out of range \(count 1\)"),
    ],
)
def test_faults_of_buffer_views_are_named(change: dict[str, object], fault: str, tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh()
    file.json["bufferViews"][0] |= change
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


def test_positions_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(file.accessor([[0, 0, 0], [1, np.nan, 0], [0, 1, 0]]))
    with pytest.raises(SceneError, match="POSITION: holds numbers that are not finite"):
        read(file.write(tmp_path))
