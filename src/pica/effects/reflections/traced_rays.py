"""Reflections' rays through the scene, and what lights what they meet."""

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext, Size, half_size
from pica.frame.gbuffer import GBuffer
from pica.frame.indirect import IndirectLight
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import PATHS, ray_effect


class TracedRays:
    """A ray for 2x2 pixels along the lobe that the surface mirrors, and one from what it meets to a light."""

    def __init__(
        self,
        device: Device,
        size: Size,
        settings: ReflectionsSettings,
        tracer: Tracer | None,
        cache: str | None,
        filters: bool,
    ) -> None:
        """`cache`, `filters`: as Reflections has them."""
        self._device, self._filters = device, filters
        self.bounces = {"bounces": settings.bounces, "indirectBounces": 0}
        """Surfaces that paths may meet, by the names that shaders have for these limits."""
        module = "effects/reflections/reflection_rays.slang"
        self._trace = ray_effect(
            device, module, "ReflectionRays", "surface", tracer, simplified=True, with_module=cache, parts=PATHS
        )
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

    def count(self, ends: spy.Texture) -> int:
        """Rays of the newest frame that were traced along lobes; `ends` as in the call."""
        return int(np.count_nonzero(ends.to_numpy()[..., 3]))

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
    ) -> None:
        """Trace, and write `ends` and `light`, textures of half size, as reflected.slang has them; `mirrors` as there.

        `indirect`: None where there is no global illumination.
        """
        self.bounces["indirectBounces"] = indirect.bounces if indirect else 0
        half, smooth = frame.at_half(), self._filters
        known = {
            "arriving": indirect.arriving if indirect else self._nothing,
            "arrivingKnown": int(indirect is not None and indirect.known),
        }
        written = {"ends": ends, "light": self.single if smooth else light, "met": self._met}
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
            mirrors=mirrors,
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
