"""Programs and pipelines: recipes to make them, and passes that follow the material types in use.

A recipe says all that a program is made of and holds nothing of a device, so that another process can make the same
program and leave it in the shader cache (background.py).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import slangpy as spy

from pica.errors import DeviceError
from pica.rhi.material_types import MaterialType, MaterialTypeSet, ShapeOn, TypeEntry
from pica.rhi.passes import RasterState
from pica.rhi.shape_types import ShapeType

if TYPE_CHECKING:
    from pica.rhi.device import Device

Made = TypeVar("Made")
MadeOut = TypeVar("MadeOut", covariant=True)
Pass = TypeVar("Pass")


class Recipe(Protocol[MadeOut]):
    """How to make a program for some material types. Hashable and picklable; equal recipes make the same.

    In two parts, so that a renderer can do them in different frames.
    """

    def link(self, device: "Device", types: MaterialTypeSet) -> Any:
        """What `make` is given; takes a while where no cache has it."""

    def make(self, device: "Device", linked: Any) -> MadeOut:
        """The rest; takes seconds where no cache has it."""


@dataclass(frozen=True)
class ComputeRecipe:
    """A compute entry point of a file below the package."""

    module: str
    entry: str = "main"

    def link(self, device: "Device", types: MaterialTypeSet) -> spy.ShaderProgram:
        """Raises DeviceError when the file does not compile."""
        return linked(device, self.module, [self.entry], types)

    def make(self, device: "Device", linked: spy.ShaderProgram) -> tuple[spy.ShaderProgram, spy.ComputePipeline]:
        """Program and pipeline."""
        return linked, device.handle.create_compute_pipeline(linked)


@dataclass(frozen=True)
class RasterRecipe:
    """A vertex and a fragment entry point of a file below the package, and their fixed-function state."""

    module: str
    entries: tuple[str, ...]
    state: RasterState

    def link(self, device: "Device", types: MaterialTypeSet) -> spy.ShaderProgram:
        """Raises DeviceError when the file does not compile."""
        return linked(device, self.module, list(self.entries), types)

    def make(self, device: "Device", linked: spy.ShaderProgram) -> tuple[spy.ShaderProgram, spy.RenderPipeline]:
        """Program and pipeline."""
        return linked, self.state.pipeline(device.handle, linked)


@dataclass(frozen=True)
class TypeRecipe:
    """A material type or a shape by itself: whatever can be said of its file without any program."""

    entry: TypeEntry

    def link(self, device: "Device", types: MaterialTypeSet) -> MaterialType | ShapeType:
        """Raises MaterialTypeError or ShapeError when the file has a fault."""
        if isinstance(self.entry, ShapeOn):
            return device.shape_types[self.entry.shape]
        return device.material_types[self.entry]

    def make(self, device: "Device", linked: MaterialType | ShapeType) -> MaterialType | ShapeType:
        """What was loaded."""
        return linked


def linked(device: "Device", module: str, entries: list[str], types: MaterialTypeSet) -> spy.ShaderProgram:
    """The program of these entry points; raises DeviceError when the file does not compile."""
    try:
        loaded = device.handle.load_module(module)
        modules = [loaded, *device.linked(types)]
        return device.handle.link_program(modules, [loaded.entry_point(entry) for entry in entries])
    except (RuntimeError, spy.SlangCompileError) as error:
        raise DeviceError(f"{module}: {error}") from error


class ForTypes(Generic[Made, Pass]):
    """A pass whose program knows the material types in use, and is another when they change."""

    def __init__(self, device: "Device", recipe: Recipe[Made], use: Callable[[Made], Pass]) -> None:
        """`use` makes the pass from what the recipe makes."""
        self._device, self.recipe, self._use = device, recipe, use
        self.types: MaterialTypeSet = ()
        """Those of the newest call."""
        device.for_types.add(self)

    def __call__(self, types: MaterialTypeSet) -> Pass:
        """The pass that goes with these types; made here and now where nobody has made its program ahead."""
        if types is not self.types:
            if types != self.types:
                self._pass = self._use(self._device.kept(self.recipe, types))
            self.types = types
        return self._pass
