"""Transmissive and blended surfaces without rays: layers of the former refract the picture."""

from collections.abc import Mapping
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
        self._passes: dict[tuple[str, bool], MaterialPass] = {}
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)

    def in_front(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        radiance: Texture,
        layers: Mapping[str, Texture],
        light: Mapping[str, Any],
        maps: Mapping[str, Any] | None,
    ) -> Texture:
        """Fill `layers`, for layer_apply.slang, with the blended surfaces in front of transmissive ones.

        Returns how many of `glass_layers` these are. `light`: LightSamples.at_hits; `maps`:
        ShadowTextures.maps."""
        count = graph.texture("layers in front", spy.Format.r32_uint)
        found = {f"layer{number}": layer for number, layer in enumerate(gbuffer.glass_layers)}
        written = {name: write(texture) for name, texture in layers.items()}
        step = self._pass("screen_layers", maps is not None)
        inputs = {**light, **(maps or {}), **found, **written}
        graph.add(
            step, graph.grid, radiance=radiance, pyramid=gbuffer.depth_pyramid(graph), inFront=write(count), **inputs
        )
        return count

    def through(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        glass: History,
        radiance: Texture,
        in_front: Texture | None,
        light: Mapping[str, Any],
        maps: Mapping[str, Any] | None,
    ) -> Texture:
        """`radiance` through transmissive surfaces, and blended ones behind them, the farthest first, and their light.

        `in_front`: as the method has it, where there are blended ones."""
        motion, pyramid = glass["glassMotion"], gbuffer.depth_pyramid(graph)
        nothing = graph.nothing(spy.Format.r32_uint)
        layers = list(enumerate(gbuffer.glass_layers))
        step, inputs = self._pass("screen_glass", maps is not None), {**light, **(maps or {})}
        for number, layer in reversed(layers):
            is_farthest = number == len(layers) - 1
            seen = graph.texture(f"seen {number}", spy.Format.rgba32_float)
            graph.add(
                step,
                graph.grid,
                **inputs,
                linear=self._linear,
                layer=layer,
                radiance=radiance,
                pyramid=pyramid,
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

    def _pass(self, file: str, maps: bool) -> MaterialPass:
        """`maps`: it finds shadows of light samples in shadow maps. Made for the first scene that needs it: others need
        not compile it."""
        if (file, maps) not in self._passes:
            shadows = "light_sampling/mapped_visibility.slang" if maps else None
            module = f"effects/transparency/{file}.slang"
            self._passes[file, maps] = programs(self._device).compute(module, with_module=shadows)
        return self._passes[file, maps]
