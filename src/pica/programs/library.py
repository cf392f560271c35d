"""A device's material types and shapes, and the passes whose programs depend on them."""

import weakref
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import slangpy as spy

from pica.caches.compiled_programs import CompiledPrograms
from pica.caches.places import COMPILED
from pica.programs.compiler import Compiler, Workers
from pica.programs.material_types import STANDARD_ONLY, Feature, MaterialTypes, MaterialTypeSet
from pica.programs.recipes import ForTypes, ForTypesRecipe, MaterialPass
from pica.programs.scene_features import supported_features
from pica.programs.shape_types import ShapeTypes
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass, RasterPass, RasterState
from pica.rhi.recipes import ComputeRecipe, RasterRecipe
from pica.rhi.slang_files import Source, stem
from pica.rhi.slang_sessions import PACKAGE


class ProgramLibrary:
    """The compiled material types and shapes of a device, with their users; one per device (`programs`)."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.material_types = device.shared(MaterialTypes)
        self.shape_types = device.shared(ShapeTypes)
        self.for_types: weakref.WeakKeyDictionary[ForTypes[Any, Any], None] = weakref.WeakKeyDictionary()
        """The passes on this device that follow the material types in use, in the order in which they were made."""
        self.first_workers: Workers | None = None
        """Workers started before the required programs are known (preparation.py)."""
        self._for_features: weakref.WeakKeyDictionary[ComputePass, tuple[Feature, ComputeRecipe]] = (
            weakref.WeakKeyDictionary()
        )

    @cached_property
    def compiler(self) -> Compiler:
        """The process that compiles new types beside a running renderer."""
        compiler = Compiler(self.device.name, self.device.cache)
        self.device.at_close(compiler.close)
        weakref.finalize(self, compiler.close)  # of a device whose programs were renewed
        return compiler

    @cached_property
    def compiled(self) -> CompiledPrograms:
        """Programs in the caches for this device."""
        device = self.device
        file = None if device.cache is None else device.cache / COMPILED
        return CompiledPrograms(file, PACKAGE, f"{device.name} {device.info.driver}")

    def retire(self, types: MaterialTypeSet) -> None:
        """Release the programs for these types, unless a pass still uses them."""
        if types != STANDARD_ONLY and not any(types == user.types for user in self.for_types):
            self.device.forget(types)

    def compute(
        self,
        module: Source,
        entry: str = "main",
        name: str | None = None,
        features: tuple[Feature, ...] = (),
        with_module: str | None = None,
    ) -> MaterialPass:
        """A compute pass that evaluates materials.

        `name`: in the profiler; `features`: additional features that it is compiled with; `with_module`: a Slang file
        with implementations for its `extern` declarations.
        """
        recipe = ForTypesRecipe(ComputeRecipe(module, entry, with_module), features)
        return MaterialPass(self, recipe, name or stem(module))

    def compute_with(self, feature: Feature, module: str) -> ComputePass:
        """As Device.compute, for a pass that only frames of scenes with this feature run."""
        recipe = ComputeRecipe(module)
        made = ComputePass(self.device.handle, Path(module).stem, partial(self.device.product, recipe), recipe)
        self._for_features[made] = feature, recipe
        return made

    def planned_for(self, types: MaterialTypeSet) -> list[ComputeRecipe]:
        """Recipes of passes with `compute_with` features among these types that are not made yet."""
        features = supported_features(types)
        used = [planned for user, planned in self._for_features.items() if not user.is_replaced]
        recipes = dict.fromkeys(recipe for feature, recipe in used if feature in features)
        return [recipe for recipe in recipes if not self.device.has(recipe)]

    def raster(
        self, module: str, entries: tuple[str, ...], state: RasterState, name: str | None = None
    ) -> ForTypes[tuple[spy.ShaderProgram, spy.RenderPipeline], RasterPass]:
        """A raster pass that evaluates materials: `of` returns it for the types in use."""
        handle, label = self.device.handle, name or Path(module).stem
        recipe = ForTypesRecipe(RasterRecipe(module, entries, state))
        return ForTypes(self, recipe, lambda made: RasterPass(handle, label, lambda: made))


def programs(device: Device) -> ProgramLibrary:
    """The library of a device."""
    return device.shared(ProgramLibrary)
