"""Resources of passes: textures and buffers that effects declare and the graph allocates."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pica.graph.memory import HistoryState
    from pica.graph.nodes import Node

Size = tuple[int, int]
"""(width, height) in pixels."""
TEXTURE_USAGE = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access


class Lifetime(Enum):
    """Lifetime of content, which determines what may share memory."""

    FRAME = "frame"
    """From its writer to its last reader in the same frame; then the memory is another resource's."""
    HISTORY = "history"
    """Until the next frame has been written too: two textures that swap."""
    KEPT = "kept"
    """Until a pass overwrites it, in any frame."""


@dataclass(eq=False)
class Resource:
    """A declared resource. The graph sets its object on the device."""

    name: str
    scope: str
    """The effect that declared it."""
    where: str
    """File and line of the declaration."""
    lifetime: Lifetime
    scratch: bool = False
    """Whether no pass reads it in frames in which none has filled it, even if conditions do not imply that."""
    writers: "list[Node]" = field(default_factory=list, repr=False)
    readers: "list[Node]" = field(default_factory=list, repr=False)
    physical: Any = field(default=None, repr=False)
    """The texture or buffer on the device, once the graph is compiled; for histories see HistoryState."""

    @property
    def key(self) -> tuple[str, str]:
        """Identifies it from one compilation to the next."""
        return self.scope, self.name

    def __str__(self) -> str:
        return f"{self.scope} {self.name!r} (declared at {self.where})"


@dataclass(eq=False)
class Texture(Resource):
    """A 2D texture, or an array of them where it has `layers`."""

    format: spy.Format = spy.Format.rgba32_float
    size: Size = (1, 1)
    layers: int | None = None
    usage: spy.TextureUsage = TEXTURE_USAGE
    history: "HistoryState | None" = field(default=None, repr=False)
    """Of which it is a texture, by the name `part`."""
    part: str = ""

    @property
    def description(self) -> tuple[Any, ...]:
        """Textures with equal descriptions may share memory."""
        return self.format, self.size, self.layers, self.usage

    @property
    def previous(self) -> "Previous":
        """As an argument of a pass: the content of the previous frame. For histories only."""
        assert self.history is not None, f"{self} is no history"
        return Previous(self)


@dataclass(eq=False)
class Buffer(Resource):
    """A buffer of `bytes`, or with initial content `data`."""

    bytes: int = 0
    struct_size: int = 0
    data: NDArray[Any] | None = field(default=None, repr=False)

    @property
    def description(self) -> tuple[Any, ...]:
        """Buffers with equal descriptions may share memory."""
        return self.bytes, self.struct_size


@dataclass(frozen=True, eq=False)
class Write:
    """An argument that the pass overwrites."""

    resource: Resource


@dataclass(frozen=True, eq=False)
class Update:
    """An argument that the pass reads and changes in place."""

    resource: Resource


@dataclass(frozen=True, eq=False)
class Previous:
    """An argument that is a history's content as the frame before left it."""

    resource: Texture


def write(resource: Resource) -> Write:
    """Passed to a pass in place of the resource: the pass is its only writer, or the first before updates."""
    return Write(resource)


def update(resource: Resource) -> Update:
    """Passed to a pass in place of the resource: the pass modifies existing content."""
    return Update(resource)


@dataclass(eq=False)
class History:
    """Textures of which the frame before is still there. They swap together, before the first pass that writes one."""

    textures: Mapping[str, Texture]
    """By the names that shaders have for them."""
    state: "HistoryState"

    def swap(self) -> dict[str, Write | Previous]:
        """Arguments for the pass that writes it: `name` and `previousName` of each texture."""
        previous = {f"previous{name[0].upper()}{name[1:]}": texture.previous for name, texture in self.textures.items()}
        return {**{name: write(texture) for name, texture in self.textures.items()}, **previous}

    def known(self, _frame: Any) -> int:
        """As an argument of the pass that writes it: whether the previous frame's content is valid, 1 or 0."""
        return int(not self.state.empty)

    def __getitem__(self, name: str) -> Texture:
        return self.textures[name]


@dataclass(eq=False)
class Block:
    """A parameter block of which fields are resources of the graph."""

    parameters: Any
    """The ParameterBlock."""
    fields: tuple[Texture | Buffer | Previous, ...]


def initial_rows(data: NDArray[Any]) -> tuple[NDArray[np.uint8], int]:
    """The bytes of an (n,) structured or (n, k) array, and bytes of a row."""
    size = data.dtype.itemsize if data.dtype.names else data.itemsize * int(np.prod(data.shape[1:], dtype=int))
    return np.ascontiguousarray(data).view(np.uint8).reshape(-1), size
