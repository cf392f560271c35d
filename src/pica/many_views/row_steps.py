"""The steps of frames as programs with rows of arguments, which take several views at once."""

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import slangpy as spy

from pica.many_views.row_program import BlockTables, RowProgram, Run
from pica.many_views.row_recipe import PlainRecipe, RowRecipe, has_rows
from pica.many_views.row_tables import Part
from pica.programs.library import programs
from pica.programs.material_types import MaterialTypeSet
from pica.programs.recipes import ForTypes, MaterialPass
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass, Recording
from pica.rhi.recipes import ComputeRecipe
from pica.tracing.path_pipeline import PathPipeline
from pica.tracing.ray_pipeline import PipelineEffect, RayPipeline, types_of


class RowSteps:
    """Those of the nodes of some views' frames."""

    def __init__(self, device: Device, views: int) -> None:
        self._device, self._views = device, views
        self.blocks = BlockTables(device, views)
        self._steps: dict[Hashable, RowStep] = {}

    def of(self, key: Hashable, step: Any) -> "RowStep | None":
        """In place of `step`, which the node `key` of a view has; None if it is not made of the package's files alone,
        or traces rays outside of a pipeline."""
        recipe = _recipe_of(step)
        if recipe is None or not has_rows(recipe):
            return None
        found = self._steps.get(key)
        if found is None or found.recipe != recipe:
            kind = RowPaths if isinstance(step, PathPipeline) else RowRays if isinstance(step, RayPipeline) else RowPass
            found = self._steps[key] = kind(self._device, self.blocks, self._views, step)
        _user_of(step).is_replaced = True
        return found

    def renew(self, keys: Collection[Hashable]) -> None:
        """The nodes are these, with other arguments."""
        self._steps = {key: step for key, step in self._steps.items() if key in keys}
        self.blocks.clear()
        for step in self._steps.values():
            step.forget()


class RowStep:
    """A step for several views."""

    def __init__(self, device: Device, blocks: BlockTables, views: int, step: Any) -> None:
        """`step`: that of one view."""
        recipe = _recipe_of(step)
        assert recipe is not None
        self._device, self._name, self._views, self.recipe = device, step.name, views, recipe
        self._used: RowProgram | None = None

        def use(made: tuple[Any, ...]) -> tuple[RowProgram, tuple[Any, ...]]:
            self._used = RowProgram(device, step.name, made[0], blocks, views)
            return self._used, made[1:]

        self._program: _Fixed | ForTypes[Any, tuple[RowProgram, tuple[Any, ...]]]
        if isinstance(recipe, ComputeRecipe):
            self._program = _Fixed(device.compute_of(RowRecipe(recipe), step.name), use)
        else:
            self._program = ForTypes(programs(device), RowRecipe(recipe), use)

    def _of(self, run: Run) -> tuple[RowProgram, tuple[Any, ...]]:
        return self._program.of(types_of(run.given))

    def forget(self) -> None:
        """Drop all arguments."""
        if self._used is not None:
            self._used.forget()

    def record(self, recording: Recording, run: Run) -> None:
        """Record one dispatch for a run of views."""
        raise NotImplementedError


class _Fixed:
    """As ForTypes, of a program that depends on no types."""

    def __init__(self, made: ComputePass, use: Callable[[Any], tuple[RowProgram, tuple[Any, ...]]]) -> None:
        self._made, self._use = made, use

    @cached_property
    def _used(self) -> tuple[RowProgram, tuple[Any, ...]]:
        return self._use((self._made.program, self._made.pipeline))

    def of(self, _types: MaterialTypeSet) -> tuple[RowProgram, tuple[Any, ...]]:
        """The program and its pipeline."""
        return self._used


class RowPass(RowStep):
    """A compute pass."""

    def record(self, recording: Recording, run: Run) -> None:
        """As RowStep."""
        across, down, along = run.threads
        program, (pipeline,) = self._of(run)
        root = program.root(recording, run, along)
        recording.profiler.begin(recording.encoder, self._name)
        recording.encoder.global_barrier()
        encoder = recording.encoder.begin_compute_pass()
        encoder.bind_pipeline(pipeline, root)
        encoder.dispatch((across, down, along * len(run.nodes)))
        encoder.end()
        recording.profiler.end(recording.encoder)


class RowRays(RowStep):
    """A ray tracing pipeline."""

    def record(self, recording: Recording, run: Run) -> None:
        """As RowStep."""
        self._trace(recording, run, run.threads, ())

    def _trace(
        self,
        recording: Recording,
        run: Run,
        threads: tuple[int, ...],
        more: Sequence[Mapping[str, Any]],
        part: int = 0,
    ) -> None:
        """`more`, `part`: as RowProgram.root."""
        program, (pipeline, table) = self._of(run)
        scene = run.given.get("scene")
        root = program.root(recording, run, 1, more, part, {} if scene is None else {"tlas": scene.rt_scene.structure})
        recording.profiler.begin(recording.encoder, self._name)
        recording.encoder.global_barrier()
        encoder = recording.encoder.begin_ray_tracing_pass()
        encoder.bind_pipeline(pipeline, table, root)
        encoder.dispatch_rays(0, (threads[0], threads[1], len(run.nodes)))
        encoder.end()
        recording.profiler.end(recording.encoder)


class RowPaths(RowRays):
    """Paths in parts (PathPipeline): views have parts of the same buffers."""

    def __init__(self, device: Device, blocks: BlockTables, views: int, step: PathPipeline) -> None:
        super().__init__(device, blocks, views, step)
        self._parts, self._buffers = step.parts, step.buffers
        self._counts = device.buffer("path counts", data=np.zeros(views * step.counts, np.uint32), struct_size=4)
        self._of_view = 4 * step.counts
        self._places: list[list[dict[str, Any]]] = []
        """Arguments of each part and view, beside those of its node."""
        self._placed: tuple[dict[str, spy.Buffer], tuple[int, ...]] = {}, ()
        """The buffers and the grid that they are for."""

    def record(self, recording: Recording, run: Run) -> None:
        """As RowStep."""
        size = run.threads[0] * run.threads[1]
        buffers = self._buffers.for_rays(size * self._views)
        if buffers is not self._placed[0] or run.threads != self._placed[1]:
            self.forget()
            self._place(buffers, run.threads)
        recording.encoder.clear_buffer(self._counts)
        for part, more in enumerate(self._places):
            self._trace(recording, run, (size, 1) if part else run.threads, more, part)

    def _place(self, buffers: dict[str, spy.Buffer], threads: tuple[int, ...]) -> None:
        self._placed = buffers, threads
        size, grid = threads[0] * threads[1], spy.uint2(threads[0], threads[1])
        self._places = [[] for _ in self._parts]
        for view in range(self._views):
            # Other effects may have made these buffers, for rows of another size.
            own: dict[str, Any] = {
                name: Part(buffers[name], view * size * stride) for name, stride in self._buffers.strides.items()
            }
            own |= {"counts": Part(self._counts, view * self._of_view), "grid": grid}
            for part, most in enumerate(self._parts):
                self._places[part].append({**own, "part": part, "most": most})
                own["queue"], own["next"] = own["next"], own["queue"]


def _user_of(step: Any) -> Any:
    """What makes the program of a step; None of one of which there is none with rows."""
    match step:
        case ComputePass() | MaterialPass():
            return step
        case PipelineEffect():
            return step.program
        case PathPipeline():
            return step.pipeline.program
    return None


def _recipe_of(step: Any) -> PlainRecipe | None:
    recipe: PlainRecipe | None = getattr(_user_of(step), "recipe", None)
    return recipe
