"""Transmissive surfaces without rays: layers of them refract the picture."""

from functools import cached_property
from typing import Any

import slangpy as spy

from pica.frame.gbuffer import GBuffer
from pica.graph.graph import FrameGraph
from pica.graph.resources import History, Texture, write
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device

LAYERS = 4
"""Transmissive surfaces that a pixel shows, at most."""
_RANDOM = 16
"""Random numbers of a layer: at least DIRECTIONS of screen_glass.slang."""


class ScreenGlass:
    """One pass for each layer that the G-buffer's raster passes find, the farthest first."""

    def __init__(self, device: Device) -> None:
        self._device = device
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)

    # Made for the first scene that needs it: others need not compile it.
    @cached_property
    def _layer(self) -> MaterialPass:
        return programs(self._device).compute("effects/transparency/screen_glass.slang")

    def __call__(
        self, graph: FrameGraph, gbuffer: GBuffer, glass: History, radiance: Texture, light: dict[str, Any]
    ) -> Texture:
        """`radiance` through all layers, and with their own light. `light`: LightSamples.at_hits."""
        nothing = graph.nothing(spy.Format.rgba32_uint)
        unmoved = {"glassMotion": write(nothing), "previousGlassMotion": nothing, "known": 0}
        nearest = {**glass.swap(), "known": glass.known}
        for number, layer in reversed(list(enumerate(gbuffer.glass_layers))):
            seen = graph.texture(f"seen {number}", spy.Format.rgba32_float)
            graph.add(
                self._layer,
                graph.grid,
                **light,
                linear=self._linear,
                layer=layer,
                radiance=radiance,
                isNearest=int(number == 0),
                first=number * _RANDOM,
                seen=write(seen),
                **(nearest if number == 0 else unmoved),
            )
            radiance = seen
        return radiance
