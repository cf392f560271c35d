"""What traces the rays of a frame: the device's ray tracing pipeline, or a tracer of ray buffers."""

from functools import cached_property
from typing import Protocol

from pica.errors import DeviceError
from pica.rhi import embree
from pica.rhi.acceleration import RtScene
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.schedulers import PipelineTracer, RayQueue, SceneOnDevice, Tracer
from pica.settings import RaysSettings


def uses_embree(device: Device, settings: RaysSettings) -> bool:
    """Whether ray buffers are Embree's. Raises DeviceError when it is asked for and not installed."""
    missing = embree.missing()
    if settings.tracer == "embree" and missing:
        raise DeviceError(f"setting rays.tracer: Embree cannot trace, as {missing}")
    return settings.tracer == "embree" or (settings.tracer == "auto" and device.is_software and not missing)


class TraceableScene(SceneOnDevice, Protocol):
    """What a tracer must know of the scene."""

    @property
    def rt_scene(self) -> RtScene:
        """All objects, by slot."""


class _ProcessorTracer:
    """Embree; the device's own pipelines while the scene has primitives, which only intersection shaders can find."""

    def __init__(self, device: Device, scene: TraceableScene) -> None:
        from pica.rhi.embree_tracer import EmbreeTracer  # Numba and Embree are an extra

        self._device, self._scene = device, scene
        self._embree = EmbreeTracer(device, scene.rt_scene)

    @cached_property
    def _shaders(self) -> PipelineTracer:
        return PipelineTracer(self._device, self._scene)

    def __call__(self, recording: Recording, queue: RayQueue) -> None:
        trace = self._shaders if self._scene.rt_scene.has_boxes else self._embree
        trace(recording, queue)


def choose_tracer(device: Device, settings: RaysSettings, scene: TraceableScene) -> Tracer | None:
    """The tracer of ray buffers, or None where ray effects run as ray tracing pipelines."""
    if settings.scheduler == "pipeline":
        return None
    if uses_embree(device, settings):
        return _ProcessorTracer(device, scene)
    return PipelineTracer(device, scene) if settings.scheduler == "buffers" else None
