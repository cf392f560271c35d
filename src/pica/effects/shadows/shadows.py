"""Shadows of all light slots: one ray a pixel and slot; those of the strongest soft lights are filtered."""

from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.shadows.debug_aovs import offer_shadow_aovs
from pica.effects.shadows.denoiser import ShadowDenoiser
from pica.frame.effect import Effect, Reference, ReferenceLayer
from pica.frame.signals.shadows import ShadowTextures, visibility_layers
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.light_sampling.light_sampler import LightSamples
from pica.light_sampling.light_slots import LightSlots
from pica.rhi.device import Device
from pica.settings import ShadowsSettings
from pica.tracing.many_samples import ManySamples
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/shadows"


class Shadows(Effect):
    """Which part of each light reaches each pixel."""

    name = "shadows"
    aov_names = ("shadows",)

    def __init__(self, device: Device, settings: ShadowsSettings, tracer: Tracer | None = None) -> None:
        self._slots: LightSlots | None = None
        self._denoiser = ShadowDenoiser(device, settings.history)
        self._trace = ray_effect(device, f"{_FOLDER}/shadow_rays.slang", "ShadowRays", "hit", tracer)
        reference = f"{_FOLDER}/shadow_reference.slang"
        self._by_many_rays = ManySamples(device, reference, "LightVisibility", "surface", tracer)

    def reset(self) -> None:
        """Discard the lights' state."""
        self._denoiser.reset()

    def reference(self) -> Reference | None:
        """The visibility of each single light by many rays."""
        if self._slots is None:
            return None
        layers = {
            f"{name or 'light'} {slot}": ReferenceLayer(f"reference.shadows.{slot}", {"slot": slot})
            for slot, name in enumerate(self._slots.single_lights)
        }
        inputs = "frame", "gbuffer", "scene", "lightSlots"
        return Reference(self._by_many_rays, inputs, layers)

    def __call__(
        self,
        graph: FrameGraph,
        scene: SceneView,
        light: LightSamples,
    ) -> ShadowTextures:
        """The visibility of this frame's light samples, and the filtered shadows."""
        slots = self._slots = light.slots
        denoised = len(slots.denoised)
        with graph.scope(self.name):
            bits = graph.texture("visibility", spy.Format.rg32_uint)
            outputs: dict[str, Any] = {"visibility": write(bits)}
            samples, slopes = graph.nothing(spy.Format.rgba16_float, 1), graph.nothing(spy.Format.r16_float, 1)
            layers = max(denoised, slots.count if scene.transparent else 0)
            if layers:
                samples = graph.texture("samples", spy.Format.rgba16_float, layers=layers)
                outputs["samples"] = write(samples)
            if denoised:
                slopes = graph.texture("slopes", spy.Format.r16_float, layers=denoised)
                outputs["slopes"] = write(slopes)
            rates = graph.texture("rates", spy.Format.r8_unorm)
            followed = graph.history("followed", {"followed": spy.Format.r8_uint})
            graph.add(
                self._trace,
                graph.size,
                lightSamples=light.samples,
                weights=light.weights,
                shadowRates=write(rates),
                moves=lambda frame: int(frame.changed_scene and followed.known(frame)),
                **{"samples": samples, "slopes": slopes, **outputs, **followed.swap()},
            )
            graph.offer("shadows", (bits,), lambda values: visibility_layers(values, slots.count))
            graph.offer("rays.shadow_rays", (bits,), _traced, on_request=True)
            filtered = samples
            if denoised:
                moving = followed["followed"]
                textures = self._denoiser(graph, slots, samples, slopes, moving, light.motions)
                filtered = textures["filtered"]
                offer_shadow_aovs(graph, {"samples": samples, **textures}, slots.svgf)
            for slot in range(len(slots.single_lights)):
                self._offer_result(graph, slot, bits, filtered, slot < denoised)
        return ShadowTextures(bits, filtered, samples, followed["followed"], rates if slots.noisy else None)

    def _offer_result(self, graph: FrameGraph, slot: int, bits: Texture, filtered: Texture, is_filtered: bool) -> None:
        """(height, width) the fraction of a slot's light that arrives."""
        name = f"reference.shadows.{slot}"
        if is_filtered:
            read = lambda layers: layers[slot, ..., :3].astype(np.float32).mean(-1)  # noqa: E731
            graph.offer(name, (filtered,), read, on_request=True)
        else:
            graph.offer(name, (bits,), lambda bits: visibility_layers(bits, slot + 1)[..., slot], on_request=True)


def _traced(bits: NDArray[Any]) -> int:
    """One ray a slot where its light may arrive."""
    return int(np.unpackbits(np.ascontiguousarray(bits[..., 1]).view(np.uint8)).sum())
