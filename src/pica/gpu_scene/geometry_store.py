"""All meshes in a few shared buffers, and one bottom-level structure per mesh, sidedness and material type."""

from copy import copy
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.bounds import object_box
from pica.gpu_scene.primitive_buffers import BOX_INDICES, PlacedPrimitives, PrimitiveBuffers
from pica.rhi.acceleration import ObjectFlags
from pica.rhi.device import Device
from pica.rhi.rt_geometry import RtGeometry, RtSection, build_compact
from pica.rhi.tables import DeviceTable, Runs
from pica.scene.model import Mesh, Section

# gpu_scene/table_rows.slang
NOT_DEFORMED = 0xFFFFFFFF
OF_VIEW = 0x80000000
_UPLOADED = ("positions", "normals", "tangents", "uv0", "uv1", "colors", "indices")
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
    """Of its triangles."""
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
class Upload:
    """A mesh in the buffers: its sections and then its primitives in the order of their records, and its parts."""

    key: tuple[object, ...]
    """Its content: equal for meshes that share it; empty for those that do not."""
    sections: list[PlacedSection]
    primitives: list[PlacedPrimitives]
    parts: list[MeshPart]
    previous: Runs | None
    """Where its vertices have numbers for their previous positions; None: it does not deform."""
    arrays: list[NDArray[np.generic]]
    """Those whose identities are in the key."""
    users: int = 0
    """Scenes that show it."""


class GeometryStore:
    """Vertices and indices of every mesh, and structures. Indices count from their section's first vertex.

    Copies of a scene have one together, in which meshes with the same arrays are once, whatever their materials'
    parameters.
    """

    def __init__(self, device: Device, origin: object) -> None:
        """`origin`: what tells these copies from others."""
        self._device, self.origin = device, origin
        self.positions = DeviceTable(device, "positions", 12, device.built_from)
        self.vertices = DeviceTable(device, "vertices", VERTEX.itemsize)
        self.triangles = DeviceTable(device, "triangles", 12, device.built_from | spy.BufferUsage.index_buffer)
        """Three indices each."""
        self.primitives = PrimitiveBuffers(device)
        self.first_box_index = 0
        """Offset of BOX_INDICES among the indices, if there are primitives."""
        self._has_box_indices = False
        self._shared: dict[tuple[object, ...], Upload] = {}
        self._unbuilt: list[RtGeometry] = []

    def acquire(self, encoder: spy.CommandEncoder, mesh: Mesh, previous: Runs | None, of_view: int) -> Upload:
        """A mesh with one more user; records the upload if there is none yet. `previous`: as Upload; `of_view`: a bit
        of its numbers."""
        key = _content(mesh) if previous is None else ()
        upload = self._shared.get(key) if key else None
        if upload is None:
            upload = self._upload(encoder, mesh, key, previous, of_view)
            if key:
                self._shared[key] = upload
        upload.users += 1
        return upload

    def release(self, upload: Upload) -> None:
        """Remove one user; the last one frees it."""
        upload.users -= 1
        if upload.users:
            return
        self.retire(upload)
        for placed in upload.sections:
            count = len(placed.section.positions)
            self.positions.give_back(placed.first_vertex, count)
            self.vertices.give_back(placed.first_vertex, count)
            self.triangles.give_back(placed.first_index, placed.section.indices.size // 3)
            if upload.previous is not None:
                upload.previous.give_back(placed.first_previous & ~OF_VIEW, count)
        for primitives in upload.primitives:
            self.primitives.give_back(primitives)
        for part in upload.parts:
            part.geometry.forget()
        removed = {part.geometry for part in upload.parts}
        self._unbuilt = [geometry for geometry in self._unbuilt if geometry not in removed]

    def retire(self, upload: Upload) -> None:
        """Forget it, so that the next user of its content uploads that again: arrays may have been written to."""
        if self._shared.get(upload.key) is upload:
            del self._shared[upload.key]

    def build(self, encoder: spy.CommandEncoder) -> None:
        """Record the builds of the structures that are new and do not deform."""
        for geometry in self._unbuilt:
            geometry.build(encoder, self._corners(geometry.has_boxes), self.triangles.buffer)
        self._unbuilt = []

    def build_compact(self) -> None:
        """As `build`, at once and into as little memory as may be; waits for the GPU."""
        for boxes in (False, True):
            alike = [geometry for geometry in self._unbuilt if geometry.has_boxes == boxes]
            build_compact(self._device, alike, self._corners(boxes), self.triangles.buffer)
        self._unbuilt = []

    def _corners(self, boxes: bool) -> spy.Buffer:
        return self.primitives.boxes if boxes else self.positions.buffer

    def _upload(
        self, encoder: spy.CommandEncoder, mesh: Mesh, key: tuple[object, ...], previous: Runs | None, of_view: int
    ) -> Upload:
        placed = [self._upload_section(encoder, section, index, previous, of_view) for index, section in _ordered(mesh)]
        primitives, parts = self._upload_primitives(encoder, mesh, len(placed))
        parts = [*self._parts(placed, previous is not None), *parts]
        made = Upload(key, placed, primitives, parts, previous, _arrays(mesh) if key else [])
        if previous is None:
            self._unbuilt.extend(part.geometry for part in made.parts)
        return made

    def _upload_section(
        self, encoder: spy.CommandEncoder, section: Section, index: int, previous: Runs | None, of_view: int
    ) -> PlacedSection:
        first_vertex = self.positions.take(encoder, section.positions)
        assert self.vertices.take(encoder, _packed(section)) == first_vertex  # both allocators are in step
        first_index = self.triangles.take(encoder, section.indices)
        first_previous = NOT_DEFORMED
        if previous is not None:
            first_previous = previous.take(len(section.positions)) | of_view
        return PlacedSection(section, index, first_vertex, first_index, first_previous, object_box(section.positions))

    def _upload_primitives(
        self, encoder: spy.CommandEncoder, mesh: Mesh, first_section: int
    ) -> tuple[list[PlacedPrimitives], list[MeshPart]]:
        filled = [(index, copy(primitives)) for index, primitives in enumerate(mesh.primitives) if len(primitives)]
        if filled and not self._has_box_indices:
            self.first_box_index, self._has_box_indices = 3 * self.triangles.take(encoder, BOX_INDICES), True
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
                    first_index=3 * p.first_index,
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


def _content(mesh: Mesh) -> tuple[object, ...]:
    """What its upload depends on: arrays, and what sorts sections into parts. Empty for one with primitives."""
    if mesh.primitives:
        return ()
    kinds = ((section.material.stops_rays(), *_part_key(section)) for section in mesh.sections)
    return *map(id, _arrays(mesh)), *kinds


def _arrays(mesh: Mesh) -> list[NDArray[np.generic]]:
    return [getattr(section, name) for section in mesh.sections for name in _UPLOADED]


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
