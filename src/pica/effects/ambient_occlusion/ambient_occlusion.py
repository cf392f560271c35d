"""Ambient occlusion by rays or in screen space."""

import slangpy as spy

from pica.effects.ambient_occlusion.filter import HorizonFilter, RayFilter
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
        self._filter: RayFilter | HorizonFilter | None = None
        self._trace = self._search = None
        if settings.mode == "ray_traced":
            self._trace = ray_effect(device, f"{_FOLDER}/occlusion_rays.slang", "OcclusionRays", "hit", tracer)
            self._filter = RayFilter(device, size, settings.rays, settings.max_distance) if settings.filter else None
        else:
            self._search = device.compute(f"{_FOLDER}/horizons.slang")
            self._filter = HorizonFilter(device, size) if settings.filter else None

    def reset(self) -> None:
        """Drop the history."""
        if self._filter is not None:
            self._filter.reset()

    def debug_views(self) -> dict[str, spy.Texture]:
        """What can be shown of the newest frame, by name: see views.py."""
        return {"raw": self._raw, **(self._filter.debug_views() if self._filter else {})}

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, scene: GpuScene, moved: bool) -> spy.Texture:
        """The open share of this frame's G-buffer. `moved`: something differs from the frame before."""
        settings = self._settings
        lengths = {"minDistance": settings.min_distance, "maxDistance": settings.max_distance}
        shared = {"frame": frame, "gbuffer": gbuffer, "occlusion": self._raw, **lengths}
        if self._trace is not None:
            self._trace(frame, frame.size, scene=scene, rayCount=settings.rays, **shared)
        if self._search is not None:
            self._search(frame, frame.grid, **shared)
        return self._raw if self._filter is None else self._filter(frame, gbuffer, self._raw, moved)
