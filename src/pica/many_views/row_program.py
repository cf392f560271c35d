"""A program with rows of arguments (argument_rows.py) on the device: one dispatch for several views."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import slangpy as spy

from pica.graph.nodes import Node
from pica.many_views.argument_rows import OF_BLOCK, PLACE, ROWS, VIEW_BLOCKS
from pica.many_views.row_tables import BlockTable, RowLayout, RowTable
from pica.rhi.binding import ParameterBlock, ProgramParameters, parameters_of
from pica.rhi.device import Device
from pica.rhi.passes import Recording


@dataclass
class Run:
    """Views one after the other whose nodes have the same grid, and histories in the same state."""

    first: int
    state: int
    threads: tuple[int, ...]
    """Of each view."""
    nodes: list[Node]
    frames: list[Any]

    @cached_property
    def changes(self) -> list[list[Any]]:
        """Of each view, arguments that may be others in each frame, by Node.functions; empty if there are none."""
        if not any(node.functions for node in self.nodes):
            return []
        return [
            [find(frame) for _, find in node.functions] for node, frame in zip(self.nodes, self.frames, strict=True)
        ]

    def changed(self, number: int) -> dict[str, Any]:
        """The same of a view, counted from the first, by their names."""
        names = (name for name, _ in self.nodes[number].functions)
        return dict(zip(names, self.changes[number], strict=True))

    def all_of(self, number: int) -> dict[str, Any]:
        """All arguments of a view, counted from the first."""
        return self.nodes[number].resolve(self.frames[number])

    @property
    def given(self) -> dict[str, Any]:
        """The first view's arguments that do not change from frame to frame."""
        return self.nodes[0].values


class BlockTables:
    """Rows of the views' parameter blocks, which all programs share."""

    def __init__(self, device: Device, views: int) -> None:
        self._device, self._views = device, views
        self._of_block: dict[int, BlockTable] = {}
        """By the block's id; the table keeps it."""

    def of(self, name: str, first: int, blocks: Sequence[ParameterBlock], layout: RowLayout) -> BlockTable:
        """The rows of these blocks, of the views from `first` on."""
        table = self._of_block.get(id(blocks[0]))
        if table is None or any(self._of_block.get(id(block)) is not table for block in blocks):
            table = BlockTable(self._device, name, layout, self._views)
            table.add(first, blocks)
            self._of_block.update((id(block), table) for block in blocks)
        return table

    def table(self, block: ParameterBlock) -> BlockTable | None:
        """The rows that this one is in."""
        return self._of_block.get(id(block))

    def clear(self) -> None:
        """Forget them all. Blocks are given what was only noted."""
        for table in self._of_block.values():
            for block in table.blocks.values():
                block.settle()
        self._of_block.clear()

    def defer(self) -> None:
        """Blocks of all views but the first need only be noted: no program without rows is given them."""
        for table in set(self._of_block.values()):
            for view, block in table.blocks.items():
                if view > 0:
                    block.defer()


class RowProgram:
    """A program, and what it is given for each view. Each state of the histories has rows of its own, as passes have
    parameters."""

    def __init__(self, device: Device, name: str, program: spy.ShaderProgram, blocks: BlockTables, views: int) -> None:
        self._device, self._name, self._program, self._views = device, name, program, views
        self._block_tables = blocks
        layouts = {each.name: each.type_layout for each in parameters_of(program)}
        self._row = RowLayout(layouts.pop(ROWS).element_type_layout)
        del layouts[PLACE]
        names = [block for block in VIEW_BLOCKS if block + OF_BLOCK in layouts]
        self._blocks = {name: RowLayout(layouts.pop(name + OF_BLOCK).element_type_layout) for name in names}
        self._shared = tuple(layouts)
        self._variants: dict[tuple[int, int], tuple[ProgramParameters, RowTable]] = {}
        self._places: dict[tuple[int, int], spy.uint2] = {}
        self._tables: dict[tuple[int, int], dict[str, BlockTable]] = {}

    def forget(self) -> None:
        """Drop all arguments."""
        self._variants.clear()
        self._tables.clear()

    def root(
        self,
        recording: Recording,
        run: Run,
        along_z: int,
        more: Sequence[Mapping[str, Any]] = (),
        part: int = 0,
        shared: Mapping[str, Any] = MappingProxyType({}),
    ) -> spy.ShaderObject:
        """The root object of a dispatch for a run of views. `along_z`: groups of each. `more`: arguments of each view
        beside those of its node, always the same for each `part`. `shared`: those that are no part of a row, beside
        those of the first node. Raises BindingError as Parameters."""
        parameters, table = self._variant(run.state, part)
        if table.lacks(run.first, len(run.nodes)):
            for number, view in enumerate(range(run.first, run.first + len(run.nodes))):
                table.set(view, run.all_of(number))
                if more:
                    table.set(view, more[view])
                table.check(view)
        else:
            for number in table.others(run.first, run.changes):
                table.set(run.first + number, run.changed(number))
        table.upload(recording.encoder)
        tables = self._tables_of(run)
        for rows in tables.values():
            rows.upload(recording.encoder)
        bound = {name: shared[name] if name in shared else run.given[name] for name in self._shared}
        bound |= {name: rows.buffer for name, rows in tables.items()}
        bound[ROWS] = table.buffer
        bound[PLACE] = self._places.setdefault((run.first, along_z), spy.uint2(run.first, along_z))
        parameters.bind_all(bound)
        return parameters.root

    def _variant(self, state: int, part: int) -> tuple[ProgramParameters, RowTable]:
        made = self._variants.get((state, part))
        if made is None:
            parameters = ProgramParameters(self._device.handle, self._name, self._program)
            table = RowTable(self._device, f"{self._name} arguments", self._row, self._views)
            made = self._variants[state, part] = parameters, table
        return made

    def _tables_of(self, run: Run) -> dict[str, BlockTable]:
        """Rows of the views' blocks, by the names of their parameters."""
        key = run.first, len(run.nodes)
        tables = self._tables.get(key)
        if tables is None:
            tables = self._tables[key] = {}
            for name, layout in self._blocks.items():
                blocks = [_block(node.values[name]) for node in run.nodes]
                tables[name + OF_BLOCK] = self._block_tables.of(name, run.first, blocks, layout)
        return tables


def _block(value: Any) -> ParameterBlock:
    found: ParameterBlock = value if isinstance(value, ParameterBlock) else value.block
    return found
