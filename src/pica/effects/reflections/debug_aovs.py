"""Reflections and the work of their filters as arrays for people."""

from collections.abc import Mapping

from pica.frame.aovs import light_of
from pica.frame.effect import rgb
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

_OF = "debug.reflections"
REPROJECTION_AOVS = tuple(f"{_OF}.{name}" for name in ("of_surface", "of_image", "image_share", "kernel"))


def offer_reflection_aovs(graph: FrameGraph, light: Texture, reconstructed: Texture, distances: Texture) -> None:
    """Offer the reflections' textures; light is in nits over specular albedo.

    raw: radiance of single rays, (height, width, 3) of their textures (ray_grid.slang). reconstructed: (height, width,
    3) from neighbours' rays of this frame; variance: of that, (height, width); distance: metres to the reflected
    surface.
    """
    graph.offer(f"{_OF}.raw", (light,), lambda light: light_of(light[..., :2]) + light_of(light[..., 2:]))
    graph.offer(f"{_OF}.reconstructed", (reconstructed,), rgb)
    graph.offer(f"{_OF}.variance", (reconstructed,), lambda values: values[..., 3])
    graph.offer(f"{_OF}.distance", (distances,), lambda values: values[..., 0])


def offer_history_aovs(graph: FrameGraph, signal: Texture, history: Texture) -> None:
    """Offer the history, if there is one.

    accumulated: the temporal mean; history: the number of frames in it, times the effective number of rays of each.
    """
    graph.offer(f"{_OF}.accumulated", (signal,), rgb)
    graph.offer(f"{_OF}.history", (history,), lambda layers: layers[0, ..., 3])


def offer_reprojection_aovs(graph: FrameGraph, past: Mapping[str, Texture]) -> None:
    """Offer the reprojected history.

    of_surface and of_image: light reprojected by the motion of the surface and of the reflected image; image_share:
    weight of the latter; kernel: radius of the filter in pixels.
    """
    graph.offer(f"{_OF}.of_surface", (past["ofSurface"],), rgb)
    graph.offer(f"{_OF}.of_image", (past["ofImage"],), rgb)
    graph.offer(f"{_OF}.image_share", (past["choice"],), lambda values: values[..., 0])
    graph.offer(f"{_OF}.kernel", (past["choice"],), lambda values: values[..., 1])
