"""Points and lines (3.7.2.1), as thin triangles that every ray and every device finds.

glTF recommends a width of one pixel (3.9.7), which is no length in the world: here it is a fraction of the primitive's
extent, one to three pixels of a picture that shows it all.
"""

import numpy as np
from numpy.typing import NDArray

from pica.scene.building import Attributes

POINTS, LINES, LINE_LOOP, LINE_STRIP = range(4)

POINT_WIDTH, LINE_WIDTH = 1 / 100, 1 / 400
"""As fractions of the diagonal of the box of all positions. More than 10,000 points are less wide: as their distance
would be if they were spread over a square."""
VERTICES, TRIANGLES = 6, 6
"""Most of a point or line: for counting before they are made."""

_TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], np.float32) / np.float32(np.sqrt(3))
_SIDES_OF_POINT = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], np.uint32)
_SIDES_OF_LINE = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]], np.uint32)
"""Of a prism: vertices 0 to 2 stand round the start, 3 to 5 round the end."""
_ANGLES = np.arange(3) * (2 * np.pi / 3)


def thickened(
    attributes: Attributes, order: NDArray[np.uint32], mode: int
) -> tuple[Attributes, NDArray[np.uint32]]:  # fmt: skip
    """Attributes and (triangles, 3) of tetrahedra at points, or of three-sided prisms along lines.

    `order`: the vertices that a primitive of the mode names. Normals, unless given, point away from the line. Lines
    without a length are left out.
    """
    positions = attributes["POSITION"]
    used = positions[order].astype(np.float64)
    width = min(POINT_WIDTH, len(order) ** -0.5) if mode == POINTS else LINE_WIDTH
    radius = width / 2 * float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)) or 1)
    if mode == POINTS:
        source = np.repeat(order, len(_TETRAHEDRON))
        outward, sides, corners = np.tile(_TETRAHEDRON, (len(order), 1)), _SIDES_OF_POINT, len(_TETRAHEDRON)
    else:
        ends = _ends(order, mode)
        along = (positions[ends[:, 1]] - positions[ends[:, 0]]).astype(np.float64)
        lengths = np.linalg.norm(along, axis=1)
        ends, along = ends[lengths > 0], along[lengths > 0] / lengths[lengths > 0, None]
        source = np.repeat(ends.reshape(-1), len(_ANGLES))
        outward, sides, corners = _round(along), _SIDES_OF_LINE, 2 * len(_ANGLES)
    made = {name: values[source] for name, values in attributes.items()}
    made["POSITION"] = made["POSITION"] + np.float32(radius) * outward
    made.setdefault("NORMAL", outward)
    firsts = np.arange(0, len(source), corners, dtype=np.uint32)
    return made, (firsts[:, None, None] + sides).reshape(-1, 3)


def _ends(order: NDArray[np.uint32], mode: int) -> NDArray[np.uint32]:
    """(lines, 2) vertices."""
    if mode == LINES:
        return order[: len(order) // 2 * 2].reshape(-1, 2)
    following = np.roll(order, -1) if mode == LINE_LOOP else order[1:]
    return np.stack([order[: len(following)], following], axis=1)


def _round(along: NDArray[np.float64]) -> NDArray[np.float32]:
    """(lines * 6, 3) directions at right angles to unit vectors: three for the start and three for the end."""
    least = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    side = np.cross(along, least)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    around = side[:, None] * np.cos(_ANGLES)[:, None] + other[:, None] * np.sin(_ANGLES)[:, None]
    return np.concatenate([around, around], axis=1).reshape(-1, 3).astype(np.float32)
