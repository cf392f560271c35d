"""A node's rows in the scene's tables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.geometry import GpuMesh
from pica.scene.model import Node


@dataclass(eq=False, slots=True)
class Placement:
    """Which instances belong to a node that shows a mesh, and which records and objects show it in all views."""

    instances: range
    identities: NDArray[np.int64] | None
    """Of the instances as they were last placed."""
    mesh: GpuMesh | None = None
    """None if each view has its own geometry for the node (view_geometry.py)."""
    records: range = range(0)
    objects: range = range(0)

    def take_replaced(self, node: Node) -> NDArray[np.bool_]:
        """(instances,) which of them have a new identity since the last call."""
        before, self.identities = self.identities, node.identities
        if before is None or node.identities is None:
            return np.zeros(len(self.instances), bool)
        return np.asarray(before != node.identities)
