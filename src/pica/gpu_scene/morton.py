"""The order of points along a curve through space, in which neighbours are near one another."""

import numpy as np
from numpy.typing import NDArray


def morton_codes(points: NDArray[np.floating]) -> NDArray[np.uint32]:
    """(n,) places along a Z-order curve through the points' box, 10 bits an axis."""
    low, high = points.min(0), points.max(0)
    cells = ((points - low) / np.maximum(high - low, 1e-30) * 1023).astype(np.uint32)
    code = np.zeros(len(points), np.uint32)
    for bit in range(10):
        for axis in range(3):
            code |= (cells[:, axis] >> np.uint32(bit) & np.uint32(1)) << np.uint32(3 * bit + axis)
    return code
