"""Steps of a compiled graph: passes, other recorded work, and parameter blocks that follow the frame."""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import slangpy as spy

from pica.graph.resources import Block, Buffer, Lifetime, Previous, Resource, Texture, Update, Write
from pica.rhi.passes import Recording

if TYPE_CHECKING:
    from pica.graph.memory import HistoryState


class Frame(Recording, Protocol):
    """The input of a graph's replay for one frame."""

    @property
    def index(self) -> int:
        """Counts frames since the histories were dropped."""

    @property
    def requested(self) -> frozenset[str]:
        """Names of the offers to capture."""


Threads = tuple[int, ...]
Condition = Callable[[Any], bool]
"""Function of the frame; called in each frame."""
Step = Callable[..., None]
"""Takes the frame, threads and named values, and records a dispatch. `blocks`, where it has them: names of parameter
blocks that it asks the graph for. `record_in_parts`, where it has that: as the call, but returns what Node.record
does."""
Parts = Generator[None, float | None, None]
"""Records something in parts: yields whenever what is recorded must be submitted and finished, and is sent the seconds
that this took, shared out among all that waited."""


@dataclass(eq=False)
class Node:
    """One entry of the graph, in the order in which they are recorded."""

    name: str
    scope: str
    where: str
    """File and line that added it."""
    inputs: Mapping[str, Any]
    when: Condition | None
    index: int = 0
    writes: list[Resource] = field(default_factory=list)
    reads: list[Resource] = field(default_factory=list)
    previous: list[Texture] = field(default_factory=list)
    """Histories whose previous content it reads."""

    def __post_init__(self) -> None:
        self.values: dict[str, Any] = {}
        self._each_frame: list[tuple[str, Callable[[Any], Any]]] = []
        self.functions: list[tuple[str, Callable[[Any], Any]]] = []
        """The arguments that are functions of the frame."""
        for value in self.inputs.values():
            self._note(value)
        states = {id(state): state for state in map(_history_of, self.inputs.values()) if state is not None}
        self.states = list(states.values())
        """The histories among its arguments, of which each may be in one of two states."""
        written = (resource.history for resource in self.writes if isinstance(resource, Texture))
        self.swapped = list({id(state): state for state in written if state is not None}.values())
        """Those that it writes."""

    def __str__(self) -> str:
        return f"pass {self.name!r} of {self.scope} ({self.where})"

    def _note(self, value: Any) -> None:
        match value:
            case Write():
                self.writes.append(value.resource)
            case Update():
                self.writes.append(value.resource)
                self.reads.append(value.resource)
            case Previous():
                self.previous.append(value.resource)
            case Resource():
                self.reads.append(value)
            case tuple():
                for item in value:
                    self._note(item)
            case _ if (block := _block_of(value)) is not None:
                for item in block.fields:
                    self._note(item)

    def bind(self) -> None:
        """The resources have their memory: find all that stays the same from frame to frame."""
        self.values, self._each_frame, self.functions = {}, [], []
        for name, value in self.inputs.items():
            resource = value.resource if isinstance(value, Write | Update) else value
            if isinstance(resource, Previous):
                self._each_frame.append((name, _previous(resource.resource)))
            elif isinstance(resource, Texture) and resource.history is not None:
                self._each_frame.append((name, _newest(resource)))
            elif isinstance(resource, Texture | Buffer):
                self.values[name] = resource.physical
            elif isinstance(resource, tuple):
                self.values[name] = tuple(item.physical for item in resource)
            elif (block := _block_of(value)) is not None:
                self.values[name] = block.parameters
            elif callable(resource):
                self._each_frame.append((name, resource))
                self.functions.append((name, resource))
            else:
                self.values[name] = resource

    def resolve(self, frame: Frame) -> dict[str, Any]:
        """Its arguments in this frame."""
        for state in self.swapped:
            state.swap(frame)
        for name, find in self._each_frame:
            self.values[name] = find(frame)
        return self.values

    def state_in(self, frame: Frame) -> int:
        """A number for each of the contents that its histories may be to it."""
        number = 0
        for state in self.states:
            number = 4 * number + 2 * state.is_swapped_in(frame) + state.parity
        return number

    def record(self, frame: Frame) -> Parts | None:
        """Record it into the frame; what it returns records the rest."""
        raise NotImplementedError


@dataclass(eq=False)
class PassNode(Node):
    """A pass, or a ray effect, over a grid of threads."""

    step: Step | None = None
    threads: Threads | Callable[[Any], Threads] = ()

    def record(self, frame: Frame) -> Parts | None:
        """Dispatch it."""
        assert self.step is not None
        values = self.resolve(frame)
        threads = self.threads(frame) if callable(self.threads) else self.threads
        in_parts: Callable[..., Parts] | None = getattr(self.step, "record_in_parts", None)
        if in_parts is not None:
            return in_parts(frame, threads, **values)
        frame.variant = self._variant()
        self.step(frame, threads, **values)
        frame.variant = 0
        return None

    def _variant(self) -> int:
        """A number for each state that the histories among its arguments may be in."""
        variant = 0
        for state in self.states:
            variant = 2 * variant + state.parity
        return variant


@dataclass(eq=False)
class RecordNode(Node):
    """Any other work, recorded or done on the host, at this point of the frame."""

    call: Callable[..., None] | None = None

    def record(self, frame: Frame) -> None:
        """Call it."""
        assert self.call is not None
        self.call(frame, **self.resolve(frame))


@dataclass(eq=False)
class BlockNode(Node):
    """Binds a parameter block's fields for this frame."""

    parameters: Any = None

    def record(self, frame: Frame) -> None:
        """Bind the fields."""
        self.parameters.bind(**self.resolve(frame))


def _block_of(value: Any) -> Block | None:
    """The block of an argument, or the argument itself if it is one."""
    block = value if isinstance(value, Block) else getattr(value, "block", None)
    return block if isinstance(block, Block) else None


def _history_of(value: Any) -> "HistoryState | None":
    resource = value.resource if isinstance(value, Write | Update | Previous) else value
    return resource.history if isinstance(resource, Texture) else None


def _previous(texture: Texture) -> Callable[[Any], spy.Texture]:
    state, name = texture.history, texture.part
    assert state is not None
    return lambda frame: state.previous(frame, name)


def _newest(texture: Texture) -> Callable[[Any], spy.Texture]:
    state, name = texture.history, texture.part
    assert state is not None
    return lambda frame: state.sets[0][name]


def lives_in_frame(resource: Resource) -> bool:
    """Whether others may have its memory before and after."""
    if resource.lifetime is not Lifetime.FRAME:
        return False
    # Resources that no pass fills in some frames are still valid for passes that read them in others.
    fill = [node for node in resource.writers if resource not in node.reads]
    conditions = {id(node.when) if node.when else None for node in (*resource.writers, *resource.readers)}
    return resource.scratch or len(conditions) == 1 or any(node.when is None for node in fill)
