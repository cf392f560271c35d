"""Transmissive and blended surfaces: what is seen through them and in them (RTG 19, 19.3.4)."""

from functools import cached_property
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.effect import Effect, rgb
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.settings import TransparencySettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect

_FOLDER = "effects/transparency"


def _count(glass: NDArray[np.uint32]) -> int:
    """How many pixels send rays."""
    return int(np.count_nonzero(glass[..., 0]))


class Transparency(Effect):
    """Paths from the camera through transmissive surfaces, and rays through layers of blended ones: the G-buffer leaves
    both out. Layers in front of a transmissive surface are drawn over it; those behind it are met by chance."""

    name = "transparency"
    aov_names = ("transmission",)

    def __init__(
        self, device: Device, settings: TransparencySettings, tracer: Tracer | None, cache: str | None, filters: bool
    ) -> None:
        """`cache`: the module of the cache of indirect light, if calls pass one. `filters`: DebugSettings.filters."""
        self._device, self._tracer, self._cache = device, tracer, cache
        self._surfaces, self._layers, self._filters = settings.surfaces, settings.layers, filters

    # Made for the first scene that needs them: others need not compile them.
    @cached_property
    def _trace(self) -> RayEffect:
        return self._effect("transparency_rays", "TransparencyRays", "surface")

    @cached_property
    def _trace_layers(self) -> RayEffect:
        return self._effect("layer_rays", "LayerRays", "hit")

    @cached_property
    def _apply_layers(self) -> ComputePass:
        return self._device.compute(f"{_FOLDER}/layer_apply.slang")

    def __call__(
        self,
        graph: FrameGraph,
        scene: SceneView,
        gbuffer: GBuffer,
        samples: LightSamples,
        indirect: IndirectResult | None,
        radiance: Texture,
    ) -> Texture:
        """`radiance`, complete light towards the camera of what the G-buffer has, with the rest (width, height,
        rgba32_float, nits; alpha as transparency_rays.slang has it)."""
        with graph.scope(self.name):
            if gbuffer.glass is None:
                graph.offer("transmission", (radiance,), lambda light: np.zeros_like(rgb(light)))
                return radiance
            inputs = {
                **samples.at_hits(regularized=self._filters),
                **(indirect.cache.values if indirect and indirect.cache else {}),
                "glass": gbuffer.glass,
                "radiance": radiance,
            }
            seen = self._through_glass(graph, radiance, inputs) if scene.shows_glass else radiance
            if scene.shows_layers:
                seen = self._over(graph, seen, inputs)
            graph.offer("transmission", (seen, radiance), lambda after, before: rgb(after) - rgb(before))
            for name in ["transparency_rays"] * scene.shows_glass + ["layer_rays"] * scene.shows_layers:
                graph.offer(f"rays.{name}", (gbuffer.glass,), _count, on_request=True)
        return seen

    def _through_glass(self, graph: FrameGraph, radiance: Texture, inputs: dict[str, Any]) -> Texture:
        seen = graph.texture("seen", spy.Format.rgba32_float)
        history = graph.history("moving glass", {"moving": spy.Format.r32_uint})
        moving, state = history.textures["moving"], history.state
        graph.add(
            self._trace,
            graph.size,
            **inputs,
            seen=write(seen),
            moving=write(moving),
            previousMoving=moving.previous,
            known=lambda frame: int(state.precedes(frame)),
            surfaces=self._surfaces,
        )
        return seen

    def _over(self, graph: FrameGraph, beneath: Texture, inputs: dict[str, Any]) -> Texture:
        """Layers of blended surfaces over a picture."""
        layers = {
            name: graph.texture(name, spy.Format.rg32_float if name == "layerBefore" else spy.Format.rgba32_float)
            for name in ("layerLight", "layerAlbedo", "layerReflection", "layerBefore")
        }
        written = {name: write(texture) for name, texture in layers.items()}
        graph.add(self._trace_layers, graph.size, **inputs, **written, layers=self._layers)
        seen = graph.texture("seen with layers", spy.Format.rgba32_float)
        history = graph.history("layers", {"light": spy.Format.rgba32_float})
        light, state = history.textures["light"], history.state
        graph.add(
            self._apply_layers,
            graph.grid,
            **layers,
            beneath=beneath,
            previousHistory=light.previous,
            history=write(light),
            known=lambda frame: int(state.precedes(frame)),
            filtered=int(self._filters),
            seen=write(seen),
        )
        return seen

    def _effect(self, file: str, effect: str, detail: Any) -> RayEffect:
        module = f"{_FOLDER}/{file}.slang"
        return ray_effect(self._device, module, effect, detail, self._tracer, with_module=self._cache)
