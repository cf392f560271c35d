"""What surfaces mirror: a quarter of a ray a pixel, rebuilt from neighbours and earlier frames (RTG 25, 25.2.2)."""

from typing import Any

import slangpy as spy

from pica.effects.reflections.own_rays import OwnRays
from pica.effects.reflections.screen_rays import ScreenRays
from pica.effects.reflections.traced_rays import TracedRays
from pica.effects.reflections.views import color, reflection_views
from pica.frame.context import FrameContext, Size, half_size
from pica.frame.effect import Aov, Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History
from pica.frame.indirect import ENDLESS, IndirectLight
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.ray_buffers import Tracer

_FOLDER = "effects/reflections"


class Reflections(Effect):
    """Adds the light that surfaces mirror of others, of emissive triangles and of the environment."""

    name = "reflections"
    aov_names = ("reflections",)

    def __init__(
        self,
        device: Device,
        size: Size,
        settings: ReflectionsSettings,
        tracer: Tracer | None,
        cache: str | None,
        filters: bool,
    ) -> None:
        """`cache`: the module of the cache of indirect light that the calls give, where they give one. `filters`:
        DebugSettings.filters."""
        self._device, self._cache, self._filters = device, cache, filters
        by_rays = settings.mode == "ray_traced"
        self._traced = TracedRays(device, size, settings, tracer, cache, filters) if by_rays else None
        self._screen = ScreenRays(device, size) if settings.mode == "screen_space" else None
        self._mirrors = settings.reconstruction == "mirror_rays" and filters
        step = "reconstruct_radiance" if self._mirrors else "reconstruct"
        self._reconstruct = programs(device).compute(f"{_FOLDER}/{step}.slang")
        self._accumulate = device.compute(f"{_FOLDER}/reflection_history.slang")
        self._filter = programs(device).compute(f"{_FOLDER}/reflection_filter.slang")
        self._own = OwnRays(device, size) if filters and not self._mirrors else None
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        light, half = spy.Format.rgba32_float, half_size(size)
        make = self._device.texture
        self._textures = {
            "ends": make("reflection ray ends", light, half),
            "light": make("reflected light", spy.Format.rgba32_uint, half),
            "reconstructed": make("reconstructed reflections", light, size),
            "distances": make("reflection distances", spy.Format.rg32_float, size),
            "signal": make("reflection signal", light, size),
            "reflected": make("reflections", light, size),
        }
        self._history = History(self._device, "reflections", {"history": light}, size, 1)
        self._newest: tuple[Size, dict[str, Any]] | None = None

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(*self._textures.values())
        self._history.give_back()
        self._allocate(size)
        for rays in (self._traced, self._screen, self._own):
            if rays is not None:
                rays.resize(size)

    def surroundings(self) -> spy.Texture | None:
        """Where the next call looks for what surfaces mirror of the prefiltered environment, (width, height,
        rgba32_float) over albedo; None: that is not for reflections to bring."""
        return None if self._screen is None else self._screen.surroundings

    def reset(self) -> None:
        """Drop the history."""
        self._history.reset()
        self._newest = None
        if self._own is not None:
            self._own.reset()

    def aovs(self) -> dict[str, Aov]:
        """reflections: (height, width, 3) the light that surfaces mirror, in nits."""
        return {"reflections": Aov((self._textures["reflected"],), color)}

    def reference(self) -> Reference | None:
        """The same by many rays; None where the picture alone is mirrored."""
        if self._traced is None:
            return None
        inputs = "frame", "gbuffer", "scene", "lightSlots"
        bounces = self._traced.bounces | ({"indirectBounces": ENDLESS} if self._cache else {})
        layers = {"reflections": ReferenceLayer(self.aovs()["reflections"], bounces)}
        return Reference("path_tracer/mirrored_light.slang", "MirroredLight", "surface", inputs, layers, is_light=True)

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py; what is of the frame before is made by a pass of its own, which nothing compiles before."""
        found = {**self._textures, **self._history.current}
        if self._newest is None:
            return reflection_views(found)
        size, newest = self._newest
        light = spy.Format.rgba32_float
        formats = {"ofSurface": light, "ofImage": light, "choice": spy.Format.rg32_float}
        past = {name: self._device.texture(f"reflections {name}", kind, size) for name, kind in formats.items()}
        with self._device.record() as recording:
            self._device.compute(f"{_FOLDER}/reflection_views.slang")(recording, (*size, 1), **newest, **past)
        self._device.give_back(*past.values())
        return reflection_views({**found, **past})

    def ray_counts(self) -> dict[str, int]:
        """Rays that followed a surface's lobe; those from what they met to a light are as many at most."""
        if self._traced is None:
            return {}
        return {"reflection_rays": self._traced.count(self._textures["ends"])}

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        reprojection: Reprojection,
        indirect: IndirectLight | None,
        radiance: spy.Texture,
    ) -> None:
        """Add what this frame's surfaces mirror to `radiance`. `indirect`: what else lights that; None: nothing."""
        textures, filtered = self._textures, self._filters
        mirrors = int(self._mirrors)
        if self._traced is not None:
            self._traced(frame, gbuffer, scene, light, indirect, textures["ends"], textures["light"], mirrors)
        if self._screen is not None:
            known = int(filtered and self._history.precedes(frame))
            shown = {"radiance": radiance, "reflected": textures["reflected"]}
            shown |= {"ends": textures["ends"], "light": textures["light"]}
            self._screen(frame, gbuffer, scene, reprojection, known=known, mirrors=mirrors, **shown)
        self._reconstruct(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            ends=textures["ends"],
            light=textures["light"],
            reconstructed=textures["reconstructed"],
            distances=textures["distances"],
            **({} if self._mirrors else {"filtered": int(filtered)}),
        )
        if filtered:
            history = self._history.turn(frame)
            found: dict[str, Any] = {name: textures[name] for name in ("reconstructed", "distances", "signal")}
            found |= {"gbuffer": gbuffer, "reprojection": reprojection, "previousHistory": history["previousHistory"]}
            known = int(not self._history.empty)
            self._newest = (frame.size, {"frame": frame.block, **found}) if known else None
            self._accumulate(frame, frame.grid, frame=frame, history=history["history"], known=known, **found)
        self._filter(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            signal=textures["signal" if filtered else "reconstructed"],
            reflected=textures["reflected"],
            radiance=radiance,
        )
        if self._own is not None:
            single = textures["light"] if self._traced is None else self._traced.single
            shown = {"reflected": textures["reflected"], "radiance": radiance}
            self._own(frame, gbuffer, scene, reprojection.unchanged, textures["ends"], single, **shown)
