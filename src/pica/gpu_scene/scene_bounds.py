"""The bounds of a scene's nodes, from their rows in its tables."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.bounds import Box, joined, object_box, world_box
from pica.gpu_scene.placement import Placement
from pica.rhi.tables import rows_of_ranges
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.model import Node
from pica.scene.skin import deformed_positions


def grown(bounds: Box, placements: Mapping[Node, Placement], instances: NDArray[Any], records: NDArray[Any]) -> Box:
    """The bounds extended by nodes; `instances` and `records`: the rows of the scene's tables."""
    to_world = instances["to_world"]
    placed_records = records[rows_of_ranges(placement.records for placement in placements.values())]
    if len(placed_records):
        extents = abs(placed_records["extent"])
        bounds = joined(bounds, world_box(to_world[placed_records["instance"]], placed_records["center"], extents))
    for node, placement in placements.items():
        mesh = placement.mesh
        moves_freely = mesh is None or (mesh.previous is not None and isinstance(node.deformer, DynamicVertices))
        if moves_freely and node.mesh is not None:
            placed = to_world[placement.instances.start : placement.instances.stop]
            for section in node.mesh.sections:
                positions = deformed_positions(section, node) if node.deforms else section.positions
                center, extent = object_box(positions.astype(np.float32))
                box = world_box(placed, np.tile(center, (len(placed), 1)), np.tile(extent, (len(placed), 1)))
                bounds = joined(bounds, box)
    return bounds
