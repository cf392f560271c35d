"""The available outputs of a frame: AOVs, debug AOVs, numbers of rays."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from pica.graph.resources import Buffer, Texture

Array = NDArray[Any]
Read = Callable[..., Any]
"""Function of one array per source, (height, width[, channels]), texture arrays with layers first; buffers as
their bytes."""


@dataclass(frozen=True)
class Decoder:
    """A `Read` that the device can do as well, for tensors that stay on it (frame/decode_aov.slang)."""

    read: Read
    kind: int
    """Of `AovKind` in the shader."""
    channels: int
    """Of a pixel's result, 32 bits each."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Further parameters of the shader."""

    def __call__(self, *arrays: Array) -> Any:
        """On the host."""
        return self.read(*arrays)


@dataclass(frozen=True)
class Offer:
    """A capture within the frame, right after the write, because the memory may be reused later."""

    name: str
    scope: str
    """The effect that offers it."""
    sources: tuple[Texture | Buffer, ...]
    read: Read | None
    prepare: Callable[[Any], Read] | None
    after: int
    """Index of the node after which it is captured."""
    on_request: bool

    @property
    def is_declared(self) -> bool:
        """Whether the graph produces it; otherwise the frame must be declared again."""
        return self.read is not None or self.prepare is not None

    @property
    def is_aov(self) -> bool:
        """Whether it is one of the frame's AOVs: names with a dot in them are for debugging and measurements."""
        return "." not in self.name
