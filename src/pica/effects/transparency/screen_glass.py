"""Transmissive and blended surfaces without rays: layers of the former refract the picture."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import slangpy as spy

from pica.frame.gbuffer import GBuffer
from pica.graph.graph import FrameGraph
from pica.graph.resources import History, Texture, update, write
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device

LAYERS = 4
"""Surfaces that a pixel shows one by one, at most; behind them one blended one is met by chance."""


class ScreenGlass:
    """The surfaces that the G-buffer's raster passes find in front of it, in GBuffer.glass_layers."""

    def __init__(self, device: Device) -> None:
        self._device = device
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)

    # Made for the first scene that needs them: others need not compile them.
    @cached_property
    def _layer(self) -> MaterialPass:
        return programs(self._device).compute("effects/transparency/screen_glass.slang")

    @cached_property
    def _front(self) -> MaterialPass:
        return programs(self._device).compute("effects/transparency/screen_layers.slang")

    def in_front(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        radiance: Texture,
        layers: Mapping[str, Texture],
        light: dict[str, Any],
    ) -> Texture:
        """Fill `layers`, for layer_apply.slang, with the blended surfaces in front of transmissive ones.

        Returns how many of `glass_layers` these are. `light`: LightSamples.at_hits."""
        count = graph.texture("layers in front", spy.Format.r32_uint)
        found = {f"layer{number}": layer for number, layer in enumerate(gbuffer.glass_layers)}
        written = {name: write(texture) for name, texture in layers.items()}
        graph.add(self._front, graph.grid, **light, radiance=radiance, **found, **written, inFront=write(count))
        return count

    def through(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        glass: History,
        radiance: Texture,
        in_front: Texture | None,
        light: dict[str, Any],
    ) -> Texture:
        """`radiance` through transmissive surfaces, and blended ones behind them, the farthest first, and their light.

        `in_front`: as the method has it, where there are blended ones."""
        motion = glass["glassMotion"]
        nothing = graph.nothing(spy.Format.r32_uint)
        layers = list(enumerate(gbuffer.glass_layers))
        for number, layer in reversed(layers):
            is_farthest = number == len(layers) - 1
            seen = graph.texture(f"seen {number}", spy.Format.rgba32_float)
            graph.add(
                self._layer,
                graph.grid,
                **light,
                linear=self._linear,
                layer=layer,
                radiance=radiance,
                number=number,
                inFront=in_front or nothing,
                hasLayers=int(in_front is not None),
                isFarthest=int(is_farthest),
                seen=write(seen),
                glassMotion=write(motion) if is_farthest else update(motion),
                previousGlassMotion=motion.previous,
                known=glass.known,
            )
            radiance = seen
        return radiance
