"""What a placed node has of the scene's tables, and the layout of their rows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.scene.model import Node, Section
from pica.scene.primitives import Primitives

# shaders/scene_types.slang: SectionRecord and Instance
RECORD = np.dtype(
    [
        (name, "u4")
        for name in ("first_index", "first_vertex", "material", "instance", "first_emissive", "first_previous", "shape")
    ]
    + [("center", "f4", 3), ("extent", "f4", 3)]
)
INSTANCE = np.dtype(
    [
        ("to_world", "f4", (3, 4)),
        ("previous_to_world", "f4", (3, 4)),
        ("node", "u4"),
        ("first_record", "u4"),
        ("mask_and_channels", "u4"),
    ]
)
NOT_EMISSIVE = 0xFFFFFFFF


@dataclass
class Placement:
    """Which instances, records and objects belong to a node that shows a mesh."""

    instances: range
    records: range
    objects: range
    sections: list[Section | Primitives]
    identities: NDArray[np.int64] | None
    """Of the instances as they were last placed."""

    def have_come(self, node: Node) -> NDArray[np.bool_]:
        """(instances,) which of them show something else than before; asking again gives none."""
        before, self.identities = self.identities, node.identities
        if before is None or node.identities is None:
            return np.zeros(len(self.instances), bool)
        return np.asarray(before != node.identities)


def rows_of_runs(starts: NDArray[np.int64], counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """start, start + 1, … of each run, one after the other."""
    before = np.cumsum(counts) - counts
    return np.repeat(starts - before, counts) + np.arange(counts.sum())
