"""What can be looked at of a frame: AOVs, views for debugging, numbers of rays."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from pica.graph.resources import Buffer, Texture

Array = NDArray[Any]
Read = Callable[..., Any]
"""Takes an array for each source, (height, width[, channels]), with the layers of texture arrays in front; buffers as
their bytes."""


@dataclass(frozen=True)
class Offer:
    """What is captured while the frame is recorded, as soon as it is written, as memory may be another's later."""

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
        """Whether the graph makes it; else the frame has to be declared anew for it."""
        return self.read is not None or self.prepare is not None

    @property
    def is_aov(self) -> bool:
        """Whether it is one of the frame's AOVs: names with a dot in them are for debugging and measurements."""
        return "." not in self.name
