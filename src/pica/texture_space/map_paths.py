"""Paths from the texels of objects with maps, and the light that they keep."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Lifetime, Texture, update
from pica.rhi.device import Device
from pica.texture_space.texture_maps import MappedKind, TextureMaps
from pica.tracing.ray_effect import RayEffect

_FIRST = 2
"""Of the numbers of frames: from then on nothing counts as seen in frame 0 (UNSEEN_FRAMES in texel_turns.slang)."""


@dataclass(frozen=True)
class MapLight:
    """What paths have found."""

    texels: Texture
    """(side, side, rgba32_float): light, nits, and the variance of its scalar; negative: none."""

    last_seen: Buffer
    """By object: `number` of the newest frame that shows it. Passes that show maps write it."""

    number: Any
    """Counts frames: an input of passes."""


class MapPaths:
    """A path from each texel in turn, and its mean (texture_space/texel_turns.slang)."""

    def __init__(self, device: Device, kind: MappedKind, side: int, interval: int) -> None:
        """`side`: of the shared texture, rounded down to a power of two. `interval`: frames in which each texel has one
        path; 0: as the device allows."""
        self.maps = TextureMaps(device, kind, 1 << side.bit_length() - 1)
        self._interval = interval or (2 if device.is_software else 1)
        self._scene, self._unchanged, self._number = -1, 0, _FIRST

    def unchanged(self, frame: FrameContext) -> int:
        """For how many frames the scene has not changed: an input of passes."""
        return self._unchanged

    def reset(self) -> None:
        """Forget all light."""
        self._scene, self._unchanged, self._number = -1, 0, _FIRST
        self.maps.reset()

    def light(self, graph: FrameGraph, wanted: bool = True) -> MapLight:
        """Declare what they keep. `wanted`: False if there are no paths."""
        side, number = self.maps.side if wanted else 1, lambda frame: self._number
        texels = graph.texture("light of texels", spy.Format.rgba32_float, (side, side), lifetime=Lifetime.KEPT)
        last_seen = graph.buffer("last seen", 4 * self.maps.room, struct_size=4)
        graph.clear(last_seen, when=lambda frame: frame.first)
        return MapLight(texels, last_seen, number)

    def follow(self, graph: FrameGraph, scene: SceneView, wanted: bool) -> None:
        """Declare what keeps the maps up to date. `wanted`: False leaves all objects out."""
        graph.record("follow scene", self._follow, scene=scene)
        self.maps.declare(graph, scene, wanted)

    def trace(
        self, graph: FrameGraph, light: MapLight, effect: RayEffect, name: str, estimator: int, **inputs: Any
    ) -> None:
        """Declare the paths. `name`: of their number (Renderer.count_rays). `estimator`: bytes of a texel's."""
        side = self.maps.side
        estimators = graph.buffer("estimators", estimator * side * side, struct_size=estimator)
        graph.add(
            effect,
            (side, side),
            when=lambda frame: self.maps.count > 0,
            **inputs,
            estimators=update(estimators),
            light=update(light.texels),
            lastSeen=light.last_seen,
            interval=self._interval,
            changed=lambda frame: int(self.maps.changed),
            number=light.number,
        )
        paths = lambda light: int(np.count_nonzero(light[..., 3] >= 0)) // self._interval  # noqa: E731
        graph.offer(f"rays.{name}", (light.texels,), paths, on_request=True)

    def _follow(self, frame: FrameContext, scene: SceneView) -> None:
        self._unchanged = self._unchanged + 1 if scene.revision == self._scene else 0
        self._scene = scene.revision
        self._number += 1
