"""Thread grids of passes whose groups are not aligned with whole tiles of the picture."""

from pica.frame.context import Size

_GROUP = 16
"""accumulate.slang: GROUP."""


def accumulate_grid(size: Size, layers: int = 1) -> tuple[int, int, int]:
    """Threads of a pass that calls accumulate.slang's `accumulate`: its groups begin elsewhere in each frame."""
    return size[0] + _GROUP, size[1] + _GROUP, layers
