"""Rows of arguments on the device: what a program with rows (argument_rows.py) is given, for each view."""

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
import slangpy as spy

from pica.errors import BindingError, DeviceError
from pica.many_views.argument_rows import OF_FILE, READ, WRITTEN
from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device

Writer = Callable[[bytearray, int, Any], None]
"""Takes rows, a byte of theirs, and the value."""
_Kind = spy.TypeReflection.Kind
_CODES = {
    spy.TypeReflection.ScalarType.float32: "f",
    spy.TypeReflection.ScalarType.uint32: "I",
    spy.TypeReflection.ScalarType.int32: "i",
}
_COMPONENTS = {count: attrgetter(*"xyzw"[:count]) for count in (2, 3, 4)}
_NUMBERS = (int, float)


@dataclass(frozen=True)
class Part:
    """A buffer from a byte on, as an argument."""

    buffer: spy.Buffer
    offset: int

    @property
    def device_address(self) -> int:
        """Of its first byte."""
        return int(self.buffer.device_address) + self.offset


@dataclass(frozen=True)
class _Place:
    """Of an argument in a row."""

    offset: int
    write: Writer
    state: spy.ResourceState | None
    """In which a texture must be."""


class RowLayout:
    """Where each argument is in a row."""

    def __init__(self, layout: Any) -> None:
        """`layout`: of a struct, reflected."""
        self.stride = int(layout.stride)
        self.writers: dict[str, _Place] = {}
        for field in layout.fields:
            if field.type_layout.kind == _Kind.struct and field.name.startswith(OF_FILE):
                inner = RowLayout(field.type_layout).writers
                self.writers |= {name: replace(at, offset=field.offset + at.offset) for name, at in inner.items()}
            else:
                name, write, state = _named(field.name, field.type_layout)
                self.writers[name] = _Place(field.offset, write, state)


class RowTable:
    """Rows of some views. A value that stays the same object is not written again."""

    def __init__(self, device: Device, label: str, layout: RowLayout, views: int) -> None:
        self._layout, self._label = layout, label
        self._rows = bytearray(max(views * layout.stride, 16))
        self._bytes = np.frombuffer(self._rows, np.uint8)
        self._values: list[dict[str, Any]] = [{} for _ in range(views)]
        self._changes: dict[int, list[list[Any]]] = {}
        self._complete = set[int]()
        """Views whose rows have all arguments."""
        self._changed = True
        self._textures: list[tuple[spy.Texture, spy.ResourceState]] = []
        self.buffer = device.buffer(label, size=len(self._rows), struct_size=layout.stride)

    def set(self, view: int, values: Mapping[str, Any]) -> None:
        """Arguments of a view; those that a row does not have are passed over."""
        known = self._values[view]
        for name, value in values.items():
            before = known.get(name)
            if before is value or (type(value) in _NUMBERS and before == value):
                continue
            place = self._layout.writers.get(name)
            if place is None:
                continue
            known[name] = value
            place.write(self._rows, view * self._layout.stride + place.offset, value)
            self._changed = True
            if place.state is not None:
                textures = value if isinstance(value, tuple) else (value,)
                self._textures += [(each, place.state) for each in textures if isinstance(each, spy.Texture)]

    def others(self, first: int, changes: list[list[Any]]) -> list[int]:
        """Which of the views from `first` on have other values than when this was asked before, counted from the first.
        `changes`: always of the same arguments."""
        before = self._changes.get(first)
        if changes == before:
            return []
        self._changes[first] = changes
        if before is None or len(before) != len(changes):
            return list(range(len(changes)))
        return [number for number, (now, last) in enumerate(zip(changes, before, strict=True)) if now != last]

    def lacks(self, first: int, count: int) -> bool:
        """Whether arguments of some of `count` views from `first` on were never set."""
        return len(self._complete) < len(self._values) and not self._complete.issuperset(range(first, first + count))

    def check(self, view: int) -> None:
        """A view's row is complete. Raises BindingError if it is not."""
        missing = self._layout.writers.keys() - self._values[view].keys()
        if missing:
            raise BindingError(f"{self._label}: not bound: {', '.join(sorted(missing))}")
        self._complete.add(view)

    def upload(self, encoder: spy.CommandEncoder) -> None:
        """Record the upload of changes. Textures that are new in a row get a layout, which handles do not give them."""
        if self._changed:
            self._changed = False
            encoder.upload_buffer_data(self.buffer, 0, self._bytes)
            for texture, state in self._textures:
                encoder.set_texture_state(texture, state)
            self._textures.clear()


