"""Shadows of all light slots: one ray a pixel and slot; those of the strongest soft lights are filtered."""

import numpy as np
import slangpy as spy

from pica.effects.shadows.denoiser import ShadowDenoiser
from pica.effects.shadows.views import shadow_views
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.light_sampling.light_slots import LightSlots
from pica.light_sampling.shadow_textures import ShadowTextures, visibility_aov, visibility_layers
from pica.rhi.device import Device
from pica.settings import ShadowsSettings
from pica.tracing.hit_groups import HitDetail
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect


class Shadows(Effect):
    """Which part of each light reaches each pixel."""

    name = "shadows"
    aov_names = ("shadows",)

    def __init__(self, device: Device, size: Size, settings: ShadowsSettings, tracer: Tracer | None = None) -> None:
        self._device, self._tracer = device, tracer
        self._make(size)
        self._slots: LightSlots | None = None
        self._denoiser = ShadowDenoiser(device, size, settings.history)
        self._effects: dict[HitDetail, RayEffect] = {}

    def _make(self, size: Size) -> None:
        self._size = size
        self._bits = self._device.texture("shadow visibility", spy.Format.rg32_uint, size)
        self._samples = self._device.texture("shadow samples", spy.Format.rgba16_float, (1, 1), layers=1)
        self._slopes = self._device.texture("shadow slopes", spy.Format.r16_float, (1, 1), layers=1)
        self._sample_layers = self._denoised = 0

    def reset(self) -> None:
        """Drop the history."""
        self._denoiser.reset()

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(self._bits, self._samples, self._slopes)
        self._make(size)
        self._denoiser.resize(size)

    def expect(self, scene: SceneView) -> None:
        """Have the passes that this scene calls for before its first frame."""
        self._rays_for(scene)

    def aovs(self) -> dict[str, Aov]:
        """shadows: (height, width, slots) 1 where the light's sample is not hidden, else 0."""
        return {} if self._slots is None else {"shadows": visibility_aov(self._bits, self._slots.count)}

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py. Nothing without denoised slots."""
        if self._slots is None or not self._denoised:
            return {}
        return shadow_views({"samples": self._samples, **self._denoiser.debug_textures()}, self._slots.svgf)

    def ray_counts(self) -> dict[str, int]:
        """One a slot where its light may arrive."""
        traced = np.ascontiguousarray(self._bits.to_numpy()[..., 1])
        return {"shadow_rays": int(np.unpackbits(traced.view(np.uint8)).sum())}

    def reference(self) -> Reference | None:
        """The visibility of each single light by many rays."""
        if self._slots is None:
            return None
        layers = {
            f"{name or 'light'} {slot}": ReferenceLayer(self._share(slot), {"slot": slot})
            for slot, name in enumerate(self._slots.single_lights)
        }
        inputs = "frame", "gbuffer", "scene", "lightSlots"
        return Reference("path_tracer/light_visibility.slang", "LightVisibility", "surface", inputs, layers)

    def _share(self, slot: int) -> Aov:
        """(height, width) the share of a slot's light that arrives: filtered where it is."""
        if self._slots is not None and slot < len(self._slots.denoised):
            filtered = self._denoiser.debug_textures()["filtered"]
            return Aov((filtered,), lambda layers: layers[slot, ..., :3].astype(np.float32).mean(-1))
        return Aov((self._bits,), lambda bits: visibility_layers(bits, slot + 1)[..., slot])

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        reprojection: Reprojection,
    ) -> ShadowTextures:
        """The visibility of this frame's light samples, and the shadows that many of them make."""
        slots = self._slots = light.slots
        self._allocate(len(slots.denoised), slots.count if scene.transparent else 0)
        self._rays_for(scene)(
            frame,
            frame.size,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightSlots=slots,
            lightSamples=light.samples,
            weights=light.weights,
            visibility=self._bits,
            samples=self._samples,
            slopes=self._slopes,
        )
        if not slots.denoised:
            return ShadowTextures(self._bits, self._samples, self._samples)
        filtered = self._denoiser(frame, gbuffer, scene, slots, self._samples, self._slopes, reprojection)
        return ShadowTextures(self._bits, filtered, self._samples)

    def _rays_for(self, scene: SceneView) -> RayEffect:
        """Only where light goes through surfaces must the rays know their materials."""
        detail: HitDetail = "surface" if scene.transparent else "hit"
        if detail not in self._effects:
            module = "effects/shadows/shadow_rays.slang"
            self._effects[detail] = ray_effect(self._device, module, "ShadowRays", detail, self._tracer)
        return self._effects[detail]

    def _allocate(self, denoised: int, coloured: int) -> None:
        samples = max(denoised, coloured)
        if samples > self._sample_layers:
            self._sample_layers = samples
            self._device.give_back(self._samples)
            self._samples = self._device.texture("shadow samples", spy.Format.rgba16_float, self._size, layers=samples)
        if denoised > self._denoised:
            self._denoised = denoised
            self._device.give_back(self._slopes)
            self._slopes = self._device.texture("shadow slopes", spy.Format.r16_float, self._size, layers=denoised)
