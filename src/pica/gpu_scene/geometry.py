"""All meshes in a few shared buffers, and one bottom-level structure per mesh, sidedness and material type."""

from collections.abc import Container
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.bounds import object_box
from pica.gpu_scene.primitive_buffers import BOX_INDICES, PlacedPrimitives, PrimitiveBuffers
from pica.gpu_scene.table_rows import RECORD
from pica.rhi.acceleration import ObjectFlags
from pica.rhi.device import Device
from pica.rhi.rt_geometry import RtGeometry, RtSection, build_compact
from pica.rhi.tables import DeviceTable, Runs
from pica.scene.material import Material
from pica.scene.model import Mesh, Section

# gpu_scene/table_rows.slang
NOT_DEFORMED = 0xFFFFFFFF
OF_VIEW = 0x80000000
VERTEX = np.dtype([("normal", "u4"), ("tangent", "u4"), ("uv0", "f4", 2), ("uv1", "f4", 2), ("color", "u2", 4)])


@dataclass(frozen=True)
class PlacedSection:
    """A section and where it lies in the shared buffers."""

    section: Section
    """A copy: the user's may be written to while this one is shown."""
    index: int
    """In `Mesh.sections`."""
    first_vertex: int
    first_index: int
    first_previous: int = NOT_DEFORMED
    """Of its vertices among each view's previous positions; with the bit OF_VIEW among one view's own."""
    box: tuple[NDArray[np.float32], NDArray[np.float32]] = (np.zeros(3, np.float32), np.zeros(3, np.float32))
    """Centre and corner from there, object space, of the box round its vertices as they are without deformation."""


@dataclass(frozen=True)
class MeshPart:
    """The sections of a mesh in one bottom-level structure: same culling, same hit group."""

    geometry: RtGeometry
    first_section: int
    flags: ObjectFlags
    hit_group: str
    """A material type or, for primitives, "shape/type": entries of a MaterialTypeSet."""


@dataclass(eq=False)
class GpuMesh:
    """A mesh on the GPU: its sections and then its primitives in the order of their records, its parts, its users."""

    mesh: Mesh
    previous: Runs | None
    """Where its vertices have numbers for their previous positions; None: it does not deform."""
    sections: list[PlacedSection]
    primitives: list[PlacedPrimitives]
    parts: list[MeshPart]
    users: int = 0
    """How many show it: nodes for all views, and nodes for one view each."""

    @property
    def placed(self) -> list[PlacedSection | PlacedPrimitives]:
        """The parts with one record each."""
        return [*self.sections, *self.primitives]

    @cached_property
    def records(self) -> NDArray[np.void]:
        """(placed,) RECORD rows, with the fields for geometry and bounds filled in."""
        records = np.zeros(len(self.placed), RECORD)
        for row, placed in zip(records, self.placed, strict=True):
            for name in ("first_index", "first_vertex", "first_previous"):
                row[name] = getattr(placed, name)
            row["center"], row["extent"] = placed.box
        if self.previous is not None:
            records["extent"] *= -1
        return records


