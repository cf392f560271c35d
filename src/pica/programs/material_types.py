"""Material types as Slang modules: an alias module for each, and one that combines those of a scene.

The file of a type is compiled unchanged; generated modules only refer to its struct (materials/material_types.slang).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import DeviceError, MaterialTypeError, PicaError, shown
from pica.rhi.device import Device
from pica.rhi.recipes import Recipe
from pica.rhi.slang_files import digest, first_error, marked
from pica.scene.arrays import floats, integers, numbers
from pica.scene.material_registry import STANDARD, STANDARD_SOURCE, MaterialSource
from pica.scene.values import UnfitError

Made = TypeVar("Made")


@dataclass(frozen=True)
class ShapeOn:
    """A hit group of primitives: a shape with a material type (programs/shape_types.py)."""

    shape: MaterialSource
    material: MaterialSource

    @property
    def name(self) -> str:
        """shape/type."""
        return f"{self.shape.name}/{self.material.name}"


@dataclass(frozen=True)
class Feature:
    """A feature that programs omit unless it is linked (programs/scene_features.py)."""

    word: str
    module: str
    """Where `constant` is declared, as Slang imports it."""
    constant: str


@dataclass(frozen=True)
class Bundle:
    """The features of the programs: one of scene_features.BUNDLES."""

    features: tuple[Feature, ...]

    @property
    def name(self) -> str:
        """A name that no type can have."""
        return "features/"


TypeEntry = MaterialSource | ShapeOn | Bundle
MaterialTypeSet = tuple[TypeEntry, ...]
"""The types of a program, by the number in materials (`Material.type` in shaders), with the
shapes that use them, one hit group each, and the features, if any. The first entry is a type."""
STANDARD_ONLY: MaterialTypeSet = (STANDARD_SOURCE,)
MAX_PARAMETERS = 16
"""32-bit numbers of a material's own; table_rows.slang: MATERIAL_PARAMETERS."""

_STANDARD_SOURCE = """
module {alias};
import materials.standard_material;
public typealias {type} = StandardMaterial;
"""
_ALIAS = """
module {alias};
import {interface};
import {module};
public typealias {type} = {struct};
"""
_ALL = """
module {name};
import materials.material_type;
{imports}
public struct AllTypes : IMaterialType
{{
    public override static float coverage(MaterialInput input)
    {{
        switch (input.material.type) {{ {coverage} }}
    }}
    public override static float3 emission(MaterialInput input)
    {{
        switch (input.material.type) {{ {emission} }}
    }}
    public static void evaluate(MaterialInput input, inout Surface surface)
    {{
        switch (input.material.type) {{ {evaluate} }}
    }}
}}
export struct MaterialTypes : IMaterialType = AllTypes;
"""
_SCALARS = {
    spy.TypeReflection.ScalarType.float32: np.dtype("f4"),
    spy.TypeReflection.ScalarType.int32: np.dtype("i4"),
    spy.TypeReflection.ScalarType.uint32: np.dtype("u4"),
}


@dataclass(frozen=True)
class CompiledType:
    """A compiled material type or shape."""

    name: str
    alias: str
    """The module to import for it."""
    parameters: np.dtype[Any]
    """The fields of `Material.parameters`, MAX_PARAMETERS numbers at most, or of a shape's primitives."""


