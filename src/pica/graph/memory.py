"""The memory of a graph: textures and buffers on the device, kept from one compilation to the next."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import slangpy as spy

from pica.graph.resources import Buffer, History, Lifetime, Resource, Texture
from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device


class HistoryState:
    """Two sets of textures that swap, and how many frames in a row have written them."""

    def __init__(self) -> None:
        self.sets: list[dict[str, spy.Texture]] = [{}, {}]
        """The newest first."""
        self.parity = 0
        """Which of the two is the newest, 0 or 1."""
        self.description: Any = None
        self.length = 0
        """Frames in a row that wrote it, with this one."""
        self._newest = -1
        self._swapped_in: Any = None

    @property
    def empty(self) -> bool:
        """For the pass that writes it: whether the frame before left nothing."""
        return self.length <= 1

    def precedes(self, frame: Any) -> bool:
        """Before this frame has written it: whether the frame before did."""
        return self.length > 0 and frame.index == self._newest + 1

    def stays(self, frame: Any, length: int) -> bool:
        """Whether at least `length` frames in a row wrote it up to the one before; then it also counts as this frame's,
        which need not write it."""
        if self.length < length or not self.precedes(frame):
            return False
        self._newest = frame.index
        return True

    def is_swapped_in(self, frame: Any) -> bool:
        """Whether a pass of this frame writes it."""
        return self._swapped_in is frame

    def swap(self, frame: Any) -> None:
        """Before the first pass of a frame that writes it."""
        if self._swapped_in is frame:
            return
        self._swapped_in = frame
        self.sets.reverse()
        self.parity = 1 - self.parity
        self.length = self.length + 1 if frame.index == self._newest + 1 else 1
        self._newest = frame.index

    def previous(self, frame: Any, name: str) -> spy.Texture:
        """The content of the previous frame."""
        return self.sets[self._swapped_in is frame][name]

    def reset(self) -> None:
        """Invalidate the content."""
        self.length, self._newest, self._swapped_in = 0, -1, None


class Memory:
    """The device memory of a view's graphs. Resources keep their content while key and description stay."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._kept: dict[tuple[str, str], tuple[Any, Any]] = {}
        self._histories: dict[tuple[str, str], HistoryState] = {}
        self._shared: defaultdict[Any, list[Any]] = defaultdict(list)
        self._blocks: dict[tuple[str, str], ParameterBlock] = {}
        self.bytes: dict[str, int] = {}
        """By effect; "shared" is memory that effects use one after the other."""

    def history(self, scope: str, name: str) -> HistoryState:
        """The state of a history."""
        return self._histories.setdefault((scope, name), HistoryState())

    def block(self, module: str, name: str, scope: str) -> ParameterBlock:
        """A parameter block, one for each scope."""
        key = scope, f"{module} {name}"
        if key not in self._blocks:
            self._blocks[key] = self.device.parameter_block(module, name)
        return self._blocks[key]

    def reset(self, scopes: Iterable[str] | None = None) -> None:
        """Invalidate the histories of these effects; None: all."""
        names = None if scopes is None else set(scopes)
        for (scope, _), state in self._histories.items():
            if names is None or scope in names:
                state.reset()

    def allocate(
        self, persistent: Iterable[Resource], histories: Iterable[History], places: Iterable[tuple[Resource, int]]
    ) -> None:
        """Assign memory to each resource, and free memory without resources.

        `places`: resources that live within a frame; those with equal descriptions and numbers share memory.
        """
        self.bytes = {}
        before, self._kept = self._kept, {}
        for resource in persistent:
            description = (type(resource), resource.description)  # type: ignore[attr-defined]
            entry = before.pop(resource.key, None)
            if entry is None or entry[0] != description:
                self._let_go(entry)
                entry = description, self._make(resource, f"{resource.scope} {resource.name}")
            self._kept[resource.key] = entry
            resource.physical = entry[1]
            self._book(resource.scope, entry[1])
        for entry in before.values():
            self._let_go(entry)
        self._allocate_histories(list(histories))
        self._share(list(places))

    def _allocate_histories(self, histories: list[History]) -> None:
        states = {id(history.state) for history in histories}
        for key, state in list(self._histories.items()):
            if id(state) not in states:
                self._drop(state)
                del self._histories[key]
        for history in histories:
            state = history.state
            description = {name: texture.description for name, texture in history.textures.items()}
            if state.description != description:
                self._drop(state)
                state.description = description
                for index in range(2):
                    state.sets[index] = {
                        name: self._make(texture, f"{texture.scope} {texture.name} {index}")
                        for name, texture in history.textures.items()
                    }
            for name, texture in history.textures.items():
                for textures in state.sets:
                    self._book(texture.scope, textures[name])

    def _share(self, places: list[tuple[Resource, int]]) -> None:
        counts: defaultdict[Any, int] = defaultdict(int)
        for resource, number in places:
            description = (type(resource), resource.description)  # type: ignore[attr-defined]
            counts[description] = max(counts[description], number + 1)
        for description, pool in list(self._shared.items()):
            for extra in pool[counts[description] :]:
                self.device.give_back(extra)
            del pool[counts[description] :]
        for resource, number in places:
            pool = self._shared[(type(resource), resource.description)]  # type: ignore[attr-defined]
            while len(pool) <= number:
                pool.append(self._make(resource, f"shared {len(pool)}"))
            resource.physical = pool[number]
        for pool in self._shared.values():
            for physical in pool:
                self._book("shared", physical)

    def _drop(self, state: HistoryState) -> None:
        for textures in state.sets:
            self.device.give_back(*textures.values())
        state.sets, state.description = [{}, {}], None
        state.reset()

    def _let_go(self, entry: tuple[Any, Any] | None) -> None:
        if entry is not None:
            self.device.give_back(entry[1])

    def _book(self, scope: str, physical: spy.Texture | spy.Buffer) -> None:
        self.bytes[scope] = self.bytes.get(scope, 0) + physical.memory_usage.device

    def _make(self, resource: Resource, label: str) -> Any:
        if isinstance(resource, Texture):
            return self.device.texture(label, resource.format, resource.size, resource.usage, resource.layers)
        assert isinstance(resource, Buffer)
        if resource.data is not None:
            return self.device.buffer(label, data=resource.data, struct_size=resource.struct_size)
        return self.device.buffer(label, size=resource.bytes, struct_size=resource.struct_size)


def is_history(resource: Resource) -> bool:
    """Whether its memory is that of a history."""
    return resource.lifetime is Lifetime.HISTORY
