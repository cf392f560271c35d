"""How much costlier a refitted tree is to trace than the same tree when it was built.

Drivers do not report the cost of their trees. Refits degrade a tree because triangles that were neighbours when it
was built, and share boxes, drift apart. So runs of neighbouring triangles are sampled: the mean area of
their boxes over the area of the whole mesh's box is the surface area heuristic's cost of that level of the tree
(MacDonald and Booth 1990, "Heuristics for Ray Tracing Using Space Subdivision"), up to a factor that cancels.
"""

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.morton import morton_codes
from pica.scene.model import Node, Section
from pica.scene.skin import deformed_positions

_RUNS = 48
_TRIANGLES_PER_RUN = 8


class RefitQuality:
    """Watches one deforming mesh."""

    def __init__(self, sections: list[Section], node: Node) -> None:
        self._sections, self._node = sections, node
        self._samples: list[Section] = []
        self._cost = 1.0

    def reset(self) -> None:
        """The tree has just been built from the present pose."""
        self._samples = [self._sampled(section) for section in self._sections]
        self._cost = self._cost_now()

    def now(self) -> float:
        """The present cost over that of the last build; 1 is as good as new."""
        return self._cost_now() / max(self._cost, 1e-30)

    def _sampled(self, section: Section) -> Section:
        positions = deformed_positions(section, self._node)
        order = np.argsort(morton_codes(positions[section.indices].mean(1)), kind="stable")
        runs = max(len(order) // _TRIANGLES_PER_RUN, 1)
        chosen = np.unique(np.linspace(0, runs - 1, _RUNS).astype(np.intp))
        picked = order[np.minimum(chosen[:, None] * _TRIANGLES_PER_RUN + np.arange(_TRIANGLES_PER_RUN), len(order) - 1)]
        used, indices = np.unique(section.indices[picked.reshape(-1)], return_inverse=True)
        return section.take(used.astype(np.intp), indices.reshape(-1, 3).astype(np.uint32))

    def _cost_now(self) -> float:
        costs = []
        for sample in self._samples:
            positions = deformed_positions(sample, self._node)
            corners = positions[sample.indices].reshape(-1, 3 * _TRIANGLES_PER_RUN, 3)
            whole = _area(positions.max(0) - positions.min(0))
            costs.append(float(_area(corners.max(1) - corners.min(1)).mean() / max(float(whole), 1e-30)))
        return float(np.mean(costs)) if costs else 1.0


def _area(extent: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the surface of boxes of (..., 3) extent."""
    x, y, z = extent[..., 0], extent[..., 1], extent[..., 2]
    return np.asarray(x * y + y * z + z * x)
