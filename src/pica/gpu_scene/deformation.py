"""Nodes whose vertices are written anew, one node's mesh at a time, and the upkeep of their bottom-level structures."""

from pica.gpu_scene.bending import Bending
from pica.gpu_scene.geometry import GeometryBuffers, PlacedSection
from pica.gpu_scene.looseness import Looseness
from pica.gpu_scene.particles import RibbonWriter, SpriteWriter
from pica.gpu_scene.skinning import Skinning
from pica.gpu_scene.vertex_writer import VertexWriter
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.scene.deformer import CameraFacing
from pica.scene.model import Node
from pica.scene.particles import Ribbons, Sprites
from pica.scene.spline import Spline

_CHECK_EVERY = 8
"""Refits between two looks at how loose the boxes have become."""


class Deformation:
    """Keeps the vertices of a node that deforms its mesh, and their structures, up to date."""

    def __init__(self, device: Device, node: Node, geometry: GeometryBuffers, rebuild_at: float) -> None:
        """`rebuild_at`: GeometrySettings.rebuild_at."""
        self._rebuild_at = rebuild_at
        mesh = geometry.mesh(node)
        self._geometry = geometry
        self._structures = [part.geometry for part in mesh.parts]
        self._write = _writer(device, node, mesh.sections)
        # Particles say themselves when a refit will not do; otherwise they only turn where they are.
        watched = rebuild_at and not isinstance(node.deformer, CameraFacing)
        self._looseness = Looseness([p.section for p in mesh.sections], node) if watched else None
        self._refits: int | None = None

    def forget(self) -> None:
        """The node goes: book its buffers as given back."""
        self._write.forget()

    def __call__(self, recording: Recording) -> None:
        """Record the writing of the vertices as the node has them now."""
        self._write(recording, self._geometry, is_new=self._refits is None)

    def update_structures(self, recording: Recording) -> None:
        """Record the refit or rebuild of the bottom level, after every node's vertices are in place."""
        rebuild = self._refits is None or not self._rebuild_at or self._write.scattered or self._is_loose(self._refits)
        for structure in self._structures:
            update = structure.build if rebuild else structure.refit
            update(recording.encoder, self._geometry.positions, self._geometry.indices)
        if rebuild and self._looseness is not None:
            self._looseness.reset()
        self._refits = 0 if rebuild else (self._refits or 0) + 1

    def _is_loose(self, refits: int) -> bool:
        look = self._looseness is not None and refits % _CHECK_EVERY == _CHECK_EVERY - 1
        return look and self._looseness is not None and self._looseness.now() > self._rebuild_at


def _writer(device: Device, node: Node, sections: list[PlacedSection]) -> VertexWriter:
    match node.deformer:
        case Sprites() as sprites:
            return SpriteWriter(device, sprites, sections)
        case Ribbons() as ribbons:
            return RibbonWriter(device, ribbons, sections)
        case Spline() as spline:
            return Bending(device, spline, sections)
    return Skinning(device, node, sections)
