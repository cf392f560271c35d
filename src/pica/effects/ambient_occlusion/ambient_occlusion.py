"""Ambient occlusion by rays or in screen space."""

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.ambient_occlusion.filter import OcclusionFilter, OcclusionHistory
from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.scene import GpuScene
from pica.rhi.device import Device
from pica.rhi.schedulers import Tracer, ray_effect
from pica.settings import AmbientOcclusionSettings

_FOLDER = "effects/ambient_occlusion"


class AmbientOcclusion:
    """Share of the cosine-weighted hemisphere about the shading normal that is open between min_distance and
    max_distance (seed 001, 25.2.3): a texture (width, height) whose red channel goes from 0 to 1; 1 where there is no
    surface.
    """

    def __init__(self, device: Device, size: Size, settings: AmbientOcclusionSettings, tracer: Tracer | None) -> None:
        self._settings = settings
        self._raw = device.texture("ambient occlusion raw", spy.Format.rg16_float, size)
        self._trace = self._search = self._history = self._filter = None
        if settings.mode == "ray_traced":
            self._trace = ray_effect(device, f"{_FOLDER}/occlusion_rays.slang", "OcclusionRays", "hit", tracer)
        else:
            self._search = device.compute(f"{_FOLDER}/horizons.slang")
        if settings.filter:
            self._history = OcclusionHistory(device, size)
            self._filter = OcclusionFilter(device, size)

    def reset(self) -> None:
        """Drop the history."""
        if self._history is not None:
            self._history.reset()

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, scene: GpuScene, moved: bool) -> spy.Texture:
        """The open share of this frame's G-buffer. `moved`: something differs from the frame before."""
        settings = self._settings
        lengths = {"minDistance": settings.min_distance, "maxDistance": settings.max_distance}
        shared = {"frame": frame, "gbuffer": gbuffer, "occlusion": self._raw, **lengths}
        if self._trace is not None:
            self._trace(frame, frame.size, scene=scene, rayCount=settings.rays, **shared)
        if self._search is not None:
            self._search(frame, frame.grid, **shared)
        if self._history is None:
            return self._raw
        signal = self._history(frame, gbuffer, self._raw, settings.rays, moved)
        return self._filter(frame, gbuffer, signal)


def open_share(texels: NDArray[np.float16]) -> NDArray[np.float32]:
    """(height, width) numbers from 0 to 1 of a texture that AmbientOcclusion returned, one channel or more."""
    channel = texels if texels.ndim == 2 else texels[..., 0]
    return np.clip(channel.astype(np.float32), 0, 1)
