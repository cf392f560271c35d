"""Shader parameters by name, checked against reflection: unbound and unknown names are errors.

SlangPy silently reads zero from an unbound resource; here that is a BindingError before the first
dispatch. Values are written only when they change, so a pass costs a few microseconds.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import slangpy as spy

from pica.errors import BindingError, DeviceError

_MOST_TEXELS = 1 << 27
"""Largest typed buffer that drivers support (maxTexelBufferElements of NVIDIA's and of lavapipe)."""
_BLOCKS = (spy.TypeReflection.Kind.parameter_block, spy.TypeReflection.Kind.constant_buffer)


def word_of_rows(size: int) -> tuple[spy.Format, int]:
    """What shaders read rows of this many bytes by (rhi/rows.slang), and its bytes."""
    if size % 16 == 0:
        return spy.Format.rgba32_uint, 16
    return (spy.Format.rgb32_uint, 12) if size == 12 else (spy.Format.r32_uint, 4)


def parameters_of(program: spy.ShaderProgram) -> list[Any]:
    """The program's global parameters, reflected."""
    parameters = program.layout.parameters
    return [parameters[index] for index in range(len(parameters))]


class Parameters:
    """The named parameters of a program or of a block."""

    def __init__(self, what: str, target: Any, fields: Iterable[Any]) -> None:
        """`fields`: reflected."""
        self._what = what
        self._target = target
        self._cursor = spy.ShaderCursor(target)
        kinds = {field.name: field.type_layout.kind for field in fields}
        self._names = set(kinds)
        self._unbound = set(kinds)
        self._structs = {name for name, kind in kinds.items() if kind == spy.TypeReflection.Kind.struct}
        self.bound: dict[str, Any] = {}
        """The values, by name."""

    def bind(self, **values: Any) -> None:
        """Set parameters by name; objects with a `block`, such as a scene or a G-buffer, are bound as that block.

        Raises BindingError for a name that the shader does not have, DeviceError for a table that exceeds its limits.
        """
        for name, value in values.items():
            if self.bound.get(name) is not value:
                self._bind(name, value)

    def bind_all(self, values: Mapping[str, Any]) -> None:
        """As `bind`; raises BindingError too while a parameter has never been bound."""
        bound = self.bound
        for name, value in values.items():
            if bound.get(name) is not value:
                self._bind(name, value)
        if self._unbound:
            self.check()

    def _bind(self, name: str, value: Any) -> None:
        if name not in self._names:
            raise BindingError(f"{self._what}: no parameter {name!r}; it has {', '.join(sorted(self._names))}")
        block = value if isinstance(value, ParameterBlock) else getattr(value, "block", None)
        if block is not None:
            block.check()
        if name in self._structs and isinstance(value, spy.Buffer):
            self._bind_rows(name, value)
        else:
            self._cursor[name] = value if block is None else block.shader_object
        self.bound[name] = value
        self._unbound.discard(name)

    def _bind_rows(self, name: str, table: spy.Buffer) -> None:
        """As rhi/rows.slang reads it."""
        most = _MOST_TEXELS * word_of_rows(table.struct_size)[1]
        if table.size > most:
            raise DeviceError(f"{self._what}: {name}: {table.size:,} bytes, of which shaders can read {most:,}")
        self._cursor[name] = {"words": table}

    def check(self) -> None:
        """Raises BindingError while a parameter has never been bound."""
        if self._unbound:
            raise BindingError(f"{self._what}: not bound: {', '.join(sorted(self._unbound))}")


class ParameterBlock(Parameters):
    """A `ParameterBlock` of a shader module, filled once and shared by every pass that declares it."""

    changes_of_all = 0
    """Counts values as they are set in any block."""

    def __init__(self, device: spy.Device, program: spy.ShaderProgram, module: str, name: str) -> None:
        """`program` must live as long as the device: see Device.parameter_block."""
        layout = next((p for p in parameters_of(program) if p.name == name), None)
        if layout is None or layout.type_layout.kind not in _BLOCKS:
            raise BindingError(f"{module}: no parameter block {name!r}")
        self.changes = 0
        """Counts values as they are set."""
        self._late: set[str] | None = None
        """Names of values that are only noted; None: there are none, and none are noted."""
        self.shader_object = device.create_shader_object(program.reflection[name])
        super().__init__(
            f"{module}: block {name!r}",
            self.shader_object,
            layout.type_layout.element_type_layout.fields,
        )

    def defer(self) -> None:
        """Only note values from now on: programs with rows (many_views/) read `bound`."""
        if self._late is None:
            self._late = set()

    def settle(self) -> None:
        """Set what was noted, and all values again when they are bound."""
        late, self._late = self._late, None
        for name in late or ():
            self._bind(name, self.bound[name])

    def _bind(self, name: str, value: Any) -> None:
        ParameterBlock.changes_of_all += 1
        self.changes += 1
        if self._late is None:
            super()._bind(name, value)
        else:
            self._late.add(name)
            self.bound[name] = value


class ProgramParameters(Parameters):
    """The global parameters of a linked program, in a root object built once."""

    def __init__(self, device: spy.Device, what: str, program: spy.ShaderProgram) -> None:
        self._program = program
        self.root = device.create_root_shader_object(program)
        super().__init__(what, self.root, parameters_of(program))


def empty_root(device: spy.Device, program: spy.ShaderProgram) -> spy.ShaderObject:
    """A root object with empty blocks, valid only for a dispatch of no threads."""
    root = device.create_root_shader_object(program)
    cursor = spy.ShaderCursor(root)
    for parameter in parameters_of(program):
        if parameter.type_layout.kind in _BLOCKS:
            cursor[parameter.name] = device.create_shader_object(program.reflection[parameter.name])
    return root
