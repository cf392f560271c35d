"""Ambient occlusion by rays or in screen space."""

import numpy as np
import slangpy as spy

from pica.effects.ambient_occlusion.filter import HorizonFilter, RayFilter
from pica.effects.ambient_occlusion.views import occlusion_views, open_share
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.frame.history import accumulate_grid
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device
from pica.settings import AmbientOcclusionSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/ambient_occlusion"


class AmbientOcclusion(Effect):
    """Share of the cosine-weighted hemisphere about the shading normal that is open between min_distance and
    max_distance (RTG 25, 25.2.3): a texture (width, height) whose red channel goes from 0 to 1; 1 where there is no
    surface.
    """

    name = "ambient_occlusion"
    aov_names = ("ambient_occlusion",)

    def __init__(
        self, device: Device, size: Size, settings: AmbientOcclusionSettings, tracer: Tracer | None, filters: bool
    ) -> None:
        """`filters`: DebugSettings.filters."""
        self._device, self._settings, self._filters = device, settings, filters
        self._trace = self._search = None
        self._depth: spy.Texture | None = None
        if settings.mode == "ray_traced":
            self._trace = ray_effect(device, f"{_FOLDER}/occlusion_rays.slang", "OcclusionRays", "hit", tracer)
        else:
            self._search = device.compute(f"{_FOLDER}/horizons.slang")
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        device, settings = self._device, self._settings
        self._raw = device.texture("ambient occlusion raw", spy.Format.rg16_float, size)
        self._filter: RayFilter | HorizonFilter | None = None
        if self._filters and settings.mode == "ray_traced":
            self._filter = RayFilter(device, size, settings.rays, settings.max_distance)
        elif self._filters:
            self._filter = HorizonFilter(device, size)
        self._open = self._raw

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(self._raw)
        if self._filter is not None:
            self._filter.give_back()
        self._allocate(size)

    def reset(self) -> None:
        """Drop the history."""
        if self._filter is not None:
            self._filter.reset()

    def aovs(self) -> dict[str, Aov]:
        """ambient_occlusion: how open each pixel's surroundings are, 0 to 1."""
        return {"ambient_occlusion": Aov((self._open,), open_share)}

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py."""
        return occlusion_views({"raw": self._raw, **(self._filter.debug_textures() if self._filter else {})})

    def ray_counts(self) -> dict[str, int]:
        """The same number from each pixel that shows a surface."""
        if self._trace is None or self._depth is None:
            return {}
        return {"occlusion_rays": int(np.count_nonzero(self._depth.to_numpy())) * self._settings.rays}

    def reference(self) -> Reference:
        """The open share by many rays."""
        lengths = {"minDistance": self._settings.min_distance, "maxDistance": self._settings.max_distance}
        layers = {"open": ReferenceLayer(self.aovs()["ambient_occlusion"], lengths)}
        inputs = "frame", "gbuffer", "scene"
        return Reference("path_tracer/ambient_visibility.slang", "AmbientVisibility", "hit", inputs, layers)

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView, reprojection: Reprojection
    ) -> spy.Texture:
        """The open share of this frame's G-buffer."""
        self._depth = gbuffer.textures["depth"]
        settings = self._settings
        lengths = {"minDistance": settings.min_distance, "maxDistance": settings.max_distance}
        shared = {"frame": frame, "gbuffer": gbuffer, "occlusion": self._raw, **lengths}
        if self._trace is not None:
            self._trace(frame, frame.size, scene=scene, rayCount=settings.rays, **shared)
        if self._search is not None:
            self._search(frame, accumulate_grid(frame.size), averaged=int(self._filters), **shared)
        self._open = self._raw if self._filter is None else self._filter(frame, gbuffer, self._raw, reprojection)
        return self._open
