"""Sizes of reflections' rays: ray_grid.slang."""

from pica.graph.graph import FrameGraph
from pica.graph.resources import Size


def ray_size(graph: FrameGraph, dense: bool) -> Size:
    """Of the rays' textures: if `dense`, four pictures of half size, one below the other."""
    width, height = graph.half_size
    return width, height * (4 if dense else 1)
