"""Reflections' rays over the depth buffer, where nothing traces them."""

from typing import Any

from pica.frame.gbuffer import GBuffer
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture
from pica.programs.library import programs
from pica.rhi.device import Device


class ScreenRays:
    """A ray for 2x2 pixels over the depth buffer; beyond it is the prefiltered environment."""

    def __init__(self, device: Device) -> None:
        self._march = programs(device).compute("effects/reflections/screen_space/screen_space.slang")

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        surroundings: Texture,
        **pictures: Any,
    ) -> None:
        """March. `surroundings`: (width, height) specular light of the prefiltered environment, over albedo.
        `pictures`: the other parameters of screen_space.slang."""
        pyramid = gbuffer.depth_pyramid(graph)
        graph.add(self._march, graph.half_grid, pyramid=pyramid, surroundings=surroundings, **pictures)
