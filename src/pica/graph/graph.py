"""Declares a frame: effects add passes in order, and mark each argument as read or written.

After O'Donnell, "FrameGraph: Extensible Rendering Architecture in Frostbite", GDC 2017. A graph is declared when the
structure of the frame changes, compiled once (plan.py) and replayed each frame.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import GraphError
from pica.graph.memory import Memory
from pica.graph.nodes import BlockNode, Condition, Node, PassNode, RecordNode, Step, Threads
from pica.graph.offers import Offer, Read
from pica.graph.resources import (
    TEXTURE_USAGE,
    Block,
    Buffer,
    History,
    Lifetime,
    Previous,
    Resource,
    Size,
    Texture,
    Update,
    Write,
    initial_rows,
)
from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device

_HERE = str(Path(__file__).parent)


class FrameGraph:
    """A frame that is being declared."""

    def __init__(
        self,
        memory: Memory,
        size: Size,
        output_size: Size,
        frame: ParameterBlock | None = None,
        half_frame: ParameterBlock | None = None,
        requested: frozenset[str] = frozenset(),
    ) -> None:
        """`size`: of the effects; `output_size`: of the picture. `frame` and `half_frame`: the constants that
        shaders read, of a frame and of one of half its size. `requested`: names of requested offers."""
        self.device: Device = memory.device
        self.memory = memory
        self.size, self.output_size = size, output_size
        self.half_size = (size[0] + 1) // 2, (size[1] + 1) // 2
        self.frame, self.half_frame = frame, half_frame
        self.nodes: list[Node] = []
        self.resources: list[Resource] = []
        self.histories: list[History] = []
        self.offers: dict[str, Offer] = {}
        self.requested = requested
        self._blocks: dict[str, Any] = {"frame": frame} if frame is not None else {}
        self._names: dict[tuple[str, str], str] = {}
        self._scope = "frame"
        self._when: Condition | None = None

    @contextmanager
    def when(self, condition: Condition) -> Iterator[None]:
        """Passes added within are skipped in frames for which this is false, unless they have a `when` of their own."""
        outer, self._when = self._when, condition
        try:
            yield
        finally:
            self._when = outer

    @contextmanager
    def scope(self, name: str) -> Iterator[None]:
        """Passes and resources declared within belong to this effect, and blocks provided within are its own."""
        outer, blocks = self._scope, self._blocks
        self._scope, self._blocks = name, dict(blocks)
        try:
            yield
        finally:
            self._scope, self._blocks = outer, blocks

    def provide(self, **blocks: Any) -> None:
        """Parameter blocks by their names in shaders. Passes added later in this scope get those that their shaders
        declare; inputs of the pass take precedence."""
        self._blocks.update(blocks)

    @property
    def grid(self) -> Threads:
        """One thread a pixel."""
        return (*self.size, 1)

    @property
    def half_grid(self) -> Threads:
        """One thread for 2x2 pixels."""
        return (*self.half_size, 1)

    @property
    def output_grid(self) -> Threads:
        """One thread a pixel of the output."""
        return (*self.output_size, 1)

    def texture(
        self,
        name: str,
        texture_format: spy.Format,
        size: Size | None = None,
        layers: int | None = None,
        lifetime: Lifetime = Lifetime.FRAME,
        usage: spy.TextureUsage = TEXTURE_USAGE,
        scratch: bool = False,
    ) -> Texture:
        """Declare a texture; `size` None is the size at which effects work. `scratch`: although it is filled under a
        condition, no pass reads it in a frame in which none has filled it, so that others may have its memory."""
        texture = Texture(
            name, self._scope, _caller(), lifetime, format=texture_format, size=size or self.size, layers=layers
        )
        texture.usage, texture.scratch = usage, scratch
        return self._declared(texture)

    def buffer(
        self,
        name: str,
        size: int = 0,
        struct_size: int = 4,
        data: NDArray[Any] | None = None,
        lifetime: Lifetime = Lifetime.KEPT,
    ) -> Buffer:
        """Declare a buffer of `size` bytes, or one that begins with a row for each item of `data`."""
        buffer = Buffer(name, self._scope, _caller(), lifetime, bytes=size, struct_size=struct_size)
        if data is not None:
            buffer.data, buffer.struct_size = initial_rows(data)
            buffer.bytes = len(buffer.data)
        return self._declared(buffer)

    def history(
        self,
        name: str,
        formats: Mapping[str, spy.Format],
        size: Size | None = None,
        layers: int | None = None,
        usage: Mapping[str, spy.TextureUsage] | None = None,
    ) -> History:
        """Declare textures whose content the next frame can read, by their names in shaders."""
        textures = {
            key: self.texture(
                f"{name} {key}",
                texture_format,
                size,
                layers,
                Lifetime.HISTORY,
                (usage or {}).get(key, TEXTURE_USAGE),
            )
            for key, texture_format in formats.items()
        }
        history = History(textures, self.memory.history(self._scope, name))
        for key, texture in textures.items():
            texture.history, texture.part = history.state, key
        self.histories.append(history)
        return history

    def nothing(self, texture_format: spy.Format, layers: int | None = None) -> Texture:
        """A texel in place of an optional input that is absent; its content is undefined."""
        name = f"{texture_format.name} {layers or ''}".strip()
        for resource in self.resources:
            if resource.key == ("nothing", name) and isinstance(resource, Texture):
                return resource
        with self.scope("nothing"):
            texture = self.texture(name, texture_format, (1, 1), layers, Lifetime.KEPT)
        return texture

    def block(self, module: str, name: str, **fields: Any) -> Block:
        """The parameter block `name` of `module`: `fields` follow the frame from here on."""
        parameters = self.memory.block(module, name, self._scope)
        node = BlockNode(f"block {name}", self._scope, _caller(), fields, None, parameters=parameters)
        node.index = len(self.nodes)
        self.nodes.append(node)
        node.reads, node.previous = [], []  # read by the passes that are given the block
        parts = [value for value in fields.values() if isinstance(value, Texture | Buffer | Previous)]
        return Block(parameters, tuple(parts))

    def add(
        self,
        step: Step,
        threads: Threads | Callable[[Any], Threads],
        /,
        *,
        when: Condition | Any = None,
        **inputs: Any,
    ) -> None:
        """Add a pass or ray effect over a grid of threads, with its shader parameters.

        Each is a value; a texture, buffer or block that it reads, or a tuple of textures where the shader has an
        array; an output, as write(…) or update(…); or a function from the frame to the value, called in each frame.
        Parameter blocks that the graph provides, such as `frame`, need not be passed. `when` is a function of the
        frame: if it is false, the pass is skipped. Raises GraphError if two passes `write` the same resource.
        """
        name = str(getattr(step, "name", "pass"))
        blocks: frozenset[str] = getattr(step, "blocks", frozenset())
        inputs = {block_name: block for block_name, block in self._blocks.items() if block_name in blocks} | inputs
        self._add(PassNode(name, self._scope, _caller(), inputs, when or self._when, step=step, threads=threads))

    def record(self, name: str, call: Callable[..., None], /, *, when: Condition | Any = None, **inputs: Any) -> None:
        """Add any other work: `call(frame, **inputs)` records it, with textures and buffers in place of resources."""
        self._add(RecordNode(name, self._scope, _caller(), inputs, when or self._when, call=call))

    def clear(self, resource: Texture | Buffer, when: Condition | None = None) -> None:
        """Fill a buffer or an unsigned integer texture with zeros."""

        def fill(frame: Any, target: spy.Texture | spy.Buffer) -> None:
            if isinstance(target, spy.Buffer):
                frame.encoder.clear_buffer(target)
            else:
                frame.encoder.clear_texture_uint(target)

        self.record(f"clear {resource.name}", fill, when=when, target=Write(resource))

    def offer(
        self,
        name: str,
        sources: tuple[Texture | Buffer, ...],
        read: Read | None = None,
        prepare: Callable[[Any], Read] | None = None,
        on_request: bool = False,
    ) -> None:
        """Offer an AOV: `read` makes an array from the content of these resources at this point of the frame.

        `prepare` takes the frame, with its view's state, and returns `read`. `on_request`: only if requested by name.
        """
        assert (read is None) != (prepare is None)
        on_request = on_request or name in self.offers
        self.offers[name] = Offer(name, self._scope, sources, read, prepare, len(self.nodes) - 1, on_request)

    def wants(self, *names: str) -> bool:
        """Whether one of these offers, which need passes of their own, is requested: the passes are added only then.
        They are offered in any case; a later request has the frame declared again."""
        for name in names:
            self.offers[name] = Offer(name, self._scope, (), None, None, len(self.nodes) - 1, on_request=True)
        return not self.requested.isdisjoint(names)

    def _add(self, node: Node) -> None:
        node.index = len(self.nodes)
        self.nodes.append(node)
        for value in node.inputs.values():
            if isinstance(value, Write):
                self._written_anew(value.resource, node)
            elif isinstance(value, Update):
                value.resource.writers.append(node)
        for resource in node.reads:
            resource.readers.append(node)

    def _written_anew(self, resource: Resource, node: Node) -> None:
        shared = resource.lifetime is not Lifetime.KEPT
        if shared and resource.writers and not _alternatives(resource.writers[0], node):
            raise GraphError(f"{node} writes {resource}, which {resource.writers[0]} has written; use update(...)")
        resource.writers.append(node)

    def _declared(self, resource: Any) -> Any:
        before = self._names.setdefault(resource.key, resource.where)
        if before != resource.where or any(other.key == resource.key for other in self.resources):
            raise GraphError(f"{resource.scope} declares {resource.name!r} twice, at {before} and at {resource.where}")
        self.resources.append(resource)
        return resource


def _alternatives(first: Node, second: Node) -> bool:
    """Two passes that write the same resource, each under its own condition: at most one of them runs in a frame."""
    return first.when is not None and second.when is not None


def _caller() -> str:
    """File and line of a declaration."""
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith((_HERE, "<")):
        frame = frame.f_back
    path = Path(frame.f_code.co_filename)
    return f"{'/'.join(path.parts[-2:])}:{frame.f_lineno}"


def counted(values: NDArray[Any]) -> int:
    """How many texels of a buffer are not 0."""
    return int(np.count_nonzero(values))
