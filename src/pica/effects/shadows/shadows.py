"""Shadows of all light slots: one ray a pixel and slot, unfiltered."""

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.lighting.light_slots import LightSlots
from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.scene import GpuScene
from pica.rhi.device import Device
from pica.rhi.schedulers import Tracer, ray_effect


class Shadows:
    """Which light slots reach each pixel: a texture (width, height, rg32_uint) with one bit a slot.

    Red: the light's sample is not hidden. Green: a ray was traced to find out.
    """

    def __init__(self, device: Device, size: Size, tracer: Tracer | None = None) -> None:
        self._visibility = device.texture("shadow visibility", spy.Format.rg32_uint, size)
        self._trace = ray_effect(device, "effects/shadows/shadow_rays.slang", "ShadowRays", "hit", tracer)

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, scene: GpuScene, slots: LightSlots) -> spy.Texture:
        """The visibility of this frame's light samples."""
        self._trace(
            frame,
            frame.size,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightSlots=slots,
            visibility=self._visibility,
        )
        return self._visibility


def visibility_layers(bits: NDArray[np.uint32], slots: int) -> NDArray[np.float32]:
    """(height, width, 2) bits as (height, width, slots) numbers, 1 where the light's sample was not hidden."""
    return ((bits[..., :1] >> np.arange(slots, dtype=np.uint32)) & 1).astype(np.float32)
