"""The picture of a frame before antialiasing: the sum of all stages' light."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import slangpy as spy

from pica.errors import GraphError
from pica.frame.effect import Array, Effect, rgb
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.light import BOTH_PARTS, SIGNAL
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device

_MOST = {BOTH_PARTS: 4, SIGNAL: 8}
"""composite.slang: MOST_PAIRS, MOST_SINGLE."""


class Composite(Effect):
    """Adds up light towards the camera (width, height, rgba32_float), nits: parts, emission, and visible
    surroundings."""

    name = "composite"
    aov_names = ("environment", "combined")

    def __init__(self, device: Device, transparent: bool) -> None:
        """`transparent`: without surroundings that the camera sees directly."""
        self._device, self._transparent = device, transparent
        self._sum = self._made("composite")

    @cached_property
    def _sum_so_far(self) -> MaterialPass:
        # A pass whose parameters differ between dispatches would be bound again each time.
        return self._made("composite_so_far")

    def _made(self, name: str) -> MaterialPass:
        return programs(self._device).compute("effects/composite/composite.slang", name=name)

    def so_far(self, graph: FrameGraph, parts: Sequence[Texture]) -> Texture:
        """The sum without later stages, for screen-space reflections."""
        return self._added(self._sum_so_far, "radiance so far", graph, parts)

    def __call__(self, graph: FrameGraph, gbuffer: GBuffer, parts: Sequence[Texture]) -> Texture:
        """The whole sum. `parts`: as frame/signals/light.py has them."""
        radiance = self._added(self._sum, "radiance", graph, parts)
        with graph.scope(self.name):
            seen = gbuffer.textures["visibility"]
            graph.offer("environment", (radiance, seen), _where_nothing_is_seen, on_request=True)
        return radiance

    def offer(self, graph: FrameGraph, radiance: Texture) -> None:
        """The finished light as an AOV."""
        with graph.scope(self.name):
            graph.offer("combined", (radiance,), rgb, on_request=True)

    def _added(
        self,
        step: MaterialPass,
        name: str,
        graph: FrameGraph,
        parts: Sequence[Texture],
    ) -> Texture:
        pairs = [part for part in parts if part.format == BOTH_PARTS]
        singles = [part for part in parts if part.format == SIGNAL]
        with graph.scope(self.name):
            radiance = graph.texture(name, spy.Format.rgba32_float)
            graph.add(
                step,
                graph.grid,
                pairs=_filled_up(graph, pairs, BOTH_PARTS),
                pairCount=len(pairs),
                singles=_filled_up(graph, singles, SIGNAL),
                singleCount=len(singles),
                transparent=int(self._transparent),
                radiance=write(radiance),
            )
        return radiance


def _filled_up(graph: FrameGraph, textures: Sequence[Texture], kind: spy.Format) -> tuple[Texture, ...]:
    """Padded to the length of the shader's array. Raises GraphError if there are more."""
    if len(textures) > _MOST[kind]:
        raise GraphError(f"composite: {len(textures)} parts of {kind.name}; it sums at most {_MOST[kind]}")
    return (*textures, *[graph.nothing(kind)] * (_MOST[kind] - len(textures)))


def _where_nothing_is_seen(radiance: Array, visibility: Array) -> Array:
    return np.where(visibility[..., :1] == 0, rgb(radiance), np.float32(0))
