"""The frame graph: passes with the resources that they read and write, declared once and replayed each frame.

A program adds its own passes by `pica.Renderer.insert`, which passes the `FrameGraph` (docs/guide/own-passes.md).
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
