"""Chooses the tracer of a frame's rays: the device's ray tracing pipeline, or a tracer of ray buffers."""

from functools import cached_property

import slangpy as spy

from pica.errors import DeviceError
from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.settings import RaysSettings
from pica.tracing import embree
from pica.tracing.fallbacks import say_once
from pica.tracing.ray_buffers import RayQueue, Tracer
from pica.tracing.ray_pipeline import RayPipeline, RayRecipe, ShaderSource


def uses_embree(device: Device, settings: RaysSettings) -> bool:
    """Whether ray buffers are traced by Embree. Raises DeviceError if it is requested and not installed."""
    missing = embree.missing()
    if settings.tracer == "embree" and missing:
        raise DeviceError(f"setting rays.tracer: Embree cannot trace, as {missing}")
    preferred = settings.tracer == "auto" and (device.is_software or not device.traces_rays)
    return settings.tracer == "embree" or (preferred and not missing)


class PipelineTracer:
    """Traces ray buffers with the device's own ray tracing pipeline."""

    def __init__(self, device: Device, scene: SceneView) -> None:
        recipe = RayRecipe(ShaderSource("tracing/trace_rays.slang"), "hit", simplified=False)
        self._pipeline = RayPipeline(device, "trace_rays", recipe)
        self._scene = scene

    def __call__(self, recording: Recording, queue: RayQueue) -> bool:
        """Record the tracing of the rays in the queue."""
        self._pipeline(
            recording,
            (queue.nearest + queue.shadows, 1),
            scene=self._scene,
            rays=queue.rays,
            hits=queue.hits,
            queue=queue.places,
            waiting=spy.uint2(queue.nearest, queue.shadows),
            capacity=queue.places.size // 4,
        )
        return False


class _ProcessorTracer:
    """Embree; the device's own pipelines while the scene has primitives, which only intersection shaders can find.

    Where the device has none, rays pass through primitives.
    """

    def __init__(self, device: Device, scene: SceneView) -> None:
        from pica.tracing.embree_tracer import EmbreeTracer  # LLVM and Embree are an extra

        self._device, self._scene = device, scene
        self._embree = EmbreeTracer(device, scene.rt_scene)

    @cached_property
    def _shaders(self) -> PipelineTracer:
        return PipelineTracer(self._device, self._scene)

    def __call__(self, recording: Recording, queue: RayQueue) -> bool:
        trace: Tracer = self._embree
        if self._scene.rt_scene.has_boxes and self._device.traces_rays:
            trace = self._shaders
        elif self._scene.rt_scene.has_boxes:
            say_once(
                self._device,
                f"device {self._device.name!r} has no ray tracing pipelines: rays pass through primitives that are not "
                "triangles",
            )
        return trace(recording, queue)


def buffer_tracer(device: Device, settings: RaysSettings, scene: SceneView) -> Tracer:
    """The tracer of ray buffers."""
    return _ProcessorTracer(device, scene) if uses_embree(device, settings) else PipelineTracer(device, scene)


def choose_tracer(device: Device, settings: RaysSettings, scene: SceneView) -> Tracer | None:
    """The tracer of ray buffers, or None where ray effects run as ray tracing pipelines."""
    if settings.scheduler == "pipeline":
        return None
    if settings.scheduler == "buffers" or uses_embree(device, settings):
        return buffer_tracer(device, settings, scene)
    return None