class BlockTable:
    """A parameter block of each view, as rows: others for each state of the histories among its fields."""

    def __init__(self, device: Device, name: str, layout: RowLayout, views: int) -> None:
        self._device, self._layout = device, layout
        self._label, self._views = f"{name} of views", views
        self.blocks: dict[int, ParameterBlock] = {}
        """By their views."""
        self._state = -1
        self._of_state: dict[int, RowTable] = {}
        self._seen: dict[tuple[int, int], int] = {}
        self._seen_of_all = -1

    @property
    def buffer(self) -> spy.Buffer:
        """The rows, after `upload`."""
        return self._of_state[self._state].buffer

    def add(self, first: int, blocks: Sequence[ParameterBlock]) -> None:
        """Those of the views from `first` on."""
        self.blocks.update(enumerate(blocks, first))

    def enter(self, state: int) -> bool:
        """The histories are in this state from now on. Whether the rows of all views but the first have the fields that
        they have in it, so that these need not be bound."""
        if state != self._state:
            self._state, self._seen_of_all = state, -1
        followers = [view for view in self.blocks if view > 0]
        if not all((state, view) in self._seen for view in followers):
            return False
        self._seen.update(((state, view), self.blocks[view].changes) for view in followers)
        return True

    def upload(self, encoder: spy.CommandEncoder) -> None:
        """Record the upload of what the blocks have been given."""
        if self._seen_of_all == ParameterBlock.changes_of_all:
            return
        self._seen_of_all = ParameterBlock.changes_of_all
        table = self._of_state.get(self._state)
        if table is None:
            table = self._of_state[self._state] = RowTable(self._device, self._label, self._layout, self._views)
        for view, block in self.blocks.items():
            if self._seen.get((self._state, view)) != block.changes:
                self._seen[self._state, view] = block.changes
                table.set(view, block.bound)
                table.check(view)
        table.upload(encoder)


def _named(name: str, layout: Any) -> tuple[str, Writer, spy.ResourceState | None]:
    """A field's name as an argument, what writes it, and the state of its textures."""
    for ending, (handle, state) in _HANDLES.items():
        if name.endswith(ending):
            write = _several(handle) if layout.kind == _Kind.array else _single(handle)
            return name.removesuffix(ending), write, state
    return name, _writer(layout), None


def _read_handle(value: Any) -> int:
    return _valid(value.descriptor_handle_ro)


def _write_handle(value: Any) -> int:
    return _valid(value.descriptor_handle_rw)


def _valid(handle: spy.DescriptorHandle) -> int:
    """Its number. Raises DeviceError if the device had none left."""
    if not handle:
        raise DeviceError("no handles are left for the textures of views; make renderers of fewer views")
    return int(handle.value)


_HANDLES = {
    READ: (_read_handle, spy.ResourceState.shader_resource),
    WRITTEN: (_write_handle, spy.ResourceState.unordered_access),
}


def _single(handle: Callable[[Any], int]) -> Writer:
    return lambda rows, at, value: struct.pack_into("<Q", rows, at, handle(value))


def _several(handle: Callable[[Any], int]) -> Writer:
    def write(rows: bytearray, at: int, values: Sequence[Any]) -> None:
        struct.pack_into(f"<{len(values)}Q", rows, at, *map(handle, values))

    return write


def _writer(layout: Any) -> Writer:
    kind = layout.kind
    if kind == _Kind.pointer or layout.type.scalar_type == spy.TypeReflection.ScalarType.uint64:
        return lambda rows, at, value: struct.pack_into("<Q", rows, at, value.device_address)
    if kind == _Kind.scalar:
        form = "<" + _CODES.get(layout.type.scalar_type, "I")  # a boolean has four bytes
        return lambda rows, at, value: struct.pack_into(form, rows, at, value)
    if kind == _Kind.vector:
        count = int(layout.type.col_count)
        form = f"<{count}{_CODES[layout.type.scalar_type]}"
        return lambda rows, at, value: struct.pack_into(form, rows, at, *_components(value, count))
    if kind == _Kind.array:
        element = layout.element_type_layout
        write, stride = _writer(element), int(element.stride)

        def write_all(rows: bytearray, at: int, values: Sequence[Any]) -> None:
            for number, value in enumerate(values):
                write(rows, at + number * stride, value)

        return write_all
    if kind == _Kind.struct:
        return _struct_writer(layout)
    raise TypeError(f"no row has arguments of the type {layout.type.full_name}")


def _components(value: Any, count: int) -> Sequence[Any]:
    try:
        return _COMPONENTS[count](value)
    except AttributeError:
        return list(value)


def _struct_writer(layout: Any) -> Writer:
    """Of a dictionary of numbers and vectors, such as a camera, at once."""
    form, end = "<", 0
    parts: list[tuple[str, int]] = []
    for field in layout.fields:
        scalar = field.type_layout.kind == _Kind.scalar
        count = 1 if scalar else int(field.type_layout.type.col_count)
        form += f"{field.offset - end}x{count}{_CODES[field.type_layout.type.scalar_type]}"
        end = field.offset + 4 * count
        parts.append((field.name, 0 if scalar else count))

    def write(rows: bytearray, at: int, value: Mapping[str, Any]) -> None:
        numbers: list[Any] = []
        for name, count in parts:
            if count:
                numbers += _components(value[name], count)
            else:
                numbers.append(value[name])
        struct.pack_into(form, rows, at, *numbers)

    return write
