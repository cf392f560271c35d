"""Two ways to run one ray effect: as a ray tracing pipeline, or as ray buffers around a tracer.

An effect is a Slang struct that implements IRayEffect (ray_effect.slang). Its entry points are the same few
lines for every effect, so they are written here once; so are the hit shaders of a material type.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
import slangpy as spy

from pica.errors import BindingError
from pica.rhi.binding import ParameterBlock, ProgramParameters, parameters_of
from pica.rhi.device import Device
from pica.rhi.host_memory import HostBuffer
from pica.rhi.material_types import STANDARD_ONLY, MaterialType, MaterialTypeSet, ShapeOn
from pica.rhi.passes import Recording
from pica.rhi.programs import ForTypes

Wants = Literal["hit", "surface"]
_EFFECT_MODULE = "rhi/ray_effect.slang"
_GROUP = 8
_LINE = 64
_SLANG_BOOL = {True: "true", False: "false"}
_ENTRIES = """
import rhi.ray_effect;
import {module};
RWStructuredBuffer<Ray> rays;
RWStructuredBuffer<{effect}.State> states;
StructuredBuffer<Hit> hits;
StructuredBuffer<uint> queue;
RWStructuredBuffer<uint> next;
RWStructuredBuffer<uint> counts;
uniform uint2 grid;
uniform uint2 waiting;
[shader("compute")] [numthreads({group}, {group}, 1)]
void start(uint3 thread : SV_DispatchThreadID)
{{
    if (all(thread.xy < grid)) runStart<{effect}>(thread.xy, grid, rays, states, next, counts);
}}
[shader("compute")] [numthreads({line}, 1, 1)]
void advance(uint3 thread : SV_DispatchThreadID)
{{
    if (thread.x < waiting.x + waiting.y)
    {{
        uint index = queue[placeInQueue(thread.x, waiting, grid)];
        runAdvance<{effect}, Wants.{wants}, {simplified}>(index, grid, hits, rays, states, next, counts);
    }}
}}
"""
_RAY_GENERATION = """
import rhi.ray_effect;
import {module};
[shader("raygeneration")]
void main() {{ runPipeline<{effect}, Wants.{wants}>(DispatchRaysIndex().xy); }}
"""
_ANY_HIT = """
import rhi.ray_effect;
import {alias};
[shader("anyhit")]
void any_{name}(inout {payload} payload, BuiltInTriangleIntersectionAttributes attributes)
{{
    ignoreUncovered<{struct}>(attributes.barycentrics, payload.seed);
}}
"""
_CLOSEST_HIT = """
[shader("closesthit")]
void closest_{name}(inout PackedSurface payload, BuiltInTriangleIntersectionAttributes attributes)
{{
    payload = closestSurface<{struct}, {simplified}>(attributes.barycentrics);
}}
"""


class SceneOnDevice(Protocol):
    """What a ray effect must know of the scene that it traces."""

    @property
    def block(self) -> ParameterBlock:
        """The parameter block `scene`."""

    @property
    def material_types(self) -> MaterialTypeSet:
        """The material types in use, in the order of the hit groups that its objects name."""


@dataclass(frozen=True)
class ShaderSource:
    """A Slang module: source under a name of its own, or (without text) a file below the package."""

    name: str
    text: str = ""

    def loaded(self, device: Device) -> spy.SlangModule:
        """The module; a device loads it once."""
        if self.text:
            return device.handle.load_module_from_source(self.name, self.text)
        return device.handle.load_module(self.name)


@dataclass(frozen=True)
class RayRecipe:
    """A ray generation shader linked with the hit shaders of some material types: one hit group a type."""

    generation: ShaderSource
    wants: Wants
    simplified: bool

    def link(
        self, device: Device, types: MaterialTypeSet
    ) -> tuple[spy.ShaderProgram, list[spy.HitGroupDesc], list[str]]:
        """The program, its hit groups and their names."""
        generation, wants = self.generation.loaded(device), self.wants
        shaders = device.handle.load_module(_EFFECT_MODULE)
        modules = [generation, shaders, *device.linked(types)]
        entries = [generation.entry_point("main"), shaders.entry_point(f"{wants}Miss")]
        if wants == "hit":
            entries.append(shaders.entry_point("hitClosest"))
        groups = []
        for entry in types:
            if isinstance(entry, ShapeOn):
                own_modules, own_entries, group = device.shape_types.hit_group(
                    entry, device.material_types[entry.material], wants, self.simplified
                )
                modules, entries = [*modules, *own_modules], [*entries, *own_entries]
                groups.append(group)
                continue
            material_type = device.material_types[entry]
            module = _hit_shaders(device, material_type, wants, self.simplified)
            modules.append(module)
            any_hit, closest = f"any_{material_type.name}", f"closest_{material_type.name}"
            entries.append(module.entry_point(any_hit))
            if wants == "surface":
                entries.append(module.entry_point(closest))
            groups.append(
                spy.HitGroupDesc(
                    hit_group_name=material_type.name,
                    closest_hit_entry_point=closest if wants == "surface" else "hitClosest",
                    any_hit_entry_point=any_hit,
                )
            )
        return device.handle.link_program(modules, entries), groups, [entry.name for entry in types]

    def make(
        self, device: Device, linked: tuple[spy.ShaderProgram, list[spy.HitGroupDesc], list[str]]
    ) -> tuple[spy.ShaderProgram, spy.RayTracingPipeline, spy.ShaderTable]:
        """Program, pipeline and shader table."""
        program, groups, names = linked
        pipeline = device.handle.create_ray_tracing_pipeline(
            program=program, hit_groups=groups, max_recursion=1, max_ray_payload_size=64
        )
        table = device.handle.create_shader_table(
            program=program,
            ray_gen_entry_points=["main"],
            miss_entry_points=[f"{self.wants}Miss"],
            hit_group_names=names,
        )
        return program, pipeline, table


class _RayProgram:
    def __init__(
        self,
        device: Device,
        name: str,
        program: spy.ShaderProgram,
        pipeline: spy.RayTracingPipeline,
        table: spy.ShaderTable,
    ) -> None:
        self.pipeline, self.table = pipeline, table
        self.parameters = ProgramParameters(device.handle, name, program)


def _types_of(values: dict[str, Any]) -> MaterialTypeSet:
    scene: SceneOnDevice | None = values.get("scene")
    return STANDARD_ONLY if scene is None else scene.material_types


def _hit_shaders(device: Device, material_type: MaterialType, wants: Wants, simplified: bool) -> spy.SlangModule:
    source, payload, name = _ANY_HIT, "HitPayload", f"{wants}_{material_type.alias}"
    if wants == "surface":
        source, payload = _ANY_HIT + _CLOSEST_HIT, "PackedSurface"
        name += "_simplified" if simplified else ""
    text = source.format(
        alias=material_type.alias,
        name=material_type.name,
        struct=material_type.struct,
        payload=payload,
        simplified=_SLANG_BOOL[simplified],
    )
    return device.handle.load_module_from_source(name, text)


class _RayPipeline:
    """A ray generation shader with the hit shaders that go with what it wants and with the scene's material types."""

    def __init__(
        self, device: Device, name: str, generation: ShaderSource, wants: Wants, simplified: bool = False
    ) -> None:
        self.name = name
        generation.loaded(device)  # a fault shows here, not in the first frame
        recipe = RayRecipe(generation, wants, simplified)
        self._program = ForTypes(device, recipe, lambda made: _RayProgram(device, name, *made))

    def __call__(self, recording: Recording, grid: tuple[int, int], /, **values: Any) -> None:
        program = self._program(_types_of(values))
        program.parameters.bind(**values)
        program.parameters.check()
        recording.profiler.begin(recording.encoder, self.name)
        encoder = recording.encoder.begin_ray_tracing_pass()
        encoder.bind_pipeline(program.pipeline, program.table, program.parameters.root)
        encoder.dispatch_rays(0, (grid[0], grid[1], 1))
        encoder.end()
        recording.profiler.end(recording.encoder)


