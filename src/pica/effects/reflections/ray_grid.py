"""Sizes of reflections' rays: ray_grid.slang."""

from pica.graph.graph import FrameGraph
from pica.graph.resources import Size


def ray_pictures(dense: bool) -> int:
    """How many pictures of half size they have, one below the other."""
    return 4 if dense else 1


def ray_size(graph: FrameGraph, dense: bool) -> Size:
    """Of the rays' textures."""
    width, height = graph.half_size
    return width, height * ray_pictures(dense)
