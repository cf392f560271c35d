"""Temporal accumulation on the host: threads of its passes, and what a history holds."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.graph.resources import Size

_GROUP = 16
"""accumulate.slang: GROUP."""


def accumulate_grid(size: Size, layers: int = 1) -> tuple[int, int, int]:
    """Threads of a pass that calls accumulate.slang's `accumulate`: its groups begin elsewhere in each frame."""
    return size[0] + _GROUP, size[1] + _GROUP, layers


def history_length(packed: NDArray[Any]) -> NDArray[np.float32]:
    """Samples in each mean of a history (height, width): lengthOf in history_sample.slang."""
    return (packed[..., 2] >> 16).astype(np.uint16).view(np.float16).astype(np.float32)
