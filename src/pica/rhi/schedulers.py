"""Two ways to run one ray effect: as a ray tracing pipeline, or as ray buffers around a tracer.

An effect is a Slang struct that implements IRayEffect (ray_effect.slang). Its entry points are the same few
lines for every effect, so they are written here once.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
import slangpy as spy

from pica.errors import BindingError
from pica.rhi.binding import ParameterBlock, ProgramParameters, parameters_of
from pica.rhi.device import Device
from pica.rhi.passes import Recording

Wants = Literal["hit", "surface"]
_EFFECT_MODULE = "rhi/ray_effect.slang"
_GROUP = 8
_ENTRIES = """
import rhi.ray_effect;
import {module};
RWStructuredBuffer<Ray> rays;
RWStructuredBuffer<{effect}.State> states;
RWStructuredBuffer<uint> going;
StructuredBuffer<Hit> hits;
uniform uint2 grid;
[shader("compute")] [numthreads({group}, {group}, 1)]
void start(uint3 thread : SV_DispatchThreadID)
{{
    if (all(thread.xy < grid)) runStart<{effect}>(thread.xy, thread.y * grid.x + thread.x, rays, states, going);
}}
[shader("compute")] [numthreads({group}, {group}, 1)]
void advance(uint3 thread : SV_DispatchThreadID)
{{
    if (all(thread.xy < grid))
        runAdvance<{effect}, Wants.{wants}>(thread.xy, thread.y * grid.x + thread.x, hits, rays, states, going);
}}
"""
_RAY_GENERATION = """
import rhi.ray_effect;
import {module};
[shader("raygeneration")]
void main() {{ runPipeline<{effect}, Wants.{wants}>(DispatchRaysIndex().xy); }}
"""


class _RayPipeline:
    """A ray generation shader with the hit shaders that go with what it wants."""

    def __init__(self, device: Device, name: str, generation: spy.SlangModule, wants: Wants) -> None:
        self.name = name
        shaders = device.handle.load_module(_EFFECT_MODULE)
        closest, any_hit, miss = f"{wants}Closest", f"{wants}Any", f"{wants}Miss"
        entries = [generation.entry_point("main"), *(shaders.entry_point(e) for e in (closest, any_hit, miss))]
        program = device.handle.link_program([generation, shaders], entries)
        group = spy.HitGroupDesc(hit_group_name="hit", closest_hit_entry_point=closest, any_hit_entry_point=any_hit)
        self.pipeline = device.handle.create_ray_tracing_pipeline(
            program=program, hit_groups=[group], max_recursion=1, max_ray_payload_size=64
        )
        self.table = device.handle.create_shader_table(
            program=program, ray_gen_entry_points=["main"], miss_entry_points=[miss], hit_group_names=["hit"]
        )
        self.parameters = ProgramParameters(device.handle, name, program)

    def __call__(self, recording: Recording, grid: tuple[int, int], /, **values: Any) -> None:
        self.parameters.bind(**values)
        self.parameters.check()
        recording.profiler.begin(recording.encoder, self.name)
        encoder = recording.encoder.begin_ray_tracing_pass()
        encoder.bind_pipeline(self.pipeline, self.table, self.parameters.root)
        encoder.dispatch_rays(0, (grid[0], grid[1], 1))
        encoder.end()
        recording.profiler.end(recording.encoder)


class PipelineEffect(_RayPipeline):
    """The effect as one ray generation shader that loops over its rays (tiers 2 and 3)."""

    def __init__(self, device: Device, module: str, effect: str, wants: Wants) -> None:
        name = Path(module).stem
        source = _RAY_GENERATION.format(module=_import_path(module), effect=effect, wants=wants)
        super().__init__(
            device, name, device.handle.load_module_from_source(f"{name}_{effect}_pipeline", source), wants
        )


Tracer = Callable[[Recording, int, spy.Buffer, spy.Buffer], None]
"""Fills the buffer of hits from the first `count` rays of the buffer of rays."""


class PipelineTracer:
    """Traces ray buffers with the device's own ray tracing pipeline."""

    def __init__(self, device: Device, scene: ParameterBlock) -> None:
        module = device.handle.load_module("rhi/trace_rays.slang")
        self._pipeline = _RayPipeline(device, "trace_rays", module, "hit")
        self._scene = scene

    def __call__(self, recording: Recording, count: int, rays: spy.Buffer, hits: spy.Buffer) -> None:
        """Record the tracing of `count` rays."""
        self._pipeline(recording, (count, 1), scene=self._scene, rays=rays, hits=hits)


