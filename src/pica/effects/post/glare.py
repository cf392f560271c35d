"""Glare: the star that light of small bright sources makes by diffraction at the edges of an aperture."""

import math

import slangpy as spy

from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.rhi.device import Device

_LIGHT = spy.Format.rgba32_float
_RAYS = 6  # glare_streaks.slang: RAYS
_PASSES = 3
"""Of four taps each: 64 texels of a quarter of the width and height."""
_LENGTH = 0.04
"""Of the picture's height, after which a ray has fallen to 1/e."""


class Glare:
    """A picture of which a fraction is spread along six rays: as much light as before, but for what leaves the
    picture."""

    def __init__(self, device: Device, fraction: float) -> None:
        self._fraction = fraction
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)
        self._down = device.compute("effects/post/bloom_down.slang")
        self._streaks, self._apply = (
            device.compute(f"effects/post/glare_{step}.slang") for step in ("streaks", "apply")
        )

    def __call__(self, graph: FrameGraph, radiance: Texture) -> Texture:
        """The picture with glare."""
        sampler = {"linearSampler": self._linear}
        source = radiance
        for number in range(2):
            size = (source.size[0] + 1) // 2, (source.size[1] + 1) // 2
            coarser = graph.texture(f"glare source {number}", _LIGHT, size)
            inputs = {"finer": source, "coarser": write(coarser), "size": spy.uint2(*source.size)}
            graph.add(self._down, (*size, 1), **inputs, **sampler)
            source = coarser
        streaks = graph.nothing(_LIGHT, layers=_RAYS)
        for number in range(_PASSES):
            longer = graph.texture(f"glare streaks {number}", _LIGHT, source.size, layers=_RAYS)
            graph.add(
                self._streaks,
                (*source.size, _RAYS),
                source=source,
                shorter=streaks,
                longer=write(longer),
                size=spy.uint2(*source.size),
                begins=int(number == 0),
                step=4**number,
                decay=math.exp(-1 / max(_LENGTH * source.size[1], 0.5)),
                **sampler,
            )
            streaks = longer
        spread = graph.texture("glare", _LIGHT, radiance.size)
        values = {"size": spy.uint2(*radiance.size), "fraction": self._fraction}
        graph.add(
            self._apply,
            (*radiance.size, 1),
            radiance=radiance,
            streaks=streaks,
            spread=write(spread),
            **values,
            **sampler,
        )
        return spread
