"""Indirect light by paths from the pixels, a quarter a pixel, and a filter (RTG 19, 19.3.3.3 and 19.3.3.4)."""

from collections.abc import Mapping

import numpy as np
import slangpy as spy

from pica.effects.global_illumination.path_resampling import PathResampling
from pica.effects.global_illumination.views import indirect_views
from pica.frame.context import FrameContext, Size, half_size
from pica.frame.effect import Aov
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History, accumulate_grid
from pica.frame.indirect import ENDLESS
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.light_map.gpu_light_map import GpuLightMap, light_map_cache
from pica.light_map.light_map import LightMap
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import GlobalIlluminationSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import PATHS, ray_effect

_FOLDER = "effects/global_illumination"


class PathTracedIndirect:
    """Indirect light by paths from the pixels; with the mode `restir` each is chosen from many."""

    def __init__(
        self,
        device: Device,
        size: Size,
        settings: GlobalIlluminationSettings,
        tracer: Tracer | None,
        light_map: LightMap | None,
        filters: bool,
    ) -> None:
        """`filters`: DebugSettings.filters."""
        self._device, self._settings = device, settings
        self.is_smooth = filters
        """Whether the light in each pixel is the mean of many rays."""
        self._asks_picture = filters and settings.bounces > 1
        self.bounces = ENDLESS if self._asks_picture else settings.bounces
        asks_map = light_map is not None and self._asks_picture
        self.cache = light_map_cache(GpuLightMap(device, light_map)) if light_map and asks_map else None
        module, cache = f"{_FOLDER}/indirect_rays.slang", self.cache.module if self.cache else None
        parts = PATHS if settings.bounces > 1 else ()
        self._trace = ray_effect(device, module, "IndirectRays", "surface", tracer, True, cache, parts=parts)
        self._gather = device.compute(f"{_FOLDER}/irradiance_gather.slang")
        self._widen = device.compute(f"{_FOLDER}/irradiance_atrous.slang")
        self._accumulate = device.compute(f"{_FOLDER}/irradiance_history.slang")
        self._filter = programs(device).compute(f"{_FOLDER}/irradiance_filter.slang")
        self._resampling = PathResampling(device, size, tracer) if settings.mode == "restir" else None
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        light, half = spy.Format.rgba32_float, half_size(size)
        make = self._device.texture
        self._textures = {
            "found": make("indirect light of rays", light, half),
            "met": make("what indirect rays met", spy.Format.rg32_uint, half if self._resampling else (1, 1)),
            "gathered": make("indirect light gathered", light, half),
            "widened": make("indirect light gathered widely", light, half),
            "nearness": make("nearness of indirect light", spy.Format.r32_float, half),
            "signal": make("indirect light accumulated", light, size),
        }
        formats = {"history": light, "moments": light}
        self._history = History(self._device, "indirect light", formats, size, layers=1)

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._device.give_back(*self._textures.values())
        self._history.give_back()
        if self._resampling is not None:
            self._resampling.resize(size)
        self._allocate(size)

    def reset(self) -> None:
        """Drop the history."""
        self._history.reset()
        if self._resampling is not None:
            self._resampling.reset()

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py."""
        return indirect_views({**self._textures, **self._history.current})

    def ray_counts(self) -> dict[str, int]:
        """First rays of the paths; those to lights and further on are as many at most, for each bounce."""
        return {"indirect_rays": int(np.count_nonzero(self._textures["found"].to_numpy()[..., 3]))}

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        reprojection: Reprojection,
        pictures: Mapping[str, spy.Texture],
    ) -> None:
        """Write this frame's to the pictures `arriving` and `indirect` and add it to `radiance`."""
        textures, settings, half = self._textures, self._settings, frame.at_half()
        self._trace(
            half,
            half.size,
            frame=half,
            gbuffer=gbuffer.at_half(frame),
            scene=scene,
            reprojection=reprojection,
            bounces=settings.bounces,
            previousHistory=self._history.current["history"],
            known=int(self._asks_picture and self._history.precedes(frame)),
            **light.at_hits(regularized=self.is_smooth),
            resampled=int(self._resampling is not None),
            found=textures["found"],
            met=textures["met"],
            **(self.cache.values if self.cache else {}),
        )
        if self._resampling is not None:
            self._resampling(frame, gbuffer, scene, reprojection, textures["found"], textures["met"])
        if self.is_smooth:
            self._smooth(frame, gbuffer, reprojection)
        self._filter(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            found=textures["found"],
            signal=textures["signal"],
            nearness=textures["nearness"],
            smooth=int(self.is_smooth),
            **pictures,
        )

    def _smooth(self, frame: FrameContext, gbuffer: GBuffer, reprojection: Reprojection) -> None:
        """Over neighbours' rays and earlier frames."""
        textures, half = self._textures, frame.at_half()
        self._gather(
            half,
            half.grid,
            frame=half,
            gbuffer=gbuffer.at_half(frame),
            found=textures["found"],
            gathered=textures["gathered"],
            nearness=textures["nearness"],
        )
        self._widen(
            half,
            half.grid,
            frame=half,
            gbuffer=gbuffer.at_half(frame),
            gathered=textures["gathered"],
            nearness=textures["nearness"],
            widened=textures["widened"],
        )
        self._accumulate(
            frame,
            accumulate_grid(frame.size),
            frame=frame,
            gbuffer=gbuffer,
            reprojection=reprojection,
            gathered=textures["widened"],
            signal=textures["signal"],
            **self._history.turn(frame),
            known=int(not self._history.empty),
        )
