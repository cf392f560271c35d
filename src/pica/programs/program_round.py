"""All programs of a scene for another set of material types, made while frames go on."""

import warnings
from collections import deque
from typing import Any

from pica.errors import MaterialTypeError, PicaError, ShapeError
from pica.programs.compiler import Task
from pica.programs.library import programs
from pica.programs.material_types import MaterialTypeSet, TypeEntry, fault_of
from pica.programs.recipes import TypeRecipe
from pica.rhi.device import Device
from pica.rhi.recipes import Recipe


class ProgramRound:
    """All programs of a scene for another set of material types: compiled by the worker, then made here, one a step."""

    def __init__(self, device: Device, before: MaterialTypeSet, types: MaterialTypeSet) -> None:
        self.types = types
        self.entries = [entry for entry in types if entry not in before]
        """The new types."""
        self._device = device
        self._compiler = programs(device).compiler
        recipes: list[Recipe[Any]] = [TypeRecipe(entry) for entry in self.entries]
        recipes += dict.fromkeys(user.recipe for user in programs(device).for_types if user.types is before)
        self._tasks = deque(Task(recipe, types) for recipe in recipes)
        self._tasks.extend(Task(recipe, ()) for recipe in programs(device).planned_for(types))
        for task in self._tasks:
            self._compiler.submit(task)

    @property
    def left(self) -> int:
        """How many programs are still to be made."""
        return len(self._tasks)

    def step(self) -> bool:
        """Link a program that the worker has compiled, or finish a linked one; True when all are made.

        Raises MaterialTypeError or ShapeError for a fault in a new type: in `entries`, and the round is over.
        """
        if self._compiler.failure and not self._compiler.warned:
            self._compiler.warned = True
            warnings.warn(
                f"the shader compiler's process cannot start ({self._compiler.failure}): frames wait for new shaders",
                stacklevel=2,
            )
        if self._tasks and self._tasks[0].done:
            task = self._tasks[0]
            try:
                if task.fault is not None:
                    raise task.fault
                if task.linked:
                    self._device.product(task.recipe, task.types)
                    self._tasks.popleft()
                else:
                    self._device.link(task.recipe, task.types)
                    task.linked = True
            except (PicaError, RuntimeError) as error:
                self._tasks.popleft()
                self._fail(task.recipe, error)
        return not self._tasks

    def cancel(self) -> None:
        """Stop compiling these programs."""
        for task in self._tasks:
            task.cancelled = True

    def _fail(self, recipe: Recipe[Any], error: Exception) -> None:
        self.cancel()
        programs(self._device).retire(self.types)  # the next round cannot use these programs
        if isinstance(recipe, TypeRecipe):
            self.entries = [recipe.entry]
        if isinstance(error, MaterialTypeError | ShapeError):
            raise error
        if error_in_type := fault_of(self.types, error):
            raise error_in_type from None
        fault = " ".join(str(error).split())
        raise MaterialTypeError(f"material type {_names(self.entries)}: {fault}") from None


def _names(entries: list[TypeEntry]) -> str:
    return " or ".join(repr(entry.name) for entry in entries)
