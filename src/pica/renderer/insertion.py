"""A program's own effects in the frame."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import ReferenceType

import slangpy as spy

from pica.errors import GraphError, PicaError, shown
from pica.frame.signals.light import BOTH_PARTS, SIGNAL
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture
from pica.renderer.frame import STAGES, Signals
from pica.scene.values import checked, choice

if TYPE_CHECKING:
    from pica.renderer.renderer_frames import RendererFrames

Declare = Callable[[FrameGraph, Signals], object]


@dataclass(eq=False)
class Insertion:
    """An effect that a program has put into a renderer's frames (`Renderer.insert`)."""

    name: str
    """Its name in `Renderer.graph` and the graph's errors."""
    after: str
    """The stage before it."""
    _declare: Declare
    _renderer: "ReferenceType[RendererFrames]"

    def remove(self) -> None:
        """Remove it from the next frame on. Does nothing if it is removed already."""
        renderer = self._renderer()
        if renderer is not None and not renderer.closed:
            renderer.remove(self)

    def renew(self) -> None:
        """Declare it again with its new settings, and restart accumulation. Histories stay."""
        renderer = self._renderer()
        if renderer is not None and not renderer.closed:
            renderer.renew_frame()

    def declare(self, graph: FrameGraph, signals: Signals) -> None:
        """Declare its passes. Raises GraphError if it leaves signals that later stages cannot use."""
        with graph.scope(self.name):
            self._declare(graph, signals)
        for name, size in (("radiance", graph.size), ("picture", graph.output_size), ("display", graph.output_size)):
            texture = getattr(signals, name, None)
            if texture is None:
                continue
            if not isinstance(texture, Texture):
                raise GraphError(f"{self.name}: signals.{name} is {shown(texture)}, not a texture of the graph")
            if texture.size != size:
                raise GraphError(f"{self.name}: signals.{name} is {_texels(texture.size)}, not {_texels(size)} texels")
        for part in signals.parts:
            if not isinstance(part, Texture) or part.size != graph.size or part.format not in (SIGNAL, BOTH_PARTS):
                raise GraphError(
                    f"{self.name}: signals.parts has {shown(part)}, not a texture of {_texels(graph.size)} texels of"
                    f" {SIGNAL.name} or {BOTH_PARTS.name}"
                )
        display = getattr(signals, "display", None)
        if display is not None and display.format != spy.Format.rgba8_unorm:
            raise GraphError(f"{self.name}: signals.display is {display.format.name}, not rgba8_unorm")


def checked_insertion(
    declare: Any, after: Any, name: Any, taken: Collection[str], renderer: "ReferenceType[RendererFrames]"
) -> Insertion:
    """Raises PicaError for an invalid insertion."""
    if not callable(declare):
        raise PicaError(f"insert: {shown(declare)} cannot be called with a graph and signals")
    after = checked("insert: after", choice(*STAGES), after, PicaError)
    if name is None:
        name = getattr(declare, "name", None) or getattr(declare, "__name__", None) or type(declare).__name__
    if not isinstance(name, str) or not name or "/" in name:
        raise PicaError(f"insert: name: {shown(name)}: must be a text without /")
    if name in taken:
        raise PicaError(f"insert: there is an effect {name!r} already; give another name=")
    return Insertion(name, after, declare, renderer)


def _texels(size: tuple[int, int]) -> str:
    return "x".join(map(str, size))
