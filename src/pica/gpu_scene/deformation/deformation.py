"""Meshes whose vertices are rewritten, and updates of their bottom-level structures."""

from pica.errors import SceneError
from pica.gpu_scene.deformation.bending import Bending
from pica.gpu_scene.deformation.dynamic import DynamicWriter
from pica.gpu_scene.deformation.particles import FacingWriter, RibbonWriter, SpriteWriter
from pica.gpu_scene.deformation.refit_quality import RefitQuality
from pica.gpu_scene.deformation.skinning import Skinning
from pica.gpu_scene.deformation.vertex_writer import VertexWriter
from pica.gpu_scene.geometry import GeometryBuffers, GpuMesh
from pica.gpu_scene.geometry_store import PlacedSection
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import GrowingBuffer
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.model import Node
from pica.scene.particles import Ribbons, Sprites
from pica.scene.spline import Spline

_REBUILD_AT = 1.5
"""Estimated cost of a refitted bottom-level structure, over that when it was built, at which it is rebuilt."""
_CHECK_EVERY = 8
"""Refits between two checks of the tree's quality."""


class Deformation:
    """Updates the vertices of a deforming mesh, and its structures."""

    def __init__(self, geometry: GeometryBuffers, mesh: GpuMesh, write: VertexWriter, watched: Node | None) -> None:
        """`watched`: the node to measure the quality of refits by, or None if `write` decides by itself when to
        rebuild."""
        self.mesh = mesh
        self.write = write
        self._geometry = geometry
        self._structures = [part.geometry for part in mesh.parts]
        sections = [placed.section for placed in mesh.sections]
        self._refit_quality = RefitQuality(sections, watched) if watched is not None else None
        self._refits: int | None = None

    @property
    def is_new(self) -> bool:
        """Whether the structures have not been built yet."""
        return self._refits is None

    def forget(self) -> None:
        """Book the buffers as released after the node's removal."""
        self.write.forget()

    def __call__(self, recording: Recording) -> None:
        """Record the writing of the vertices as they are now."""
        self.write(recording, self._geometry)

    def update_structures(self, recording: Recording) -> None:
        """Record the refit or rebuild of the bottom level, after every node's vertices are in place."""
        rebuild = self._refits is None or self.write.needs_rebuild or self._is_loose(self._refits)
        for structure in self._structures:
            update = structure.build if rebuild else structure.refit
            update(recording.encoder, self._geometry.positions, self._geometry.triangles)
        if rebuild and self._refit_quality is not None:
            self._refit_quality.reset()
        self._refits = 0 if rebuild else (self._refits or 0) + 1

    def _is_loose(self, refits: int) -> bool:
        look = self._refit_quality is not None and refits % _CHECK_EVERY == _CHECK_EVERY - 1
        return look and self._refit_quality is not None and self._refit_quality.now() > _REBUILD_AT


def deform_all(recording: Recording, deformations: list[Deformation]) -> None:
    """Record all vertices first, then all structures: one wait between the two, not one a mesh."""
    for deformation in deformations:
        deformation(recording)
    if deformations:
        recording.profiler.begin(recording.encoder, "bottom level")
        for deformation in deformations:
            deformation.update_structures(recording)
        recording.profiler.end(recording.encoder)


def deformation_of(device: Device, node: Node, geometry: GeometryBuffers, mesh: GpuMesh) -> Deformation:
    """The deformation of a node's mesh, shared by all views."""
    return Deformation(geometry, mesh, _writer(device, node, mesh.sections), node)


def _writer(device: Device, node: Node, sections: list[PlacedSection]) -> VertexWriter:
    match node.deformer:
        case Spline() as spline:
            return Bending(device, spline, sections)
        case DynamicVertices() as dynamic:
            return DynamicWriter(device, dynamic, sections)
    return Skinning(device, node, sections)


def check_deforming(node: Node) -> None:
    """Raises SceneError for a node whose deformer does not support its vertices or primitives."""
    if node.deforms and node.mesh is not None and any(len(primitives) for primitives in node.mesh.primitives):
        raise SceneError(f"node {node.name!r}: its mesh has primitives, which cannot be skinned or morphed")
    if node.deformer is not None and not isinstance(node.deformer, Spline | DynamicVertices | Sprites | Ribbons):
        raise SceneError(
            f"node {node.name!r}: there is no vertex writer for its deformer, {type(node.deformer).__name__}; use "
            "Spline, Sprites, Ribbons or, for vertices of your own, DynamicVertices"
        )


def facing_of(
    device: Device, node: Node, geometry: GeometryBuffers, mesh: GpuMesh, previous: GrowingBuffer
) -> tuple[Deformation, FacingWriter]:
    """The deformation that turns a node's mesh towards one view's camera; `previous`: the view's previous positions."""
    write: FacingWriter
    if isinstance(node.deformer, Sprites):
        write = SpriteWriter(device, node.deformer, mesh.sections, previous)
    else:
        assert isinstance(node.deformer, Ribbons)
        write = RibbonWriter(device, node.deformer, mesh.sections, previous)
    return Deformation(geometry, mesh, write, None), write
