"""Reflections' rays through the scene, and what lights what they meet."""

import numpy as np
import slangpy as spy

from pica.effects.reflections.screen_rays import DepthMarch
from pica.frame.context import FrameContext, Size, half_size
from pica.frame.gbuffer import GBuffer
from pica.frame.indirect import IndirectLight
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import PATHS, ray_effect

_FROM_PICTURE = 1 << 31
"""reflected.slang: FROM_PICTURE."""


class TracedRays:
    """A ray for 2x2 pixels along the lobe that the surface mirrors, and one from what it meets to a light."""

    def __init__(
        self, device: Device, size: Size, settings: ReflectionsSettings, tracer: Tracer | None, cache: str | None
    ) -> None:
        """`cache`: the module of the cache of indirect light that the calls give, where they give one."""
        self._device, self._settings = device, settings
        self.bounces = {"bounces": settings.bounces, "indirectBounces": 0}
        """Surfaces that paths may meet, by the names that shaders have for these limits."""
        module = "effects/reflections/reflection_rays.slang"
        self._trace = ray_effect(
            device, module, "ReflectionRays", "surface", tracer, simplified=True, with_module=cache, parts=PATHS
        )
        # The picture does not show lights with a shape.
        first = settings.screen_space_first and not settings.area_lights
        self._first = DepthMarch(device, size, "screen_first") if first else None
        self._gather = device.compute("effects/reflections/gather_lighting.slang")
        self._nothing = device.texture("no indirect light", spy.Format.rgba32_float, (1, 1))
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        half = half_size(size)
        self._met = self._device.texture("what reflection rays met", spy.Format.rg32_uint, half)
        self.single = self._device.texture("light of single reflection rays", spy.Format.rgba32_uint, half)
        """What each ray brought, as `light` in the call, before neighbours lend theirs; only with filters."""

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._device.give_back(self._met, self.single)
        self._allocate(size)
        if self._first is not None:
            self._first.resize(size)

    def count(self, ends: spy.Texture) -> int:
        """Rays of the newest frame that were traced along lobes; `ends` as in the call."""
        traced = ends.to_numpy()[..., 3] != 0
        if self._first is not None:
            traced &= self._met.to_numpy()[..., 1] < _FROM_PICTURE
        return int(np.count_nonzero(traced))

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        samples: LightSamples,
        indirect: IndirectLight | None,
        ends: spy.Texture,
        light: spy.Texture,
        mirrors: int,
        radiance: spy.Texture,
    ) -> None:
        """Trace, and write `ends` and `light`, textures of half size, as reflected.slang has them; `mirrors` as there.

        `indirect`: None where there is no global illumination. `radiance`: this frame's picture without reflections.
        """
        self.bounces["indirectBounces"] = indirect.bounces if indirect else 0
        half, smooth = frame.at_half(), self._settings.filter
        known = {
            "arriving": indirect.arriving if indirect else self._nothing,
            "arrivingKnown": int(indirect is not None and indirect.known),
        }
        written = {"ends": ends, "light": self.single if smooth else light, "met": self._met}
        drawn = {"mirrors": mirrors, "mirrorBias": self._settings.mirror_bias}
        if self._first is not None:
            self._first(frame, gbuffer, scene, radiance=radiance, **drawn, **known, **written)
        self._trace(
            half,
            half.size,
            frame=half,
            gbuffer=gbuffer.at_half(frame),
            scene=scene,
            **self.bounces,
            **known,
            **samples.at_hits(regularized=smooth),
            **written,
            **drawn,
            screenFirst=int(self._first is not None),
            **(indirect.cache.values if indirect and indirect.cache else {}),
        )
        if smooth:
            self._gather(
                half,
                half.grid,
                frame=half,
                gbuffer=gbuffer.at_half(frame),
                ends=ends,
                met=self._met,
                light=self.single,
                gathered=light,
            )
