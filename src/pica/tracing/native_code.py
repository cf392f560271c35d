"""Small functions written with Python's operators, compiled to machine code in some milliseconds by LLVM.

A function is traced: it is called once by `machine_code`, with symbolic arguments, and all operations on these are
recorded as instructions.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

from llvmlite import binding, ir

WORD, UINT, FLOAT = ir.IntType(64), ir.IntType(32), ir.FloatType()
"""Addresses and counts; other memory content."""


class Number:
    """A number that machine code will have: a WORD, UINT, FLOAT or truth. Whole ones have no sign."""

    def __init__(self, code: "Code", value: ir.Value) -> None:
        self._code, self.value = code, value

    def __add__(self, other: "Number | float") -> "Number":
        return self._both(other, "fadd", "add")

    def __sub__(self, other: "Number | float") -> "Number":
        return self._both(other, "fsub", "sub")

    def __mul__(self, other: "Number | float") -> "Number":
        return self._both(other, "fmul", "mul")

    def __and__(self, other: "Number | int") -> "Number":
        return self._both(other, "", "and_")

    def __or__(self, other: "Number | int") -> "Number":
        return self._both(other, "", "or_")

    def __xor__(self, other: "Number | int") -> "Number":
        return self._both(other, "", "xor")

    def __rshift__(self, bits: int) -> "Number":
        return self._both(bits, "", "lshr")

    def __lt__(self, other: "Number | float") -> "Number":
        return self._compared(other, "<")

    def __gt__(self, other: "Number | float") -> "Number":
        return self._compared(other, ">")

    def equals(self, other: "Number | int") -> "Number":
        """Whether both are the same."""
        return self._compared(other, "==")

    def differs(self, other: "Number | int") -> "Number":
        """Whether they are not."""
        return self._compared(other, "!=")

    def word(self) -> "Number":
        """As wide as addresses are."""
        return Number(self._code, self._code.builder.zext(self.value, WORD))

    def _both(self, other: "Number | float", floating: str, whole: str) -> "Number":
        name = floating if self.value.type == FLOAT else whole
        return Number(self._code, getattr(self._code.builder, name)(self.value, self._like(other)))

    def _compared(self, other: "Number | float", sign: str) -> "Number":
        builder = self._code.builder
        compare = builder.fcmp_ordered if self.value.type == FLOAT else builder.icmp_unsigned
        return Number(self._code, compare(sign, self.value, self._like(other)))

    def _like(self, other: "Number | float") -> ir.Value:
        return other.value if isinstance(other, Number) else ir.Constant(self.value.type, other)


class Row:
    """Numbers in memory from an address on."""

    def __init__(self, code: "Code", kind: ir.Type, address: Number) -> None:
        self._code, self._kind, self._address = code, kind, address

    def __getitem__(self, index: Number | int) -> Number:
        return Number(self._code, self._code.builder.load(self._pointer(index), typ=self._kind))

    def __setitem__(self, index: Number | int, value: Number | float) -> None:
        stored = value.value if isinstance(value, Number) else ir.Constant(self._kind, value)
        self._code.builder.store(stored, self._pointer(index))

    def _pointer(self, index: Number | int) -> ir.Value:
        place = self._address + index * (8 if self._kind == WORD else 4)
        return self._code.builder.inttoptr(place.value, self._kind.as_pointer())


class Code:
    """Writes one function."""

    def __init__(self, builder: ir.IRBuilder) -> None:
        self.builder = builder

    def uints(self, address: Number) -> Row:
        """The value at an address, as UINT."""
        return Row(self, UINT, address)

    def floats(self, address: Number) -> Row:
        """The value at an address, as FLOAT."""
        return Row(self, FLOAT, address)

    def words(self, address: Number) -> Row:
        """The value at an address, as WORD."""
        return Row(self, WORD, address)

    @contextmanager
    def loop(self, end: Number | int, step: int = 1) -> Iterator[Number]:
        """The block for 0, `step`, ... below `end`."""
        builder = self.builder
        before, head, body, after = builder.block, *(builder.append_basic_block() for _ in range(3))
        builder.branch(head)
        builder.position_at_end(head)
        index = builder.phi(WORD)
        index.add_incoming(ir.Constant(WORD, 0), before)
        number = Number(self, index)
        builder.cbranch((number < end).value, body, after)
        builder.position_at_end(body)
        yield number
        index.add_incoming((number + step).value, builder.block)
        builder.branch(head)
        builder.position_at_end(after)

    @contextmanager
    def when(self, condition: Number) -> Iterator[None]:
        """The block where the condition holds."""
        with self.builder.if_then(condition.value):
            yield

    def choose(self, condition: Number, if_true: Number, if_false: Number | int) -> Number:
        """One of two."""
        other = if_false.value if isinstance(if_false, Number) else ir.Constant(if_true.value.type, if_false)
        return Number(self, self.builder.select(condition.value, if_true.value, other))

    def call(self, function: Number, *arguments: Number) -> None:
        """Call the C function at an address, all of whose parameters are pointers."""
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * len(arguments)).as_pointer()
        pointers = [self.builder.inttoptr(argument.value, pointer) for argument in arguments]
        self.builder.call(self.builder.inttoptr(function.value, kind), pointers)


class Variable:
    """A WORD that may change."""

    def __init__(self, code: Code) -> None:
        self._code = code
        with code.builder.goto_entry_block():
            self._place = code.builder.alloca(WORD)
        self.set(Number(code, ir.Constant(WORD, 0)))

    def get(self) -> Number:
        """As it is now."""
        return Number(self._code, self._code.builder.load(self._place, typ=WORD))

    def set(self, value: Number) -> None:
        """Assign a new value."""
        self._code.builder.store(value.value, self._place)


@dataclass(frozen=True)
class MachineCode:
    """Compiled functions, by name; they live as long as this does."""

    engine: Any

    def address(self, name: str) -> int:
        """Where a function lies, for C to call it."""
        return int(self.engine.get_function_address(name))


def machine_code(functions: dict[str, tuple[int, Callable[..., None]]]) -> MachineCode:
    """Compile functions for this processor: number of WORD parameters of each, and a callable on a Code and these."""
    _initialize()
    module = ir.Module()
    for name, (count, write) in functions.items():
        function = ir.Function(module, ir.FunctionType(ir.VoidType(), [WORD] * count), name)
        code = Code(ir.IRBuilder(function.append_basic_block()))
        write(code, *(Number(code, argument) for argument in function.args))
        code.builder.ret_void()
    features = binding.get_host_cpu_features().flatten()
    machine = binding.Target.from_default_triple().create_target_machine(binding.get_host_cpu_name(), features, opt=3)
    parsed = binding.parse_assembly(str(module))
    engine = binding.create_mcjit_compiler(parsed, machine)
    engine.finalize_object()
    return MachineCode(engine)


@cache
def _initialize() -> None:
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
