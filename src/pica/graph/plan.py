"""A compiled graph: checked, with memory for each resource, replayed each frame."""

from collections import defaultdict
from collections.abc import Collection, Generator, Hashable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from typing import Any, NamedTuple

from pica.errors import GraphError
from pica.graph.graph import FrameGraph
from pica.graph.nodes import Frame, Node, Parts, lives_in_frame
from pica.graph.offers import Array, Offer, Read
from pica.graph.resources import Buffer, Lifetime, Resource, Texture
from pica.graph.snapshot import Snapshot, SnapshotMemory
from pica.rhi.device import Device

OUTSIDE = "scene"
"""The owner of passes outside of graphs: updates of the scene before a frame."""
_numbers = count()


class PlanPart(NamedTuple):
    """A node of a plan, as the profiler's owner of passes."""

    plan: int
    """`Plan.serial`."""
    effect: str
    node: int
    copy: str = ""
    """Name of a copy between devices that it makes."""


def part_of(serial: int, owner: Hashable) -> bool:
    """Whether the profiler's owner is a node of this plan."""
    return isinstance(owner, PlanPart) and owner.plan == serial


@dataclass(frozen=True, eq=False)
class Capture:
    """The content of an offer at its point of a frame; a call fetches it."""

    device: Device
    read: Read
    parts: list[Snapshot]

    def __call__(self) -> Array:
        """Waits for the device."""
        with self.device.lock:
            if not all(part.is_read for part in self.parts):
                self.device.submissions.wait_for_all()
            return self.read(*(part.array() for part in self.parts))


Replay = Generator[None, float | None, dict[str, Capture]]
"""Records a frame, as Parts."""


def _owned(parts: Parts, frame: Frame, owner: PlanPart) -> Parts:
    """Parts of a node, whose passes it owns although other replays go on between them."""
    seconds: float | None = None
    with suppress(StopIteration):
        while True:
            parts.send(seconds)
            seconds = yield
            frame.profiler.owner = owner


