"""Frames of several views, node by node: one dispatch for all, where the step has a program with rows."""

from collections import defaultdict
from collections.abc import Hashable, Iterator, Sequence, Set
from itertools import groupby
from typing import Any

from pica.graph.nodes import BlockNode, Node, PassNode
from pica.graph.plan import Capture, Plan, PlanPart
from pica.graph.resources import Texture
from pica.graph.snapshot import SnapshotMemory
from pica.many_views.row_program import BlockTables, Run
from pica.many_views.row_steps import RowSteps
from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device
from pica.rhi.passes import Recording

_SHARE = 0.75
"""Of all handles; the rest is for other renderers."""
_DISPATCHES = 12
"""In a submission: the device works while the rest is recorded."""


class _Entry:
    """Nodes of several views that do the same."""

    def __init__(self, key: Hashable) -> None:
        self.key = key
        self._kept: BlockTables | None = None
        self.views: list[int] = []
        self.nodes: list[Node] = []
        """Theirs."""

    def complete(self, plans: Sequence[Plan], steps: RowSteps) -> None:
        """All its nodes are known."""
        first = self.nodes[0]
        self.scope = first.scope
        self.owner = PlanPart(plans[self.views[0]].serial, first.scope, first.index)
        self.step = steps.of(self.key, first.step) if isinstance(first, PassNode) else None
        self._is_conditional = any(node.when is not None for node in self.nodes)
        values = [value for node in self.nodes for value in node.values.values()]
        self.blocks = [value for value in values if isinstance(value, ParameterBlock)]
        """Those of nodes that are recorded alone."""
        grids = {node.threads for node in self.nodes if isinstance(node, PassNode)}
        self._is_fixed = len(grids) == 1 and not any(map(callable, grids))
        self._follow = self.views == list(range(self.views[0], self.views[0] + len(self.views)))
        count = len(first.states)
        self._histories = [[node.states[number] for node in self.nodes] for number in range(count)]

    def keep_blocks(self, tables: BlockTables, alone: Set[int]) -> None:
        """If it binds blocks: only once for each state of their histories. `alone`: ids of those for which rows are
        not enough."""
        of_blocks = [node for node in self.nodes if isinstance(node, BlockNode)]
        change = any(node.functions or id(node.parameters) in alone for node in of_blocks)
        if len(of_blocks) == len(self.nodes) and self._histories and self.views[0] == 0 and not change:
            self._kept = tables

    def record(self, recording: Recording, frames: Sequence[Any]) -> int:
        """Record the nodes that run in these frames, merged if there is a step for it; returns the dispatches."""
        if self._kept is not None and self._has_entered(self._kept, frames):
            self.nodes[0].record(frames[0])
            return 0
        views, nodes = self._active(frames)
        if self.step is None:
            for block in self.blocks:
                block.settle()
            for view, node in zip(views, nodes, strict=True):
                node.record(frames[view])
            return 0
        runs = self._runs(views, nodes, frames)
        for run in runs:
            self.step.record(recording, run)
        return len(runs)

    def _has_entered(self, tables: BlockTables, frames: Sequence[Any]) -> bool:
        """Whether rows have its blocks as they are in the histories' state."""
        first = self.nodes[0]
        assert isinstance(first, BlockNode)
        table = tables.table(first.parameters)
        return table is not None and self._is_uniform(frames) and table.enter(first.state_in(frames[0]))

    def _active(self, frames: Sequence[Any]) -> tuple[list[int], list[Node]]:
        if not self._is_conditional:
            return self.views, self.nodes
        run = [
            (view, node)
            for view, node in zip(self.views, self.nodes, strict=True)
            if node.when is None or node.when(frames[view])
        ]
        return [view for view, _ in run], [node for _, node in run]

    def _runs(self, views: list[int], nodes: list[Node], frames: Sequence[Any]) -> list[Run]:
        """Views one after the other whose nodes have the same grid and state."""
        for view, node in zip(views, nodes, strict=True):
            if not node.swapped:
                break
            for state in node.swapped:
                state.swap(frames[view])
        if not views:
            return []
        if views is self.views and self._follow and self._is_fixed and self._is_uniform(frames):
            return [self._run(views, nodes, frames)]
        place = iter(range(len(views)))
        alike = [
            (view - next(place), node.state_in(frames[view]), _threads(node, frames[view]))
            for view, node in zip(views, nodes, strict=True)
        ]
        runs, done = [], 0
        for _, group in groupby(alike):
            end = done + len(list(group))
            runs.append(self._run(views[done:end], nodes[done:end], frames))
            done = end
        return runs

    def _is_uniform(self, frames: Sequence[Any]) -> bool:
        """Whether the histories of all views are in the same state."""
        return all(
            len({state.parity for state in column}) == 1
            and len({state.is_swapped_in(frames[view]) for view, state in zip(self.views, column, strict=True)}) == 1
            for column in self._histories
        )

    def _run(self, views: list[int], nodes: list[Node], frames: Sequence[Any]) -> Run:
        frame = frames[views[0]]
        of_views = [frames[view] for view in views]
        return Run(views[0], nodes[0].state_in(frame), _threads(nodes[0], frame), nodes, of_views)