class PipelineEffect(_RayPipeline):
    """The effect as one ray generation shader that loops over its rays (tiers 2 and 3)."""

    def __init__(self, device: Device, module: str, effect: str, wants: Wants, simplified: bool) -> None:
        name = Path(module).stem
        source = _RAY_GENERATION.format(module=_import_path(module), effect=effect, wants=wants)
        super().__init__(device, name, ShaderSource(f"{name}_{effect}_{wants}_pipeline", source), wants, simplified)


@dataclass(frozen=True)
class RayQueue:
    """Rays that wait to be traced: those for a nearest surface first in `places`, shadow rays from its end."""

    rays: spy.Buffer
    """40 bytes each (Ray in ray_effect.slang)."""
    hits: spy.Buffer
    """20 bytes each (Hit), at the ray's place."""
    places: spy.Buffer
    """Places in both, 32-bit."""
    nearest: int
    shadows: int


Tracer = Callable[[Recording, RayQueue], None]
"""Fills the hits of the rays in the queue."""


class PipelineTracer:
    """Traces ray buffers with the device's own ray tracing pipeline."""

    def __init__(self, device: Device, scene: SceneOnDevice) -> None:
        self._pipeline = _RayPipeline(device, "trace_rays", ShaderSource("rhi/trace_rays.slang"), "hit")
        self._scene = scene

    def __call__(self, recording: Recording, queue: RayQueue) -> None:
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


@dataclass(frozen=True)
class KernelRecipe:
    """One of an effect's two steps as a compute pipeline that knows some material types."""

    source: ShaderSource
    entry: str

    def link(self, device: Device, types: MaterialTypeSet) -> spy.ShaderProgram:
        """The program."""
        module = self.source.loaded(device)
        modules = [module, *device.linked(types)]
        return device.handle.link_program(modules, [module.entry_point(self.entry)])

    def make(self, device: Device, linked: spy.ShaderProgram) -> tuple[spy.ShaderProgram, spy.ComputePipeline]:
        """Program and pipeline."""
        return linked, device.handle.create_compute_pipeline(linked)