class Plan:
    """The passes of a frame in their order, ready to be recorded."""

    def __init__(self, graph: FrameGraph) -> None:
        """Raises GraphError for a resource that is never written, read before it is written, or declared by
        another graph."""
        self.serial = next(_numbers)
        """Distinguishes it from all other plans."""
        self.nodes = graph.nodes
        self.resources = [resource for resource in graph.resources if resource.writers or resource.readers]
        self.offers = graph.offers
        self._device = graph.device
        self._captures: dict[frozenset[str], dict[int, list[str]]] = {}
        self._check_declared(graph.resources)
        for resource in self.resources:
            _check(resource)
        self.spans = self._spans()
        """First and last node that use each resource which shares memory."""
        self.places = self._place()
        """Which of the textures and buffers that are alike it has."""
        kept = [
            resource
            for resource in self.resources
            if resource not in self.spans and resource.lifetime is not Lifetime.HISTORY
        ]
        graph.memory.allocate(kept, graph.histories, self.places.items())
        for node in self.nodes:
            node.bind()
        self._parts = [PlanPart(self.serial, node.scope, node.index) for node in self.nodes]
        for resource in graph.resources:  # or a plan were a circle, and its memory stayed until that is collected
            resource.writers, resource.readers = [], []
        self.memory = graph.memory

    def replay(self, frame: Frame, only: str | None = None) -> dict[str, Capture]:
        """Record the frame. Returns a function for each offer in `frame.requested`, which waits for the device.

        `only`: the passes of this effect alone.
        """
        replay, seconds = self.replay_in_parts(frame, only), None
        while True:
            try:
                replay.send(seconds)
            except StopIteration as end:
                captured: dict[str, Capture] = end.value
                return captured
            seconds = self._device.finish(frame)

    def replay_in_parts(self, frame: Frame, only: str | None = None) -> Replay:
        """As `replay`, for a caller that submits what is recorded at each yield."""
        captures = self.captures_of(frame.requested)
        fetched: dict[str, Capture] = {}
        for node, owner in zip(self.nodes, self._parts, strict=True):
            if only is not None and node.scope != only:
                continue
            if node.when is None or node.when(frame):
                frame.profiler.owner = owner
                parts = node.record(frame)
                if parts is not None:
                    yield from _owned(parts, frame, owner)
            for name in captures.get(node.index, ()):
                fetched[name] = self.capture(frame, name)
        frame.profiler.owner = None
        return fetched

    def names(self, scope: str, requested: Collection[str] | None) -> set[str]:
        """AOVs of one effect: those requested, or None for all that are not on request."""
        return {offer.name for offer in self._selected(requested, debug=False) if offer.scope == scope}

    def names_but(self, scope: str, requested: Collection[str] | None, debug: bool) -> set[str]:
        """The same of all other effects; `debug`: debug AOVs too."""
        return {offer.name for offer in self._selected(requested, debug) if offer.scope != scope}

    def lacks(self, names: Collection[str]) -> frozenset[str]:
        """Of these offers, those whose passes require a new declaration of the frame."""
        return frozenset(name for name in names if name in self.offers and not self.offers[name].is_declared)

    def names_of(self, kind: str) -> frozenset[str]:
        """All offers whose names begin with this and a dot."""
        return frozenset(name for name in self.offers if name.startswith(f"{kind}."))

    def _check_declared(self, resources: Collection[Resource]) -> None:
        declared = set(resources)
        for node in self.nodes:
            for resource in (*node.reads, *node.writes, *node.previous):
                if resource not in declared:
                    raise GraphError(f"{node} uses {resource} of another graph; declare it in each")

    def _selected(self, requested: Collection[str] | None, debug: bool) -> list[Offer]:
        pictures = ("color", "display")
        if requested is not None:
            return [self.offers[name] for name in requested if name in self.offers and name not in pictures]
        offered = [offer for offer in self.offers.values() if offer.name not in pictures]
        views = [offer for offer in offered if debug and offer.name.startswith("debug.")]
        return [offer for offer in offered if offer.is_aov and not offer.on_request] + views

    def captures_of(self, names: frozenset[str]) -> dict[int, list[str]]:
        """Those of these offers that are captured after each node, by its number."""
        if names not in self._captures:
            names_after: defaultdict[int, list[str]] = defaultdict(list)
            for name, offer in self.offers.items():  # in the order of the frame
                if name in names:
                    names_after[offer.after].append(name)
            self._captures = {names: dict(names_after)}  # of the newest question alone
        return self._captures[names]

    def capture(self, frame: Frame, name: str, memory: Sequence[SnapshotMemory] | None = None) -> Capture:
        """Record the copy of an offer's content at this point of the frame. `memory`: for each of its sources."""
        offer = self.offers[name]
        read = offer.read or (offer.prepare and offer.prepare(frame))
        assert read is not None
        shared: Sequence[SnapshotMemory | None] = memory or [None] * len(offer.sources)
        parts = [
            Snapshot(self._device, frame.encoder, newest(source), place)
            for source, place in zip(offer.sources, shared, strict=True)
        ]
        return Capture(self._device, read, parts)

    def _spans(self) -> dict[Resource, tuple[int, int]]:
        offered: defaultdict[Resource, int] = defaultdict(int)
        for offer in self.offers.values():
            for source in offer.sources:
                offered[source] = max(offered[source], offer.after)
        spans = {}
        for resource in filter(lives_in_frame, self.resources):
            used = [node.index for node in (*resource.writers, *resource.readers)]
            spans[resource] = min(used), max(*used, offered.get(resource, 0))
        return spans

    def _place(self) -> dict[Resource, int]:
        """Equal textures and buffers share memory if they are not in use at the same time."""
        places: dict[Resource, int] = {}
        free: defaultdict[Any, list[int]] = defaultdict(list)
        counts: defaultdict[Any, int] = defaultdict(int)
        ends: list[tuple[int, Resource]] = []
        for resource, (first, last) in sorted(self.spans.items(), key=lambda item: item[1]):
            for end, done in [entry for entry in ends if entry[0] < first]:
                ends.remove((end, done))
                free[_alike(done)].append(places[done])
            kind = _alike(resource)
            if free[kind]:
                places[resource] = free[kind].pop()
            else:
                places[resource] = counts[kind]
                counts[kind] += 1
            ends.append((last, resource))
        return places


def newest(resource: Texture | Buffer) -> Any:
    """Its current object on the device."""
    if isinstance(resource, Texture) and resource.history is not None:
        return resource.history.sets[0][resource.part]
    return resource.physical


def _alike(resource: Resource) -> tuple[Any, ...]:
    return type(resource), resource.description  # type: ignore[attr-defined]


def _check(resource: Resource) -> None:
    if resource.lifetime is Lifetime.KEPT:
        return
    first: Node | None = resource.writers[0] if resource.writers else None
    for reader in resource.readers:
        if first is None:
            raise GraphError(f"{reader} reads {resource}, which no pass writes")
        if reader is first:
            raise GraphError(f"{reader} updates {resource}, which no pass before it writes")
        if reader.index < first.index:
            order = "a cycle, or passes in the wrong order"
            raise GraphError(f"{reader} reads {resource} before {first} writes it: {order}")
