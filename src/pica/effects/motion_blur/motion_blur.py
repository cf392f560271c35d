"""Motion blur while the shutter is open."""

import math

import slangpy as spy

from pica.frame.effect import Effect
from pica.graph.graph import FrameGraph
from pica.graph.resources import Lifetime, Texture, write
from pica.rhi.device import Device

_FOLDER = "effects/motion_blur"
_GROUP = 8  # tile_velocity.slang: WIDTH
_LONGEST = 1 / 16
"""Way from the middle to the end of the exposure over the picture's height, at most."""


class MotionBlur(Effect):
    """The picture during the exposure (width, height, rgba32_float), from the motion since the frame before: McGuire et
    al. 2012, "A Reconstruction Filter for Plausible Motion Blur", and Guertin et al. 2014."""

    name = "motion_blur"

    def __init__(self, device: Device, shutter: float) -> None:
        """`shutter`: fraction of the frame interval that it is open."""
        self._shutter = shutter
        self._velocity, self._tiles, self._neighbours, self._gather = (
            device.compute(f"{_FOLDER}/{step}.slang")
            for step in ("velocity", "tile_velocity", "neighbour_velocity", "motion_gather")
        )

    def __call__(self, graph: FrameGraph, picture: Texture, alpha: Texture | None) -> tuple[Texture, Texture | None]:
        """The picture and its alpha, if there is one."""
        with graph.scope(self.name):
            size = graph.output_size
            longest = size[1] * _LONGEST
            side = max(math.ceil(longest), 1)
            velocity = graph.texture("velocity", spy.Format.rgba16_float, size, lifetime=Lifetime.KEPT)
            graph.add(
                self._velocity,
                graph.output_grid,
                velocity=write(velocity),
                shutter=self._shutter,
                longest=longest,
                when=lambda frame: not frame.continues,
            )
            count = -(-size[0] // side), -(-size[1] // side)
            tiles, reaching = (
                graph.texture(name, spy.Format.rg16_float, count) for name in ("longest in tiles", "longest around")
            )
            whole = {"size": spy.uint2(*size), "side": side}
            groups = count[0] * _GROUP, count[1] * _GROUP, 1
            graph.add(self._tiles, groups, velocity=velocity, tiles=write(tiles), **whole)
            graph.add(self._neighbours, (*count, 1), tiles=tiles, reaching=write(reaching), count=spy.uint2(*count))

            def through(name: str, texture: Texture) -> Texture:
                blurred = graph.texture(name, spy.Format.rgba32_float, size)
                inputs = {"picture": texture, "velocity": velocity, "reaching": reaching, "blurred": write(blurred)}
                graph.add(self._gather, graph.output_grid, **inputs, **whole)
                return blurred

            return through("picture", picture), None if alpha is None else through("alpha", alpha)
