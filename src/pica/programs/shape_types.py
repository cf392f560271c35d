"""Shapes as Slang modules: an alias module for each, and one that combines those of a scene.

Shapes are ShapeOn entries in a program's MaterialTypeSet: each is a hit group with the shape's intersection shader
and the material type's other shaders. So scenes without shapes have the same programs as before.
"""

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import ShapeError
from pica.programs.material_types import (
    CompiledType,
    MaterialTypes,
    MaterialTypeSet,
    ShapeOn,
    cases,
    compiled,
    fitting_numbers,
)
from pica.programs.scene_features import feature_modules
from pica.rhi.device import Device
from pica.rhi.slang_files import digest
from pica.scene.material_registry import MaterialSource
from pica.scene.primitives import Primitives
from pica.scene.values import UnfitError

_ALL = """
module {name};
import shapes.shape_type;
{imports}
public struct AllShapes : IShape
{{
    public static bool intersect(ShapeInput shape, ObjectRay ray, out float distance)
    {{
        switch (shape.kind) {{ {intersect} }}
    }}
    public static float3 normal(ShapeInput shape, float3 place)
    {{
        switch (shape.kind) {{ {normal} }}
    }}
    public static float2 uv(ShapeInput shape, float3 place)
    {{
        switch (shape.kind) {{ {uv} }}
    }}
}}
export struct Shapes : IShape = AllShapes;
export public static const bool SHAPES_IN_USE = true;
"""


class ShapeType(CompiledType):
    """A compiled shape."""

    @property
    def struct(self) -> str:
        """Its name in the alias module."""
        return f"shape_struct_{self.name}"

    def packed(self, primitives: Primitives) -> NDArray[np.uint32]:
        """Parameters as (primitives, numbers each). Raises ShapeError for a name or a form that does not fit."""
        given, expected = set(primitives.parameters), set(self.parameters.names or ())
        if given != expected:
            fault = f"lack {sorted(expected - given)}" if expected - given else f"have no {sorted(given - expected)}"
            raise ShapeError(f"primitives of shape {self.name!r} {fault}; their parameters are {sorted(expected)}")
        rows = np.zeros(len(primitives), self.parameters)
        for name, values in primitives.parameters.items():
            if values.shape != rows[name].shape:
                fault = f"parameter {name!r} is {values.shape}, but must be {rows[name].shape}"
                raise ShapeError(f"primitives of shape {self.name!r}: {fault}")
            try:
                rows[name] = fitting_numbers(values, rows[name].dtype)
            except UnfitError as unfit:
                raise ShapeError(f"primitives of shape {self.name!r}: parameter {name!r}: {unfit}") from None
        return rows.view(np.uint32).reshape(len(rows), -1)


def shapes_of(types: MaterialTypeSet) -> list[MaterialSource]:
    """The shapes in use, by number: `SectionRecord.shape` in shaders is one more."""
    return list(dict.fromkeys(entry.shape for entry in types if isinstance(entry, ShapeOn)))


class ShapeTypes:
    """The shapes of one device, compiled at first use."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._types: dict[MaterialSource, ShapeType] = {}
        self._modules: dict[tuple[MaterialSource, ...], spy.SlangModule] = {}

    def __getitem__(self, source: MaterialSource) -> ShapeType:
        """Raises ShapeError when the shape's file has a fault."""
        if source not in self._types:
            self._types[source] = ShapeType(source.name, *compiled(self._device, source))
        return self._types[source]

    def linked(self, types: MaterialTypeSet) -> list[spy.SlangModule]:
        """The modules to link a program with for the shapes among these types."""
        shapes = tuple(shapes_of(types))
        if not shapes:
            return []
        if shapes not in self._modules:
            self._modules[shapes] = self._all([self[source] for source in shapes])
        return [self._modules[shapes]]

    def _all(self, made: list[ShapeType]) -> spy.SlangModule:
        name = f"shape_types_{digest(' '.join(shape.alias for shape in made))}"

        def switch(call: str) -> str:
            return cases(range(len(made)), [f"return {shape.struct}.{call};" for shape in made])

        text = _ALL.format(
            name=name,
            imports="\n".join(f"import {shape.alias};" for shape in made),
            intersect=switch("intersect(shape, ray, distance)"),
            normal=switch("normal(shape, place)"),
            uv=switch("uv(shape, place)"),
        )
        return self._device.module(name, text)


def modules_for(device: Device, types: MaterialTypeSet) -> list[spy.SlangModule]:
    """The modules to link a program with for these material types, and the shapes and features among them."""
    shared = device.shared(MaterialTypes).linked(types), device.shared(ShapeTypes).linked(types)
    return [*shared[0], *shared[1], *feature_modules(device, types)]
