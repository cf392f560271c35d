import json

import numpy as np
import pytest

from pica.distributed.coco import annotations, category_of, run_lengths, write_annotations
from pica.images.labels import NodeLabel, Semantic


def label(name, mesh="m", extras=None):
    return NodeLabel(1, name, None, mesh, (), extras or {})


@pytest.mark.parametrize(
    ("name", "category"),
    [("apple", "apple"), ("apple.001", "apple"), ("belt 12", "belt"), ("robot_2", "robot"), ("42", "42"), ("", "m")],
)
def test_categories_by_name(name, category):
    assert category_of(label(name), by_extras=False) == category


def test_categories_by_extras_and_of_groups():
    assert category_of(label("x", extras={"class": "fruit"}), by_extras=True) == "fruit"
    assert category_of(label("x", extras={"class": 3}), by_extras=True) == "3"
    assert category_of(label("apple"), by_extras=True) is None
    assert category_of(label("group", mesh=None), by_extras=False) is None


def test_runs_go_down_the_columns():
    assert run_lengths(np.array([[0, 1], [0, 1], [1, 0]], bool)) == [2, 3, 1]
    assert run_lengths(np.array([[1, 0], [1, 0]], bool)) == [0, 2, 2]
    assert run_lengths(np.zeros((2, 2), bool)) == [4]


def test_masks_are_those_of_pycocotools():
    masks = pytest.importorskip("pycocotools.mask", reason="pycocotools is not installed")
    random = np.random.default_rng(1)
    for share in (0, 0.1, 0.5, 0.9, 1):
        mask = random.random((7, 11)) < share
        encoded = masks.frPyObjects({"size": [7, 11], "counts": run_lengths(mask)}, 7, 11)
        assert encoded["counts"] == masks.encode(np.asfortranarray(mask.astype(np.uint8)))["counts"]


def test_boxes_and_areas(tmp_path):
    instance = np.zeros((4, 6), np.uint32)
    instance[1:3, 2:5] = 7
    instance[1, 2] = 0
    instance[3, 0] = 9  # without a category
    labels = np.where(instance == 7, 2, 0).astype(np.int32)
    (found,) = annotations(instance, Semantic(labels, ("background", "a", "b")))
    assert (found["category_id"], found["instance"], found["bbox"], found["area"]) == (2, 7, [2, 1, 3, 2], 5)

    sample = {"id": 5, "file_name": "x.png", "width": 6, "height": 4, "annotations": [found, found], "time": 0}
    write_annotations(tmp_path / "a.json", iter([sample]), ["a", "b"])
    written = json.loads((tmp_path / "a.json").read_text())
    assert [(entry["id"], entry["image_id"]) for entry in written["annotations"]] == [(1, 5), (2, 5)]
    assert written["images"] == [{"id": 5, "file_name": "x.png", "width": 6, "height": 4}]
    assert [entry["name"] for entry in written["categories"]] == ["a", "b"]
