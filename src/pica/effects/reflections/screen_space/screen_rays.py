"""Reflections' rays over the depth buffer, where nothing traces them."""

from typing import Any

import slangpy as spy

from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.programs.library import programs
from pica.rhi.device import Device

_FOLDER = "effects/reflections/screen_space"
_GROUP = 16
"""Pixels a side that a group of depth_pyramid.slang has."""


class ScreenRays:
    """A ray for 2x2 pixels over the depth buffer; beyond it is the prefiltered environment."""

    def __init__(self, device: Device) -> None:
        self._build = device.compute(f"{_FOLDER}/depth_pyramid.slang")
        self._march = programs(device).compute(f"{_FOLDER}/screen_space.slang")

    def __call__(
        self,
        graph: FrameGraph,
        surroundings: Texture,
        **pictures: Any,
    ) -> None:
        """March. `surroundings`: (width, height) specular light of the prefiltered environment, over albedo.
        `pictures`: the other parameters of screen_space.slang."""
        width, height = (-(-length // _GROUP) * _GROUP for length in graph.size)
        pyramid = graph.texture("depth pyramid", spy.Format.rg32_float, (width // 2, height))
        threads = (-(-graph.half_size[0] // 8) * 8, -(-graph.half_size[1] // 8) * 8, 1)
        graph.add(self._build, threads, pyramid=write(pyramid))
        graph.add(
            self._march,
            graph.half_grid,
            pyramid=pyramid,
            surroundings=surroundings,
            **pictures,
        )
