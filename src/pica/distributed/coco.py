"""Instances as COCO has them: run-length encoded masks, boxes and categories.

Lin et al. 2014, "Microsoft COCO: Common Objects in Context"; the format: https://cocodataset.org/#format-data.
"""

import json
import re
from collections.abc import Iterable, Iterator
from itertools import count
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from pica.images.labels import NodeLabel, Semantic
from pica.images.saving import write_whole

CLASS = "class"
"""The key of a category in a node's extras."""
_NUMBER = re.compile(r"[\s._-]*\d+$")


def category_of(label: NodeLabel, by_extras: bool) -> str | None:
    """The category of a node: extras["class"], or its name without the number that copies have, such as apple.001.
    None: that of its parent."""
    if by_extras:
        value = label.extras.get(CLASS)
        return None if value is None else str(value)
    name = (label.name or label.mesh) if label.mesh is not None else None
    return (_NUMBER.sub("", name) or name) if name else None


def has_classes(labels: Iterable[NodeLabel]) -> bool:
    """Whether any node has a category among its extras."""
    return any(CLASS in label.extras for label in labels)


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """Lengths of runs down the columns of a (height, width) mask, of 0 and 1 in turn, first of 0."""
    flat = mask.ravel(order="F")
    ends = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    lengths = np.diff(np.concatenate(([0], ends, [flat.size])))
    return ([0] if flat[0] else []) + [int(length) for length in lengths]


def annotations(instance: NDArray[np.uint32], semantic: Semantic) -> list[dict[str, Any]]:
    """An annotation for each node that is seen and has a category, ascending by its number, without ids.

    `instance`: the AOV. A box is [left, top, width, height] in pixels.
    """
    found = []
    for number in np.unique(instance):
        mask = instance == number
        category = int(semantic.labels[mask][0])
        if number == 0 or category == 0:
            continue
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        left, top = int(columns[0]), int(rows[0])
        found.append(
            {
                "category_id": category,
                "instance": int(number),
                "bbox": [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1],
                "area": int(np.count_nonzero(mask)),
                "iscrowd": 0,
                "segmentation": {"size": list(mask.shape), "counts": run_lengths(mask)},
            }
        )
    return found


def write_annotations(path: Path, samples: Iterable[dict[str, Any]], names: Iterable[str]) -> None:
    """Write the file that COCO's loaders read, a sample's annotations at a time.

    `samples`: with "id", "file_name", "width", "height" and "annotations"; `names`: of the categories from 1 on.
    Raises PicaError if it cannot be written.
    """

    def write(temporary: Path) -> None:
        numbers = count(1)
        images: list[dict[str, Any]] = []

        def each() -> Iterator[dict[str, Any]]:
            for sample in samples:
                images.append({name: sample[name] for name in ("id", "file_name", "width", "height")})
                for annotation in sample["annotations"]:
                    yield {"id": next(numbers), "image_id": sample["id"], **annotation}

        categories = [{"id": number, "name": name, "supercategory": ""} for number, name in enumerate(names, start=1)]
        with temporary.open("w") as file:
            file.write('{"annotations": [')
            _write_items(file, each())
            file.write('],\n"images": [')
            _write_items(file, images)
            file.write('],\n"categories": [')
            _write_items(file, categories)
            file.write("]}\n")

    write_whole(path, write)


def _write_items(file: TextIO, items: Iterable[dict[str, Any]]) -> None:
    for index, item in enumerate(items):
        file.write(("," if index else "") + "\n" + json.dumps(item))