class GeometryBuffers:
    """Vertices and indices of every mesh. Indices count from their section's first vertex.

    Nodes that show one mesh share it. Deforming meshes have vertices and structures of their own; their previous
    positions belong to each view (previous_frame.py).
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._positions = DeviceTable(device, "positions", 12, device.built_from)
        self._vertices = DeviceTable(device, "vertices", VERTEX.itemsize)
        self._indices = DeviceTable(device, "indices", 4, device.built_from | spy.BufferUsage.index_buffer)
        self.previous = Runs()
        """Numbers of previous positions that mean the same in all views."""
        self.primitives = PrimitiveBuffers(device)
        self.first_box_index = 0
        """Offset of BOX_INDICES among the indices, if there are primitives."""
        self._has_box_indices = False
        self._meshes: dict[int, GpuMesh] = {}
        """Rigid meshes, by their Mesh."""
        self._unbuilt: list[RtGeometry] = []

    @property
    def positions(self) -> spy.Buffer:
        """float32 (vertices, 3), object space."""
        return self._positions.buffer

    @property
    def vertices(self) -> spy.Buffer:
        """VERTEX rows."""
        return self._vertices.buffer

    @property
    def indices(self) -> spy.Buffer:
        """uint32."""
        return self._indices.buffer

    def acquire(self, encoder: spy.CommandEncoder, mesh: Mesh, previous: Runs | None = None) -> GpuMesh:
        """The GPU copy of a mesh, with one more user; records the upload if it has none yet.

        `previous`: for a deforming mesh, the allocator of its previous positions: `self.previous`, or that of a view.
        """
        gpu_mesh = self._meshes.get(id(mesh)) if previous is None else None
        if gpu_mesh is None:
            gpu_mesh = self._upload(encoder, mesh, previous)
            if previous is None:
                self._meshes[id(mesh)] = gpu_mesh
        gpu_mesh.users += 1
        return gpu_mesh

    def release(self, mesh: GpuMesh) -> None:
        """Remove one user; the last one frees it."""
        mesh.users -= 1
        if mesh.users:
            return
        if self._meshes.get(id(mesh.mesh)) is mesh:
            del self._meshes[id(mesh.mesh)]
        for placed in mesh.sections:
            count = len(placed.section.positions)
            self._positions.give_back(placed.first_vertex, count)
            self._vertices.give_back(placed.first_vertex, count)
            self._indices.give_back(placed.first_index, placed.section.indices.size)
            if mesh.previous is not None:
                mesh.previous.give_back(placed.first_previous & ~OF_VIEW, count)
        for primitives in mesh.primitives:
            self.primitives.give_back(primitives)
        for part in mesh.parts:
            part.geometry.forget()
        removed = {part.geometry for part in mesh.parts}
        self._unbuilt = [geometry for geometry in self._unbuilt if geometry not in removed]

    def retire(self, meshes: Container[Mesh], materials: Container[Material]) -> None:
        """Forget meshes among `meshes` or with one of `materials`, so that the next user uploads them again."""
        for key, gpu_mesh in list(self._meshes.items()):
            if gpu_mesh.mesh in meshes or any(placed.section.material in materials for placed in gpu_mesh.placed):
                del self._meshes[key]

    def has(self, mesh: Mesh) -> bool:
        """Whether the mesh is uploaded as a rigid one."""
        return id(mesh) in self._meshes

    def build(self, encoder: spy.CommandEncoder) -> None:
        """Record the builds of the structures that are new and do not deform."""
        for geometry in self._unbuilt:
            geometry.build(encoder, self._corners(geometry.has_boxes), self.indices)
        self._unbuilt = []

    def build_compact(self) -> None:
        """As `build`, at once and into as little memory as may be; waits for the GPU."""
        for boxes in (False, True):
            alike = [geometry for geometry in self._unbuilt if geometry.has_boxes == boxes]
            build_compact(self._device, alike, self._corners(boxes), self.indices)
        self._unbuilt = []

    def _corners(self, boxes: bool) -> spy.Buffer:
        return self.primitives.boxes if boxes else self.positions

    def _upload(self, encoder: spy.CommandEncoder, mesh: Mesh, previous: Runs | None) -> GpuMesh:
        placed = [self._upload_section(encoder, section, index, previous) for index, section in _ordered(mesh)]
        primitives, parts = self._upload_primitives(encoder, mesh, len(placed))
        made = GpuMesh(mesh, previous, placed, primitives, [*self._parts(placed, previous is not None), *parts])
        if previous is None:
            self._unbuilt.extend(part.geometry for part in made.parts)
        return made

    def _upload_section(
        self, encoder: spy.CommandEncoder, section: Section, index: int, previous: Runs | None
    ) -> PlacedSection:
        first_vertex = self._positions.take(encoder, section.positions)
        assert self._vertices.take(encoder, _packed(section)) == first_vertex  # both allocators are in step
        first_index = self._indices.take(encoder, section.indices)
        first_previous = NOT_DEFORMED
        if previous is not None:
            of_view = 0 if previous is self.previous else OF_VIEW
            first_previous = previous.take(len(section.positions)) | of_view
        return PlacedSection(section, index, first_vertex, first_index, first_previous, object_box(section.positions))

    def _upload_primitives(
        self, encoder: spy.CommandEncoder, mesh: Mesh, first_section: int
    ) -> tuple[list[PlacedPrimitives], list[MeshPart]]:
        filled = [(index, copy(primitives)) for index, primitives in enumerate(mesh.primitives) if len(primitives)]
        if filled and not self._has_box_indices:
            self.first_box_index, self._has_box_indices = self._indices.take(encoder, BOX_INDICES), True
        placed = [self.primitives.upload(encoder, primitives, index) for index, primitives in filled]
        placed.sort(key=lambda p: p.hit_group)
        parts = []
        for hit_group, group in groupby(placed, lambda p: p.hit_group):
            run = list(group)
            structure = self.primitives.structure(run)
            parts.append(MeshPart(structure, first_section + placed.index(run[0]), ObjectFlags.NONE, hit_group))
        return placed, parts

    def _parts(self, sections: list[PlacedSection], deforms: bool) -> list[MeshPart]:
        parts = []
        for (double_sided, material_type), group in groupby(sections, lambda placed: _part_key(placed.section)):
            run = list(group)
            rt_sections = [
                RtSection(
                    first_vertex=p.first_vertex,
                    vertex_count=len(p.section.positions),
                    first_index=p.first_index,
                    index_count=p.section.indices.size,
                    opaque=p.section.material.stops_rays(),
                )
                for p in run
            ]
            flags = ObjectFlags.CULL_DISABLE if double_sided else ObjectFlags.NONE
            geometry = RtGeometry(self._device, rt_sections, deforms)
            parts.append(MeshPart(geometry, sections.index(run[0]), flags, material_type))
        return parts


def _ordered(mesh: Mesh) -> list[tuple[int, Section]]:
    """The sections with triangles and their indices in the mesh, grouped by part, so that each part has one run of
    records."""
    filled = [(index, _without_unused(section)) for index, section in enumerate(mesh.sections) if len(section.indices)]
    return sorted(filled, key=lambda entry: _part_key(entry[1]))


def _part_key(section: Section) -> tuple[bool, str]:
    return section.material.double_sided, section.material.type


def _without_unused(section: Section) -> Section:
    """The section reduced to the vertices that its triangles use; files often share one large array among sections."""
    used, indices = np.unique(section.indices, return_inverse=True)
    if len(used) == len(section.positions):
        return copy(section)
    return section.take(used.astype(np.intp), indices.reshape(-1, 3).astype(np.uint32))


def _packed(section: Section) -> NDArray[np.void]:
    vertices = np.zeros(len(section.positions), VERTEX)
    vertices["normal"] = octahedral(section.normals)
    # The bitangent's sign is stored in the lowest bit, which costs the tangent 1/65536 of precision.
    vertices["tangent"] = octahedral(section.tangents[:, :3]) & ~np.uint32(1) | (section.tangents[:, 3] < 0)
    vertices["uv0"], vertices["uv1"] = section.uv0, section.uv1
    vertices["color"] = np.rint(np.clip(section.colors, 0, 1) * 65535)
    return vertices


def octahedral(directions: NDArray[np.float32]) -> NDArray[np.uint32]:
    """(n, 3) directions as (n,) pairs of 16-bit signed normalized numbers; as shaders/packing.slang.

    Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors", section 3.
    """
    scaled = directions / np.maximum(np.abs(directions).sum(1, keepdims=True), 1e-30)
    plane = scaled[:, :2]
    folded = (1 - np.abs(plane[:, ::-1])) * np.where(plane >= 0, 1, -1)
    plane = np.where(scaled[:, 2:] < 0, folded, plane)
    steps = np.rint(np.clip(plane, -1, 1) * 32767).astype(np.int16).astype(np.uint16).astype(np.uint32)
    return np.asarray(steps[:, 0] | steps[:, 1] << np.uint32(16), np.uint32)
