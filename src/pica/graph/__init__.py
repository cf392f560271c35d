"""The frame graph: passes and what they read and write, declared once and replayed each frame.

A program adds passes of its own by `pica.Renderer.insert`, which hands it the `FrameGraph` (docs/guide/own-passes.md).
"""

from pica.graph.description import GraphDescription, PassInfo, ResourceInfo
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, History, Lifetime, Texture, update, write

__all__ = [
    "Buffer",
    "FrameGraph",
    "GraphDescription",
    "History",
    "Lifetime",
    "PassInfo",
    "ResourceInfo",
    "Texture",
    "update",
    "write",
]
