"""Recipes of programs that evaluate materials, and the passes that follow the material types in use."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import slangpy as spy

from pica.programs.material_types import (
    Bundle,
    Feature,
    MaterialType,
    MaterialTypes,
    MaterialTypeSet,
    ShapeOn,
    TypeEntry,
    made,
)
from pica.programs.shape_types import ShapeType, ShapeTypes, modules_for
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass, Recording
from pica.rhi.recipes import ComputeRecipe, RasterRecipe, Recipe
from pica.rhi.shader_blocks import blocks_of

if TYPE_CHECKING:
    from pica.programs.library import ProgramLibrary

Made = TypeVar("Made")
Pass = TypeVar("Pass")


@dataclass(frozen=True)
class ForTypesRecipe:
    """A program linked with the material types and shapes in use."""

    plain: ComputeRecipe | RasterRecipe
    features: tuple[Feature, ...] = ()
    """Additional features, independent of the types."""

    def link(self, device: Device, variant: MaterialTypeSet) -> spy.ShaderProgram:
        """`variant`: the types. Raises DeviceError when the file does not compile."""
        return self.plain.link(device, modules_for(device, (*variant, Bundle(self.features))))

    def make(self, device: Device, linked: spy.ShaderProgram) -> tuple[spy.ShaderProgram, Any]:
        """Program and pipeline."""
        return self.plain.make(device, linked)


@dataclass(frozen=True)
class TypeRecipe:
    """A material type, a shape or a bundle by itself: checks its file without any program."""

    entry: TypeEntry

    def link(self, device: Device, variant: MaterialTypeSet) -> MaterialType | ShapeType | Bundle:
        """Raises MaterialTypeError or ShapeError when the file has a fault."""
        if isinstance(self.entry, Bundle):
            return self.entry
        if isinstance(self.entry, ShapeOn):
            return device.shared(ShapeTypes)[self.entry.shape]
        return device.shared(MaterialTypes)[self.entry]

    def make(self, device: Device, linked: MaterialType | ShapeType | Bundle) -> MaterialType | ShapeType | Bundle:
        """The loaded modules."""
        return linked


class ForTypes(Generic[Made, Pass]):
    """A pass whose program is compiled for the material types in use, and replaced when they change."""

    def __init__(self, library: "ProgramLibrary", recipe: Recipe[Made], use: Callable[[Made], Pass]) -> None:
        """`use` makes the pass from the recipe's program."""
        self._library, self.recipe, self._use = library, recipe, use
        self.types: MaterialTypeSet = ()
        """The types of the newest call."""
        self.is_replaced = False
        """As a ComputePass's."""
        library.for_types[self] = None

    def of(self, types: MaterialTypeSet) -> Pass:
        """The pass for these types; compiled now unless its program was prepared."""
        if types is not self.types:
            if types != self.types:
                self._pass = self._use(made(self._library.device, self.recipe, types))
            self.types = types
        return self._pass


class MaterialPass(ForTypes[tuple[spy.ShaderProgram, spy.ComputePipeline], ComputePass]):
    """A compute pass that evaluates materials, of the types that the scene among its arguments has."""

    def __init__(self, library: "ProgramLibrary", recipe: ForTypesRecipe, name: str) -> None:
        """`name`: in the profiler."""
        handle = library.device.handle
        super().__init__(library, recipe, lambda made: ComputePass(handle, name, lambda: made))
        self.name = name
        self.blocks = blocks_of(*recipe.plain.sources) | {"scene"}
        """Names of its parameter blocks."""

    def __call__(self, recording: Recording, threads: tuple[int, int, int], /, **values: Any) -> None:
        """As ComputePass; one of the values is `scene`."""
        self.of(values["scene"].material_types)(recording, threads, **values)