class MaterialType(CompiledType):
    """A compiled material type."""

    @property
    def struct(self) -> str:
        """Its name in the alias module."""
        return f"material_struct_{self.name}"

    def packed(self, what: str, values: dict[str, Any]) -> NDArray[np.uint32]:
        """Parameters as (MAX_PARAMETERS,) numbers. Raises MaterialTypeError for a name or a shape that does not fit."""
        expected = self.parameters.names or ()
        given, names = set(values), set(expected)
        if given != names:
            fault = f"lacks {_listed(names - given)}" if names - given else f"has no {_listed(given - names)}"
            raise MaterialTypeError(
                f"material {what!r} of type {self.name!r} {fault}; its parameters are {_listed(names) or 'none'}"
            )
        row = np.zeros((), self.parameters)
        for name in expected:
            try:
                row[name] = fitting_numbers(values[name], row[name].dtype).reshape(row[name].shape)
            except (ValueError, UnfitError):
                shape = f"{row[name].size} numbers" if row[name].size > 1 else "a number"
                kind = "" if row[name].dtype.kind == "f" else " of type " + row[name].dtype.name
                message = f"material {what!r}: parameter {name!r} is {shown(values[name])}, but must be {shape}{kind}"
                raise MaterialTypeError(message) from None
        numbers = np.zeros(MAX_PARAMETERS, np.uint32)
        numbers[: row.nbytes // 4] = np.frombuffer(row.tobytes(), np.uint32)
        return numbers


class MaterialTypes:
    """The material types of one device, compiled at first use."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._types: dict[MaterialSource, MaterialType] = {}
        self._modules: dict[MaterialTypeSet, spy.SlangModule] = {}

    def __getitem__(self, source: MaterialSource) -> MaterialType:
        """Raises MaterialTypeError when the type's file has a fault."""
        if source not in self._types:
            if source == STANDARD_SOURCE:
                self._types[source] = self._standard()
            else:
                self._types[source] = MaterialType(source.name, *compiled(self._device, source))
        return self._types[source]

    def linked(self, types: MaterialTypeSet) -> list[spy.SlangModule]:
        """The modules to link a program with for these types."""
        if plain(types) == {0: STANDARD_SOURCE}:
            return []
        if types not in self._modules:
            self._modules[types] = self._all(types)
        return [self._modules[types]]

    def _standard(self) -> MaterialType:
        alias = f"material_alias_{STANDARD}"
        made = MaterialType(STANDARD, alias, np.dtype([]))
        self._device.module(alias, _STANDARD_SOURCE.format(alias=alias, type=made.struct))
        return made

    def _all(self, types: MaterialTypeSet) -> spy.SlangModule:
        numbered = plain(types)
        made = [self[source] for source in numbered.values()]
        name = f"material_types_{digest(' '.join(f'{n} {m.alias}' for n, m in zip(numbered, made, strict=True)))}"

        def switch(call: str) -> str:
            return cases(list(numbered), [call.format(m.struct) for m in made])

        text = _ALL.format(
            name=name,
            imports="\n".join(f"import {m.alias};" for m in made),
            coverage=switch("return {}.coverage(input);"),
            emission=switch("return {}.emission(input);"),
            evaluate=switch("{}.evaluate(input, surface); return;"),
        )
        return self._device.module(name, text)


def cases(numbers: Sequence[int], statements: Sequence[str]) -> str:
    """The cases of a switch in Slang; the last one is the default."""
    labels = [*(f"case {number}:" for number in numbers[:-1]), "default:"]
    return " ".join(f"{label} {statement}" for label, statement in zip(labels, statements, strict=True))


def fitting_numbers(values: Any, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Numbers as a type that shaders have, whole ones for integers. Raises UnfitError where that is impossible."""
    given = numbers()(values)
    if dtype.kind == "f":
        return floats()(given)
    with np.errstate(invalid="ignore"):
        whole = given.astype(np.int64)
    if (whole != given).any():
        raise UnfitError("are not whole")
    return integers(dtype)(whole)


def plain(types: MaterialTypeSet) -> dict[int, MaterialSource]:
    """The material types alone, by their numbers."""
    return {number: entry for number, entry in enumerate(types) if isinstance(entry, MaterialSource)}


def made(device: Device, recipe: Recipe[Made], types: MaterialTypeSet) -> Made:
    """As Device.product, but errors that Slang finds late (recursion, unbounded generics) are reported as faults of the
    user's types or shapes among these. Raises MaterialTypeError or ShapeError."""
    try:
        return device.product(recipe, types)
    except (DeviceError, RuntimeError) as error:
        fault = fault_of(types, error)
        if fault is None:
            raise
        raise fault from None


def fault_of(types: MaterialTypeSet, error: Exception) -> PicaError | None:
    """The error for the user's files among these types that made a program fail; None without such files."""
    text = str(error.__cause__ or error)
    sources = [source for entry in types for source in _sources(entry) if source != STANDARD_SOURCE]
    for source in sources:
        path = marked(source.path, source.text)
        if str(path) in text:
            return source.fault(first_error(source.path, text.replace(str(path), str(source.path))))
    names = " or ".join(repr(source.name) for source in dict.fromkeys(sources))
    return MaterialTypeError(f"material type {names}: {' '.join(text.split())}") if sources else None


def _sources(entry: TypeEntry) -> list[MaterialSource]:
    match entry:
        case ShapeOn(shape, material):
            return [shape, material]
        case Bundle():
            return []
        case source:
            return [source]


def compiled(device: Device, source: MaterialSource) -> tuple[str, np.dtype[Any]]:
    """Compile a registered file: the module with its struct's alias, and the fields of its `struct Parameters`.

    Raises the source's own error if the file has a fault.
    """
    unique = f"{source.name}_{digest(source.text)}"
    module, alias = f"{source.word}_{unique}", f"{source.word}_alias_{unique}"
    path = marked(source.path, source.text)
    try:
        loaded = device.module(module, source.text, path)
    except (RuntimeError, spy.SlangCompileError) as error:
        raise source.fault(first_error(source.path, str(error).replace(str(path), str(source.path)))) from None
    struct, made_of_it = _implementation(source, loaded)
    parameters = _parameters(source, loaded.layout.find_type_by_name(f"{struct}.Parameters"))
    interface = source.interface_file.removesuffix(".slang").replace("/", ".")
    try:
        text = _ALIAS.format(
            alias=alias,
            interface=interface,
            module=module,
            type=f"{source.word}_struct_{source.name}",
            struct=made_of_it,
        )
        device.module(alias, text)
    except (RuntimeError, spy.SlangCompileError):
        what = f"struct {struct} is not visible; mark it public or leave out the file's `module` line"
        raise source.fault(f"{source.path}: {what}") from None
    return alias, parameters


def _implementation(source: MaterialSource, loaded: spy.SlangModule) -> tuple[str, str]:
    """The name of the one struct that implements an interface."""
    layout = loaded.layout
    interfaces = {name: layout.find_type_by_name(name) for name in source.interfaces}
    structs: Any = loaded.module_decl.children_of_kind(spy.DeclReflection.Kind.struct)
    matches = [
        (struct.name, source.interfaces[name].format(struct.name))
        for struct in structs
        for name, interface in interfaces.items()
        if interface is not None and layout.is_sub_type(layout.find_type_by_name(struct.name), interface)
    ]
    if len(matches) != 1:
        expected = f"{' or '.join(interfaces)} ({source.interface_file})"
        what = (
            f"{len(matches)} structs implement {expected}, not one" if matches else f"no struct implements {expected}"
        )
        raise source.fault(f"{source.path}: {what}")
    return matches[0]


def _parameters(source: MaterialSource, struct: spy.TypeReflection | None) -> np.dtype[Any]:
    fields = []
    struct_fields: Any = struct.fields if struct is not None else []
    for field in struct_fields:
        kind = field.type.kind
        plain = kind in (spy.TypeReflection.Kind.scalar, spy.TypeReflection.Kind.vector)
        if not plain or field.type.scalar_type not in _SCALARS:
            fault = f"parameter {field.name!r} is not a float, int or uint, nor a vector of them"
            raise source.fault(f"{source.path}: {fault}")
        count = field.type.col_count if kind == spy.TypeReflection.Kind.vector else 1
        fields.append((field.name, _SCALARS[field.type.scalar_type], (count,) if count > 1 else ()))
    made = np.dtype(fields)
    if made.itemsize > 4 * MAX_PARAMETERS:
        fault = f"Parameters are {made.itemsize // 4} numbers, more than {MAX_PARAMETERS}"
        raise source.fault(f"{source.path}: {fault}")
    return made


def _listed(names: set[str]) -> str:
    return ", ".join(repr(name) for name in sorted(names))