class MergedFrames:
    """Records frames of several views together."""

    def __init__(self, device: Device, views: int) -> None:
        self._device, self._views = device, views
        self._steps = RowSteps(device, views)
        self._plans: tuple[Plan, ...] = ()
        self._entries: list[_Entry] = []

    def takes(self, plans: Sequence[Plan]) -> bool:
        """Whether frames of these plans can be recorded together: no node waits for the device, and this has handles
        for the textures of as many views."""
        if self._plans == tuple(plans):
            return True
        handles = sum(map(_handles, plans)) * self._views // len(plans)
        return handles <= _SHARE * self._device.handles and not any(map(_waits, plans))

    def expect(self, plan: Plan) -> None:
        """Programs with rows are made for its nodes, in place of their own."""
        for key, node in _keyed(plan):
            if isinstance(node, PassNode):
                self._steps.of(key, node.step)

    def replay(self, plans: Sequence[Plan], frames: Sequence[Any], only: str | None = None) -> list[dict[str, Capture]]:
        """Record a frame of each view; all have the same recording. Returns what each has captured. `only`: as
        Plan.replay."""
        if self._plans != tuple(plans):
            self._merge(plans)
        captured: list[dict[str, Capture]] = [{} for _ in frames]
        wanted = self._wanted(frames)
        recording, dispatches, waits = frames[0].recording, 0, False
        for entry in self._entries:
            if only is not None and entry.scope != only:
                continue
            recording.profiler.owner = entry.owner
            if entry.step is None:
                waits = _finished(recording, waits)
            new = entry.record(recording, frames)
            dispatches, waits = dispatches + new, waits or new > 0
            if entry.key in wanted:
                waits = _finished(recording, waits)
                self._capture(wanted[entry.key], frames, captured)
            if dispatches >= _DISPATCHES:
                dispatches, waits = 0, _finished(recording, waits)
                self._device.submit(recording)
        _finished(recording, waits)
        recording.profiler.owner = None
        self._steps.blocks.defer()
        return captured

    def stop(self) -> None:
        """Frames are recorded one by one."""
        self._steps.renew(())
        self._plans = ()

    def _merge(self, plans: Sequence[Plan]) -> None:
        self._plans, self._entries = tuple(plans), _merged(plans)
        self._steps.renew({entry.key for entry in self._entries})
        self._entry_of: dict[tuple[int, int], Hashable] = {}
        for entry in self._entries:
            entry.complete(plans, self._steps)
            self._entry_of.update(
                ((view, node.index), entry.key) for view, node in zip(entry.views, entry.nodes, strict=True)
            )
        alone = {id(block) for entry in self._entries if entry.step is None for block in entry.blocks}
        for entry in self._entries:
            entry.keep_blocks(self._steps.blocks, alone)

    def _wanted(self, frames: Sequence[Any]) -> dict[Hashable, dict[str, list[int]]]:
        """Names of the offers to capture after each entry, and for which views."""
        wanted: dict[Hashable, dict[str, list[int]]] = {}
        for view, (plan, frame) in enumerate(zip(self._plans, frames, strict=True)):
            for index, names in plan.captures_of(frame.requested).items():
                of_entry = wanted.setdefault(self._entry_of[view, index], {})
                for name in names:
                    of_entry.setdefault(name, []).append(view)
        return wanted

    def _capture(
        self, names: dict[str, list[int]], frames: Sequence[Any], captured: Sequence[dict[str, Capture]]
    ) -> None:
        """Those of all views into the same memory, which is then read at once."""
        for name, views in names.items():
            sources = self._plans[views[0]].offers[name].sources
            memory = [SnapshotMemory(self._device, len(views)) for _ in sources]
            for view in views:
                captured[view][name] = self._plans[view].capture(frames[view], name, memory)


def _waits(plan: Plan) -> bool:
    """Whether some node waits for the device."""
    return any(hasattr(node.step, "record_in_parts") for node in plan.nodes if isinstance(node, PassNode))


def _handles(plan: Plan) -> int:
    """How many its textures need at most: to read and to write, and histories twice."""
    textures = [resource for resource in plan.resources if isinstance(resource, Texture)]
    return 2 * sum(1 if texture.history is None else 2 for texture in textures)


def _finished(recording: Recording, waits: bool) -> bool:
    """What merged passes have written is there for others: Slang-RHI does not see what they reach by handles."""
    if waits:
        recording.encoder.global_barrier()
    return False


def _threads(node: Node, frame: Any) -> tuple[int, ...]:
    assert isinstance(node, PassNode)
    return node.threads(frame) if callable(node.threads) else node.threads


def _merged(plans: Sequence[Plan]) -> list[_Entry]:
    """The nodes of all plans in one order: that of each plan, whose nodes others may lack."""
    entries: list[_Entry] = []
    for view, plan in enumerate(plans):
        known = {entry.key: place for place, entry in enumerate(entries)}
        place = -1
        for key, node in _keyed(plan):
            if key in known:
                assert known[key] > place, f"{node} is in another order in another view"
                place = known[key]
            else:
                place += 1
                entries.insert(place, _Entry(key))
                known = {entry.key: number for number, entry in enumerate(entries)}
            entries[place].views.append(view)
            entries[place].nodes.append(node)
    return entries


def _keyed(plan: Plan) -> Iterator[tuple[Hashable, Node]]:
    """Nodes by where they were added, and how many were added there before."""
    counts: defaultdict[Hashable, int] = defaultdict(int)
    for node in plan.nodes:
        kind = node.scope, node.name, node.where
        yield (*kind, counts[kind]), node
        counts[kind] += 1
