"""Compute and raster passes: a pipeline, its parameters, and one call a frame."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import slangpy as spy

from pica.rhi.binding import ProgramParameters
from pica.rhi.profiler import Profiler
from pica.rhi.shader_blocks import blocks_of

if TYPE_CHECKING:
    from pica.rhi.recipes import ComputeRecipe

Pipeline = TypeVar("Pipeline")


class Recording(Protocol):
    """Where passes record: the frame's command encoder and the profiler."""

    encoder: spy.CommandEncoder
    variant: int
    """Which of a pass's parameter sets to use. Bindings that alternate between frames have one set for each state, so
    that nothing is bound again."""

    @property
    def profiler(self) -> Profiler:
        """Times the passes."""


@dataclass
class DeviceRecording:
    """A recording outside of any frame."""

    encoder: spy.CommandEncoder
    profiler: Profiler
    variant: int = 0


class _Pass(Generic[Pipeline]):
    """A program with its pipeline and parameters, made at first use or before by programs/preparation.py."""

    def __init__(self, device: spy.Device, name: str, make: Callable[[], tuple[spy.ShaderProgram, Pipeline]]) -> None:
        """`make` always returns the same objects."""
        self._device, self._make = device, make
        self.name = name
        self.is_replaced = False
        """Whether a program with rows (many_views/) runs in its place, so that its own need not be made."""

    @property
    def program(self) -> spy.ShaderProgram:
        """The linked program."""
        return self._make()[0]

    @cached_property
    def pipeline(self) -> Pipeline:
        """The program on the device."""
        return self._make()[1]

    @cached_property
    def _variants(self) -> dict[int, ProgramParameters]:
        return {}

    def parameters(self, variant: int) -> ProgramParameters:
        """The program's parameters."""
        bound = self._variants.get(variant)
        if bound is None:
            bound = self._variants[variant] = ProgramParameters(self._device, self.name, self.program)
        return bound


class ComputePass(_Pass[spy.ComputePipeline]):
    """One compute entry point, run over a grid of threads."""

    def __init__(
        self,
        device: spy.Device,
        name: str,
        make: Callable[[], tuple[spy.ShaderProgram, spy.ComputePipeline]],
        recipe: "ComputeRecipe | None" = None,
    ) -> None:
        """`recipe`: what `make` makes, where it is a file's entry point alone."""
        super().__init__(device, name, make)
        self.recipe = recipe

    @property
    def blocks(self) -> frozenset[str]:
        """Names of its parameter blocks."""
        return blocks_of(self.recipe.module) if self.recipe is not None else frozenset()

    def __call__(self, recording: Recording, threads: tuple[int, int, int], /, **values: Any) -> None:
        """Record one dispatch of (x, y, z) threads with these parameters."""
        parameters = self.parameters(recording.variant)
        parameters.bind_all(values)
        # Plain calls: context managers would add a third to the 5 microseconds that a pass may cost the host.
        recording.profiler.begin(recording.encoder, self.name)
        encoder = recording.encoder.begin_compute_pass()
        encoder.bind_pipeline(self.pipeline, parameters.root)
        encoder.dispatch(threads)
        encoder.end()
        recording.profiler.end(recording.encoder)


@dataclass(frozen=True)
class RasterState:
    """The fixed-function state of a raster pass."""

    formats: tuple[spy.Format, ...]
    cull: spy.CullMode
    front: spy.FrontFaceMode = spy.FrontFaceMode.counter_clockwise
    depth_format: spy.Format = spy.Format.d32_float

    def pipeline(self, device: spy.Device, program: spy.ShaderProgram) -> spy.RenderPipeline:
        """A pipeline of this state."""
        return device.create_render_pipeline(
            program=program,
            input_layout=None,
            targets=[{"format": target} for target in self.formats],
            # Reversed z: nearer is greater, 0 is infinitely far (frame/gbuffer.slang).
            depth_stencil={
                "format": self.depth_format,
                "depth_test_enable": True,
                "depth_write_enable": True,
                "depth_func": spy.ComparisonFunc.greater,
            },
            rasterizer={"cull_mode": self.cull, "front_face": self.front},
        )


class RasterPass(_Pass[spy.RenderPipeline]):
    """One vertex and fragment program; draws are recorded by the caller into an open render pass."""

    def bind(self, encoder: spy.RenderPassEncoder, /, **values: Any) -> None:
        """Bind the pipeline and its parameters; the caller draws."""
        parameters = self.parameters(0)
        parameters.bind_all(values)
        encoder.bind_pipeline(self.pipeline, parameters.root)
