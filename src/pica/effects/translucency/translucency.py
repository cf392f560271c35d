"""Light that passes surfaces diffusely: through sheets, and through solids that scatter it (RTG 25, 25.2.5)."""

from functools import cached_property
from typing import Any

import numpy as np
import slangpy as spy

from pica.filtering.accumulation import accumulate_grid
from pica.filtering.convergence import COMPLETE_FROM
from pica.frame.aovs import light_of
from pica.frame.context import FrameContext
from pica.frame.effect import Effect
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.frame.signals.light import SIGNAL
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Lifetime, Texture, update, write
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device
from pica.settings import TranslucencySettings
from pica.texture_space.texture_maps import TextureMaps
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import RayEffect, ray_effect

_FOLDER = "effects/translucency"
_ESTIMATOR = 48
"""Bytes: multiscale_mean.slang."""


class Translucency(Effect):
    """Paths below surfaces with diffuse transmission, from the texels of their maps."""

    name = "translucency"
    aov_names = ("subsurface",)

    def __init__(
        self, device: Device, settings: TranslucencySettings, tracer: Tracer | None, cache: str | None
    ) -> None:
        """`cache`: the module of the cache of indirect light, if calls pass one."""
        self._device, self._settings, self._tracer, self._cache = device, settings, tracer, cache
        self._interval = settings.interval or (2 if device.is_software else 1)
        self._scene, self._unchanged, self._number = -1, 0, 0

    @cached_property
    def maps(self) -> TextureMaps:
        """Made for the first scene that has any."""
        return TextureMaps(self._device, 1 << self._settings.map_size.bit_length() - 1)

    @cached_property
    def _trace(self) -> RayEffect:
        module = f"{_FOLDER}/map_rays.slang"
        return ray_effect(self._device, module, "MapRays", "surface", self._tracer, True, with_module=self._cache)

    @cached_property
    def _trace_screen(self) -> RayEffect:
        module = f"{_FOLDER}/screen_rays.slang"
        return ray_effect(self._device, module, "ScreenRays", "surface", self._tracer, True, with_module=self._cache)

    @cached_property
    def _accumulate(self) -> MaterialPass:
        return programs(self._device).compute(f"{_FOLDER}/screen_history.slang")

    @cached_property
    def _look_up(self) -> MaterialPass:
        return programs(self._device).compute(f"{_FOLDER}/map_lookup.slang")

    @cached_property
    def _apply(self) -> MaterialPass:
        return programs(self._device).compute(f"{_FOLDER}/translucency_apply.slang")

    def reset(self) -> None:
        """Forget the maps' light."""
        self._unchanged = 0
        if "maps" in self.__dict__:
            self.maps.reset()

    def works_by_pixel(self, scene: SceneView) -> bool:
        """Whether paths are needed for surfaces without a map: the frame is declared again when it changes."""
        without = "maps" in self.__dict__ and self.maps.leaves_out
        return scene.translucent and (self._settings.mode == "screen_space" or scene.sheets or without)

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        scene: SceneView,
        samples: LightSamples,
        indirect: IndirectResult | None,
        exposure: Buffer,
    ) -> Texture | None:
        """Light towards the camera, as frame/signals/light.py has it; None if the scene has no such surfaces."""
        with graph.scope(self.name):
            if not scene.translucent:
                graph.offer("subsurface", (gbuffer.textures["depth"],), lambda depth: np.zeros((*depth.shape[:2], 3)))
                return None
            maps, side = self.maps, self.maps.side
            graph.record("follow scene", self._follow, scene=scene)
            maps.declare(graph, scene, self._settings.mode == "texture_space")
            light = graph.texture("light of texels", spy.Format.rgba32_float, (side, side), lifetime=Lifetime.KEPT)
            estimators = graph.buffer("estimators", _ESTIMATOR * side * side, struct_size=_ESTIMATOR)
            drift = graph.history("drift", {"drift": spy.Format.r32_float}, (side, side)).textures["drift"]
            last_seen = graph.buffer("last seen", 4 * maps.room, struct_size=4)
            number = {"number": lambda frame: self._number}
            path = {
                **samples.at_hits(regularized=True),
                "scatterings": self._settings.scatterings,
                **(indirect.cache.values if indirect and indirect.cache else {}),
            }
            graph.add(
                self._trace,
                (side, side),
                when=lambda frame: maps.count > 0,
                **path,
                estimators=update(estimators),
                light=update(light),
                drift=write(drift),
                previousDrift=drift.previous,
                lastSeen=last_seen,
                exposure=exposure,
                interval=self._interval,
                settled=lambda frame: int(self._unchanged > COMPLETE_FROM),
                changed=lambda frame: int(maps.changed),
                **number,
            )
            paths = lambda light: int(np.count_nonzero(light[..., 3] >= 0)) // self._interval  # noqa: E731
            graph.offer("rays.map_rays", (light,), paths, on_request=True)
            signal = graph.texture("signal", spy.Format.rgba32_float)
            by_pixel = self.works_by_pixel(scene)
            if by_pixel:
                self._trace_pixels(graph, path, signal)
            reflected = graph.texture("light", SIGNAL)
            graph.add(
                self._look_up,
                graph.grid,
                light=light,
                signal=update(signal) if by_pixel else write(signal),
                lastSeen=update(last_seen),
                **number,
            )
            graph.add(self._apply, graph.grid, signal=signal, reflected=write(reflected))
            graph.offer("subsurface", (reflected,), light_of)
            graph.offer("debug.translucency.maps", (light,), lambda values: values[..., :3], on_request=True)
        return reflected

    def _trace_pixels(self, graph: FrameGraph, path: dict[str, Any], signal: Texture) -> None:
        """Fill `signal`, as screen_history.slang has it, with light that passes surfaces without a map."""
        samples = graph.texture("samples", spy.Format.rgba32_float)
        history = graph.history("history", {"history": spy.Format.rgba32_uint}, layers=1)
        graph.add(self._trace_screen, graph.size, **path, samples=write(samples))
        graph.add(
            self._accumulate,
            accumulate_grid(graph.size),
            samples=samples,
            signal=write(signal),
            known=history.known,
            **history.swap(),
        )

    def _follow(self, frame: FrameContext, scene: SceneView) -> None:
        self._unchanged = self._unchanged + 1 if scene.revision == self._scene else 0
        self._scene = scene.revision
        self._number += 1
