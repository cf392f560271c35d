"""Ray effects as compute kernels around buffers of rays and hits, with an external tracer in between (tier 1)."""

import weakref
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import slangpy as spy

from pica.programs.library import programs
from pica.programs.material_types import MaterialTypeSet
from pica.programs.recipes import ForTypes
from pica.programs.shape_types import modules_for
from pica.rhi.binding import ProgramParameters, parameters_of
from pica.rhi.device import Device
from pica.rhi.host_memory import HostBuffer
from pica.rhi.passes import Recording
from pica.tracing.ray_pipeline import EffectCode, ShaderSource, types_of

_GROUP = 8
_LINE = 64
_WORD = 16
"""Bytes by which states are read and written (ray_effect.slang: storeState)."""
RAY, HIT = 44, 20
"""Bytes of a Ray and of a Hit (ray.slang)."""
_ENTRIES = """
import rhi.rows;
import tracing.ray_effect;
import {module};
RWStructuredBuffer<Ray> rays;
RWStructuredBuffer<uint4> states;
Rows<uint4> storedStates;
SmallRows<Hit> hits;
SmallRows<uint> queue;
RWStructuredBuffer<uint> next;
RWStructuredBuffer<uint> counts;
uniform uint2 grid;
uniform uint2 waiting;
[shader("compute")] [numthreads({group}, {group}, 1)]
void start(uint3 thread : SV_DispatchThreadID)
{{
    if (all(thread.xy < grid)) runStart<{effect}, {quads}>(thread.xy, grid, rays, states, next, counts);
}}
[shader("compute")] [numthreads({line}, 1, 1)]
void advance(uint3 thread : SV_DispatchThreadID)
{{
    if (thread.x < waiting.x + waiting.y)
    {{
        uint index = queue[placeInQueue(thread.x, waiting, grid)];
        runAdvance<{effect}, {quads}, HitDetail.{detail}, {simplified}>(
            index, grid, hits, storedStates, rays, states, next, counts);
    }}
}}
"""


_STATES = """
import {module};
StructuredBuffer<{effect}.State> states;
"""


@dataclass(frozen=True)
class RayQueue:
    """Queues of rays: those for a nearest surface first in `places`, shadow rays from its end."""

    rays: spy.Buffer
    """44 bytes each (Ray in ray.slang)."""
    hits: spy.Buffer
    """20 bytes each (Hit), at the ray's place."""
    places: spy.Buffer
    """Places in both, 32-bit."""
    nearest: int
    shadows: int


Tracer = Callable[[Recording, RayQueue], bool]
"""Fills the hits of the rays in the queue: True where that is done on the processor, False where it is recorded."""


@dataclass(frozen=True)
class KernelRecipe:
    """One of an effect's two steps as a compute pipeline for some material types."""

    source: ShaderSource
    entry: str
    with_module: str | None = None
    """As `ray_effect`'s."""

    def link(self, device: Device, variant: MaterialTypeSet) -> spy.ShaderProgram:
        """The program."""
        module = self.source.loaded(device)
        modules = [module, *modules_for(device, variant)]
        if self.with_module is not None:
            modules.append(device.module(self.with_module))
        return device.session.link_program(modules, [module.entry_point(self.entry)])

    def make(self, device: Device, linked: spy.ShaderProgram) -> tuple[spy.ShaderProgram, spy.ComputePipeline]:
        """Program and pipeline."""
        return linked, device.handle.create_compute_pipeline(linked)


class _Kernel:
    def __init__(self, device: Device, name: str, program: spy.ShaderProgram, pipeline: spy.ComputePipeline) -> None:
        self.pipeline = pipeline
        self.parameters = ProgramParameters(device.handle, name, program)


