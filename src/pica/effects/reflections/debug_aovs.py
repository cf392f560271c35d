"""Reflections and the work of their filters as arrays for people."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.frame.aovs import float21, light_of
from pica.frame.effect import rgb
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

Array = NDArray[Any]

_OF = "debug.reflections"
_NO_EMISSION = 0xFFFFFFFF
"""reflected.slang: NO_EMISSION."""
REPROJECTION_AOVS = tuple(f"{_OF}.{name}" for name in ("of_surface", "of_image", "image_share", "kernel"))


def _reflected_of(packed: Array) -> Array:
    """Linear colours (height, width, 3): as packReflected in reflected.slang."""
    codes = np.stack([packed[..., 0] & 0xFFFF, packed[..., 0] >> 16, packed[..., 1] & 0xFFFF], axis=-1)
    return float21(codes << 5)


def offer_ray_aovs(graph: FrameGraph, light: Texture) -> None:
    """Offer raw: radiance of single rays, (height, width, 3) of their texture (ray_grid.slang)."""

    def radiance(light: Array) -> Array:
        emitted = np.where(light[..., :2] == _NO_EMISSION, np.uint32(0), light[..., :2])
        return light_of(emitted) + _reflected_of(light[..., 2:])

    graph.offer(f"{_OF}.raw", (light,), radiance)


def offer_reflection_aovs(graph: FrameGraph, reconstructed: Texture, distances: Texture) -> None:
    """Offer the reflections' textures; light is in nits over specular albedo.

    reconstructed: (height, width, 3) from neighbours' rays of this frame; variance: of that, (height, width); distance:
    metres to the reflected surface.
    """
    graph.offer(f"{_OF}.reconstructed", (reconstructed,), rgb)
    graph.offer(f"{_OF}.variance", (reconstructed,), lambda values: values[..., 3])
    graph.offer(f"{_OF}.distance", (distances,), lambda values: values[..., 0])


def offer_history_aovs(graph: FrameGraph, signal: Texture, history: Texture) -> None:
    """Offer the history, if there is one.

    accumulated: the temporal mean; history: the sum of its weights, that is the frames in it, times the specular albedo
    and the effective number of rays of each.
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