class _Kernel:
    def __init__(self, device: Device, name: str, program: spy.ShaderProgram, pipeline: spy.ComputePipeline) -> None:
        self.pipeline = pipeline
        self.parameters = ProgramParameters(device.handle, name, program)


class BufferEffect:
    """The effect as compute kernels around buffers of rays and hits (tier 1)."""

    def __init__(
        self, device: Device, module: str, effect: str, wants: Wants, simplified: bool, tracer: Tracer
    ) -> None:
        self.name = name = Path(module).stem
        self._device = device
        self._tracer = tracer
        source = _ENTRIES.format(
            module=_import_path(module),
            effect=effect,
            wants=wants,
            simplified=_SLANG_BOOL[simplified],
            group=_GROUP,
            line=_LINE,
        )
        suffix = "buffers_simplified" if simplified else "buffers"
        kernels = ShaderSource(f"{name}_{effect}_{wants}_{suffix}", source)
        self._start, self._advance = (self._kernel(device, kernels, entry) for entry in ("start", "advance"))
        layout = device.handle.link_program([kernels.loaded(device)], [])
        self._strides = {
            parameter.name: parameter.type_layout.element_type_layout.stride
            for parameter in parameters_of(layout)
            if parameter.name in ("rays", "states", "hits", "queue", "next")
        }
        self._count = 0
        self._counts = device.buffer("ray counts", data=np.zeros(2, np.uint32), struct_size=4)
        self._host_counts = HostBuffer(device, self._counts)

    def __call__(self, recording: Recording, grid: tuple[int, int], /, **values: Any) -> None:
        """Run the effect to its end. How many steps that takes is known only as they run, so each is submitted."""
        count = grid[0] * grid[1]
        if count != self._count:
            self._count = count
            self._buffers = {
                name: self._device.buffer(name, size=count * stride, struct_size=stride)
                for name, stride in self._strides.items()
            }
        types = _types_of(values)
        start, advance = self._start(types), self._advance(types)
        values |= {"counts": self._counts, "grid": spy.uint2(*grid), "waiting": spy.uint2(0, 0), **self._buffers}
        self._step(start, recording, (*grid, 1), values)
        while any(waiting := self._submit(recording)):
            values["queue"], values["next"] = values["next"], values["queue"]
            values["waiting"] = spy.uint2(*waiting)
            self._tracer(recording, RayQueue(values["rays"], values["hits"], values["queue"], *waiting))
            self._step(advance, recording, (sum(waiting), 1, 1), values)

    def _kernel(self, device: Device, source: ShaderSource, entry: str) -> ForTypes[Any, _Kernel]:
        recipe = KernelRecipe(source, entry)
        return ForTypes(device, recipe, lambda made: _Kernel(device, f"{self.name} {entry}", *made))

    def _step(
        self, kernel: _Kernel, recording: Recording, threads: tuple[int, int, int], values: dict[str, Any]
    ) -> None:
        kernel.parameters.bind(**values)
        kernel.parameters.check()
        recording.encoder.clear_buffer(self._counts)
        recording.profiler.begin(recording.encoder, f"{self.name} kernels")
        encoder = recording.encoder.begin_compute_pass()
        encoder.bind_pipeline(kernel.pipeline, kernel.parameters.root)
        encoder.dispatch(threads)
        encoder.end()
        recording.profiler.end(recording.encoder)

    def _submit(self, recording: Recording) -> tuple[int, int]:
        """Submit what is recorded so far and tell how many rays wait: for a nearest surface, and shadow rays."""
        submission = self._device.handle.submit_command_buffer(recording.encoder.finish())
        recording.encoder = self._device.handle.create_command_encoder()
        self._device.handle.wait_for_submit(submission)
        nearest, shadows = self._host_counts.read().view(np.uint32)
        return int(nearest), int(shadows)


RayEffect = PipelineEffect | BufferEffect


def ray_effect(
    device: Device, module: str, effect: str, wants: Wants, tracer: Tracer | None = None, simplified: bool = False
) -> RayEffect:
    """The effect struct `effect` of `module` (a path below the package), run through ray buffers and `tracer`
    where one is given, else as a ray tracing pipeline.

    `simplified`: its surface rays meet simplified materials (seed 000, 19.3.2.1; RaysSettings.simplified_materials);
    camera rays never do.
    Raises BindingError when the module does not compile.
    """
    try:
        if tracer is not None:
            return BufferEffect(device, module, effect, wants, simplified, tracer)
        return PipelineEffect(device, module, effect, wants, simplified)
    except (RuntimeError, spy.SlangCompileError) as error:
        raise BindingError(f"{module}: {error}") from error


def _import_path(module: str) -> str:
    return module.removesuffix(".slang").replace("/", ".")
