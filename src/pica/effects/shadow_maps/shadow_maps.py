"""Shadows without rays: depth maps from the lights, filtered by the width of the penumbra."""

from functools import partial
from typing import Any

import numpy as np
import slangpy as spy

from pica.effects.shadow_maps.mapped_lights import MappedLights
from pica.frame.context import FrameContext
from pica.frame.effect import Effect
from pica.frame.signals.shadows import ShadowTextures, visibility_layers
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import write
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import Settings


class ShadowMaps(Effect):
    """Which part of each mapped light reaches each pixel; all of every other light does."""

    name = "shadows"
    aov_names = ("shadows",)

    def __init__(self, device: Device, settings: Settings) -> None:
        self._device, self._settings = device, settings
        self._lookup = device.compute("effects/shadow_maps/map_lookup.slang", name="shadow map lookup")
        self._nearest = device.sampler(
            min_filter=spy.TextureFilteringMode.point, mag_filter=spy.TextureFilteringMode.point
        )
        self.maps = MappedLights(device, settings.shadow_maps, [])
        """Of the lights in the newest frame. Their size is independent of the picture's."""

    def __call__(
        self,
        graph: FrameGraph,
        scene: SceneView,
        light: LightSamples,
    ) -> ShadowTextures:
        """The shadows of this frame, which need no history."""
        slots = light.slots
        with graph.scope(self.name):
            graph.record("shadow maps", self._update, scene=scene, light=lambda frame: slots)
            bits = graph.texture("visibility", spy.Format.rg32_uint)
            layers = max(len(slots.denoised), 1)
            filtered = graph.texture("map shadows", spy.Format.rgba16_float, layers=layers)
            # Groups of 64 threads for 8 x 8 pixels; one pixel more each way, by which squares of pixels are moved.
            columns, rows = graph.size[0] // 8 + 1, graph.size[1] // 8 + 1
            lookup: dict[str, Any] = {
                "nearest": self._nearest,
                "soft": int(self._settings.shadows.mode == "soft"),
                "taps": self._settings.shadow_maps.taps,
                **{name: partial(self._parameter, name) for name in self.maps.parameters},
            }
            graph.add(self._lookup, (64 * columns, rows, 1), visibility=write(bits), filtered=write(filtered), **lookup)
            graph.offer("shadows", (bits,), lambda values: visibility_layers(values, slots.count))
            graph.offer("debug.shadows.filtered", (filtered,), lambda values: np.moveaxis(values[..., 0], 0, -1))
        return ShadowTextures(bits, filtered, samples=None, maps=lookup)

    def _update(self, frame: FrameContext, scene: SceneView, light: Any) -> None:
        if light.denoised is not self.maps.nodes:
            self.maps.give_back()
            self.maps = MappedLights(self._device, self._settings.shadow_maps, light.denoised)
        self.maps.update(frame, scene)

    def _parameter(self, name: str, frame: FrameContext) -> Any:
        """Read in each frame: the maps are recreated when lights are added or removed."""
        return self.maps.parameters[name]
