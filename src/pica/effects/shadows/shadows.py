"""Shadows of all light slots: one ray a pixel and slot; those of the strongest soft lights are filtered."""

from dataclasses import dataclass

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.lighting.light_slots import LightSlots
from pica.effects.shadows.denoiser import ShadowDenoiser
from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.scene import GpuScene
from pica.rhi.device import Device
from pica.rhi.schedulers import RayEffect, Tracer, Wants, ray_effect
from pica.settings import ShadowsSettings


@dataclass(frozen=True)
class ShadowTextures:
    """What the shadows of a frame are."""

    bits: spy.Texture
    """(width, height, rg32_uint) one bit a slot. Red: the light's sample is not hidden; green: a ray was traced."""
    filtered: spy.Texture
    """(width, height, denoised slots, rgba16_float) share of a slot's light that reaches the pixel, 0 to 1."""
    samples: spy.Texture | None = None
    """(width, height, slots, rgba16_float) this frame's samples, weighted; where rays go through surfaces."""


class Shadows:
    """Which part of each light reaches each pixel."""

    def __init__(self, device: Device, size: Size, settings: ShadowsSettings, tracer: Tracer | None = None) -> None:
        self._device, self._size, self._tracer = device, size, tracer
        self._bits = device.texture("shadow visibility", spy.Format.rg32_uint, size)
        self._samples = device.texture("shadow samples", spy.Format.rgba16_float, (1, 1), layers=1)
        self._slopes = device.texture("shadow slopes", spy.Format.r16_float, (1, 1), layers=1)
        self._sample_layers = self._denoised = 0
        self._denoiser = ShadowDenoiser(device, size, settings.history)
        self._effects: dict[Wants, RayEffect] = {}
        self._rays("hit")

    def reset(self) -> None:
        """Drop the history."""
        self._denoiser.reset()

    def debug_views(self) -> dict[str, spy.Texture]:
        """What can be shown of the newest frame, by name: see views.py. Nothing without denoised slots."""
        return {"samples": self._samples, **self._denoiser.debug_views()} if self._denoised else {}

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, scene: GpuScene, slots: LightSlots, moved: bool
    ) -> ShadowTextures:
        """The visibility of this frame's light samples, and the shadows that many of them make.

        `moved`: something differs from the frame before.
        """
        self._allocate(len(slots.denoised), slots.count if scene.transparent else 0)
        self._rays("surface" if scene.transparent else "hit")(
            frame,
            frame.size,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightSlots=slots,
            reservoirs=slots.reservoirs,
            visibility=self._bits,
            samples=self._samples,
            slopes=self._slopes,
        )
        coloured = self._samples if scene.transparent else None
        if not slots.denoised:
            return ShadowTextures(self._bits, self._samples, coloured)
        filtered = self._denoiser(frame, gbuffer, scene, slots, self._samples, self._slopes, moved)
        return ShadowTextures(self._bits, filtered, coloured)

    def _rays(self, wants: Wants) -> RayEffect:
        """Only where light goes through surfaces must the rays know their materials."""
        if wants not in self._effects:
            module = "effects/shadows/shadow_rays.slang"
            self._effects[wants] = ray_effect(self._device, module, "ShadowRays", wants, self._tracer)
        return self._effects[wants]

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


def visibility_layers(bits: NDArray[np.uint32], slots: int) -> NDArray[np.float32]:
    """(height, width, 2) bits as (height, width, slots) numbers, 1 where the light's sample was not hidden."""
    return ((bits[..., :1] >> np.arange(slots, dtype=np.uint32)) & 1).astype(np.float32)
