"""Bloom: scattering of light in the lens and the eye."""

import slangpy as spy

from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.rhi.device import Device

_LIGHT = spy.Format.rgba32_float
_MOST_LEVELS = 8
_SMALLEST = 8
"""Texels along a side of the coarsest level; the last texels of smaller ones would be mostly outside of the picture."""


class Bloom:
    """A picture of which a fraction is blurred, by the mean of all its levels: as much light as before, but for what
    leaves the picture."""

    def __init__(self, device: Device, fraction: float) -> None:
        self._fraction = fraction
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)
        self._down, self._up, self._apply = (
            device.compute(f"effects/post/bloom_{step}.slang") for step in ("down", "up", "apply")
        )

    def __call__(self, graph: FrameGraph, radiance: Texture) -> Texture:
        """The picture with bloom."""
        sampler = {"linearSampler": self._linear}
        levels = [radiance]
        while len(levels) <= _MOST_LEVELS and min(levels[-1].size) >= 2 * _SMALLEST:
            finer = levels[-1]
            size = (finer.size[0] + 1) // 2, (finer.size[1] + 1) // 2
            coarser = graph.texture(f"bloom level {len(levels)}", _LIGHT, size)
            inputs = {"finer": finer, "coarser": write(coarser), "size": spy.uint2(*finer.size)}
            graph.add(self._down, (*size, 1), **inputs, **sampler)
            levels.append(coarser)
        scattered = levels[-1]
        for level in reversed(range(1, len(levels) - 1)):
            own, below = levels[level], len(levels) - 1 - level
            mean = graph.texture(f"bloom from level {level}", _LIGHT, own.size)
            graph.add(
                self._up,
                (*own.size, 1),
                own=own,
                coarser=scattered,
                mean=write(mean),
                size=spy.uint2(*own.size),
                coarserSize=spy.uint2(*scattered.size),
                coarserShare=below / (below + 1),
                **sampler,
            )
            scattered = mean
        if scattered is radiance:  # too small a picture
            return radiance
        bloomed = graph.texture("bloomed", _LIGHT, radiance.size)
        inputs = {"radiance": radiance, "scattered": scattered, "bloomed": write(bloomed)}
        values = {"size": spy.uint2(*radiance.size), "fraction": self._fraction}
        graph.add(self._apply, (*radiance.size, 1), **inputs, **values, **sampler)
        return bloomed
