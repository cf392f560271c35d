"""Reflections' rays through the scene, and what lights what they meet."""

from pica.frame.context import FrameContext
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect


class TracedRays:
    """A ray for 2x2 pixels along the lobe that the surface mirrors, and one from what it meets to a light."""

    def __init__(self, device: Device, settings: ReflectionsSettings, tracer: Tracer | None) -> None:
        self._settings = settings
        module = "effects/reflections/reflection_rays.slang"
        self._trace = ray_effect(device, module, "ReflectionRays", "surface", tracer, simplified=True)

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView, samples: LightSamples, **found: object
    ) -> None:
        """Trace. `found`: `ends` and `light`, textures of half size, as reflected.slang has them."""
        half = frame.at_half()
        self._trace(
            half,
            half.size,
            frame=half,
            gbuffer=gbuffer.at_half(frame),
            scene=scene,
            bounces=self._settings.bounces,
            **samples.at_hits(regularized=self._settings.filter),
            **found,
        )