class BufferEffect:
    """The effect as compute kernels around buffers of rays and hits (tier 1)."""

    def __init__(self, device: Device, code: EffectCode, tracer: Tracer) -> None:
        self.name, self.blocks = code.name, code.blocks
        self._pass = f"{self.name} kernels"
        self._device = device
        self._tracer = tracer
        simplified = code.simplified
        state = _state_size(device, code)
        words = {"simplified": str(simplified).lower(), "group": _GROUP, "line": _LINE, "quads": state // _WORD}
        kernels = code.shaders("buffers_simplified" if simplified else "buffers", _ENTRIES, **words)
        self._start = self._kernel(device, KernelRecipe(kernels, "start", code.with_module))
        self._advance = self._kernel(device, KernelRecipe(kernels, "advance", code.with_module))
        self._buffers = RayBuffers(device, self.name, kernels, hits=HIT, states=state)
        self._counts = device.buffer("ray counts", data=np.zeros(2, np.uint32), struct_size=4)
        self._host_counts = HostBuffer(device, self._counts)

    def __call__(self, recording: Recording, grid: tuple[int, int], /, **values: Any) -> None:
        """Run the effect to its end. The number of steps depends on their results, so each is submitted."""
        parts = self.record_in_parts(recording, grid, **values)
        seconds: float | None = None
        with suppress(StopIteration):
            while True:
                parts.send(seconds)
                seconds = self._device.finish(recording)

    def record_in_parts(
        self, recording: Recording, grid: tuple[int, int], /, **values: Any
    ) -> Generator[None, float | None, None]:
        """The same, as graph.nodes.Parts.

        Steps that alternate with the processor are timed by its clock: a device's timestamps would take longer than
        the last steps do, which have few rays.
        """
        buffers = self._buffers.for_rays(grid[0] * grid[1])
        types = types_of(values)
        start, advance = self._start.of(types), self._advance.of(types)
        values |= {"counts": self._counts, "grid": spy.uint2(*grid), "waiting": spy.uint2(0, 0), **buffers}
        values["storedStates"] = buffers["states"]
        rays, hits, queue, following = (buffers[name] for name in ("rays", "hits", "queue", "next"))
        start.parameters.bind(**values)
        self._step(start, recording, (*grid, 1), timed=True)
        traced = False
        while True:
            seconds = yield
            nearest, shadows = self._host_counts.read().view(np.uint32)
            waiting = int(nearest), int(shadows)
            if traced and seconds is not None:
                recording.profiler.add(self._pass, seconds)
            if not any(waiting):
                return
            queue, following = following, queue
            traced = self._tracer(recording, RayQueue(rays, hits, queue, *waiting))
            values |= {"queue": queue, "next": following, "waiting": spy.uint2(*waiting)}
            advance.parameters.bind(**values)
            values = {}  # the others keep their values
            self._step(advance, recording, (sum(waiting), 1, 1), timed=not traced)

    def _kernel(self, device: Device, recipe: KernelRecipe) -> ForTypes[Any, _Kernel]:
        name = f"{self.name} {recipe.entry}"  # the pass must not hold the effect that holds it
        return ForTypes(programs(device), recipe, lambda made: _Kernel(device, name, *made))

    def _step(self, kernel: _Kernel, recording: Recording, threads: tuple[int, int, int], timed: bool) -> None:
        kernel.parameters.check()
        recording.encoder.clear_buffer(self._counts)
        if timed:
            recording.profiler.begin(recording.encoder, self._pass)
        encoder = recording.encoder.begin_compute_pass()
        encoder.bind_pipeline(kernel.pipeline, kernel.parameters.root)
        encoder.dispatch(threads)
        encoder.end()
        if timed:
            recording.profiler.end(recording.encoder)


def _state_size(device: Device, code: EffectCode) -> int:
    """Bytes of an effect's state in its buffer."""
    size = _strides(device, code.shaders("state", _STATES))["states"]
    return max(size + _WORD - 1, _WORD) // _WORD * _WORD


def _strides(device: Device, source: ShaderSource) -> dict[str, int]:
    """Bytes of an element of each buffer of a path's."""
    layout = device.session.link_program([source.loaded(device)], [])
    return {
        parameter.name: parameter.type_layout.element_type_layout.stride
        for parameter in parameters_of(layout)
        if parameter.name in ("rays", "states", "next")
    }


class RayBuffers:
    """An effect's active rays, their states, two queues that are swapped, and additional per-ray data."""

    def __init__(self, device: Device, name: str, source: ShaderSource, shared: bool = False, **more: int) -> None:
        """`source`: declares `rays`, `states` and `next`. `shared`: effects that run one after the other have
        the same buffers, which may be larger than needed. `more`: bytes per ray of further buffers."""
        strides = _strides(device, source)
        self._device, self._name = device, name
        self.strides = strides | {"queue": strides["next"]} | more
        """Bytes of a ray's part of each."""
        self._scratch = _shared_scratch(device) if shared else Scratch(device)
        self._count = 0
        self._buffers: dict[str, spy.Buffer] = {}

    def for_rays(self, count: int) -> dict[str, spy.Buffer]:
        """The buffers, with room for just so many rays unless they are shared."""
        if count != self._count or self._buffers != self._scratch.buffers:
            self._count = count
            for name, stride in self.strides.items():
                self._scratch.make_room(f"{self._name} {name}", name, count * stride, stride)
            self._buffers = dict(self._scratch.buffers)
        return self._buffers


class Scratch:
    """Buffers of which nothing is needed once an effect has run."""

    def __init__(self, device: Device) -> None:
        self._device = device.memory_scope()
        self.buffers: dict[str, spy.Buffer] = {}
        self.shared = False

    def make_room(self, label: str, name: str, size: int, stride: int) -> None:
        """A buffer with this name and at least this size; of exactly this size unless shared."""
        buffer = self.buffers.get(name)
        if buffer is not None:
            if buffer.size == size or (self.shared and buffer.size > size):
                return
            self._device.give_back(buffer)
        self.buffers[name] = self._device.buffer(label, size=size, struct_size=stride)


class _SharedScratch:
    """Of a device: there while an effect uses it."""

    def __init__(self, device: Device) -> None:
        self.current: weakref.ref[Scratch] | None = None


def _shared_scratch(device: Device) -> Scratch:
    place = device.shared(_SharedScratch)
    scratch = place.current() if place.current is not None else None
    if scratch is None:
        scratch = Scratch(device)
        scratch.shared = True
        place.current = weakref.ref(scratch)
    return scratch
