"""Reflections and the work of their filters as arrays for people."""

from collections.abc import Mapping

from pica.frame.aovs import light_of
from pica.frame.effect import rgb
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

_OF = "debug.reflections"
REPROJECTION_AOVS = tuple(f"{_OF}.{name}" for name in ("of_surface", "of_image", "image_share", "kernel"))


def offer_reflection_aovs(graph: FrameGraph, light: Texture, reconstructed: Texture, distances: Texture) -> None:
    """Offer views of the reflections' textures; light is in nits over specular albedo.

    raw: (height / 2, width / 2, 3) what each ray brought. reconstructed: (height, width, 3) from neighbours' rays of
    this frame; variance: of that, (height, width); distance: metres to what is mirrored.
    """
    graph.offer(f"{_OF}.raw", (light,), lambda light: light_of(light[..., :2]) + light_of(light[..., 2:]))
    graph.offer(f"{_OF}.reconstructed", (reconstructed,), rgb)
    graph.offer(f"{_OF}.variance", (reconstructed,), lambda values: values[..., 3])
    graph.offer(f"{_OF}.distance", (distances,), lambda values: values[..., 0])


def offer_history_aovs(graph: FrameGraph, signal: Texture, history: Texture) -> None:
    """Offer views of the history, where there is one.

    accumulated: with earlier frames; history: the number of these, times the rays that each is worth.
    """
    graph.offer(f"{_OF}.accumulated", (signal,), rgb)
    graph.offer(f"{_OF}.history", (history,), lambda layers: layers[0, ..., 3])


def offer_reprojection_aovs(graph: FrameGraph, past: Mapping[str, Texture]) -> None:
    """Offer views of what the newest frame found of the one before.

    of_surface and of_image: light where the surface was and where the image of what it mirrors was; image_share: how
    much the latter counts; kernel: pixels that the filter reaches.
    """
    graph.offer(f"{_OF}.of_surface", (past["ofSurface"],), rgb)
    graph.offer(f"{_OF}.of_image", (past["ofImage"],), rgb)
    graph.offer(f"{_OF}.image_share", (past["choice"],), lambda values: values[..., 0])
    graph.offer(f"{_OF}.kernel", (past["choice"],), lambda values: values[..., 1])