class BufferEffect:
    """The effect as compute kernels around buffers of rays and hits (tier 1)."""

    def __init__(self, device: Device, module: str, effect: str, wants: Wants, tracer: Tracer) -> None:
        self.name = name = Path(module).stem
        self._device = device
        self._tracer = tracer
        source = _ENTRIES.format(module=_import_path(module), effect=effect, wants=wants, group=_GROUP)
        loaded = device.handle.load_module_from_source(f"{name}_{effect}_buffers", source)
        self._pipelines, self._parameters = [], []
        for entry in ("start", "advance"):
            program = device.handle.link_program([loaded], [loaded.entry_point(entry)])
            self._pipelines.append(device.handle.create_compute_pipeline(program))
            self._parameters.append(ProgramParameters(device.handle, f"{name} {entry}", program))
        self._strides = {
            parameter.name: parameter.type_layout.element_type_layout.stride
            for parameter in parameters_of(program)
            if parameter.name in ("rays", "states", "hits")
        }
        self._count = 0
        self._going = device.buffer("going", data=np.zeros(1, np.uint32), struct_size=4)

    def __call__(self, recording: Recording, grid: tuple[int, int], /, **values: Any) -> None:
        """Run the effect to its end. How many steps that takes is known only as they run, so each is submitted."""
        count = grid[0] * grid[1]
        if count != self._count:
            self._count = count
            self._buffers = {
                name: self._device.buffer(name, size=count * stride, struct_size=stride)
                for name, stride in self._strides.items()
            }
        values |= {"going": self._going, **self._buffers}
        self._step(0, recording, grid, values)
        while self._submit(recording):
            self._tracer(recording, count, self._buffers["rays"], self._buffers["hits"])
            self._step(1, recording, grid, values)

    def _step(self, which: int, recording: Recording, grid: tuple[int, int], values: dict[str, Any]) -> None:
        parameters = self._parameters[which]
        parameters.bind(**values, grid=spy.uint2(*grid))
        parameters.check()
        recording.encoder.clear_buffer(self._going)
        recording.profiler.begin(recording.encoder, f"{self.name} kernels")
        encoder = recording.encoder.begin_compute_pass()
        encoder.bind_pipeline(self._pipelines[which], parameters.root)
        encoder.dispatch((grid[0], grid[1], 1))
        encoder.end()
        recording.profiler.end(recording.encoder)

    def _submit(self, recording: Recording) -> bool:
        """Submit what is recorded so far and tell whether rays are left."""
        self._device.handle.submit_command_buffer(recording.encoder.finish())
        recording.encoder = self._device.handle.create_command_encoder()
        return bool(self._going.to_numpy().view(np.uint32)[0])


RayEffect = PipelineEffect | BufferEffect


def ray_effect(device: Device, module: str, effect: str, wants: Wants, tracer: Tracer | None = None) -> RayEffect:
    """The effect struct `effect` of `module` (a path below the package), run through ray buffers and `tracer`
    where one is given, else as a ray tracing pipeline.

    Raises BindingError when the module does not compile.
    """
    try:
        if tracer is not None:
            return BufferEffect(device, module, effect, wants, tracer)
        return PipelineEffect(device, module, effect, wants)
    except (RuntimeError, spy.SlangCompileError) as error:
        raise BindingError(f"{module}: {error}") from error


def _import_path(module: str) -> str:
    return module.removesuffix(".slang").replace("/", ".")
