"""All meshes in a few shared buffers, and one bottom-level structure per mesh and sidedness."""

from dataclasses import dataclass

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.acceleration import DeformingRtGeometry, ObjectFlags, RtGeometry, RtSection
from pica.rhi.device import Device
from pica.scene.material import AlphaMode
from pica.scene.model import Mesh, Node, Section

# shaders/scene_types.slang
NOT_DEFORMED = 0xFFFFFFFF
VERTEX = np.dtype([("normal", "u4"), ("tangent", "u4"), ("uv0", "f4", 2), ("uv1", "f4", 2), ("color", "u2", 4)])


@dataclass(frozen=True)
class PlacedSection:
    """A section and where it lies in the shared buffers."""

    section: Section
    first_vertex: int
    first_index: int
    first_previous: int = NOT_DEFORMED
    """Of its vertices among the previous positions."""


@dataclass(frozen=True)
class MeshPart:
    """The sections of a mesh that share a bottom-level structure, as all or none of them are culled."""

    geometry: RtGeometry | DeformingRtGeometry
    first_section: int
    flags: ObjectFlags


@dataclass(frozen=True)
class GpuMesh:
    """A mesh on the GPU: its sections in the order of their records, and its parts."""

    sections: list[PlacedSection]
    parts: list[MeshPart]


class GeometryBuffers:
    """Vertices and indices of every mesh. Indices count from their section's first vertex.

    A node that deforms its mesh has vertices and structures of its own, after all others.
    """

    def __init__(self, device: Device, nodes: list[Node]) -> None:
        shared = {id(node.mesh): node.mesh for node in nodes if node.mesh and not node.deforms}
        self._keys: list[object] = [*shared.values(), *(node for node in nodes if node.deforms)]
        ordered = [_ordered(key.mesh if isinstance(key, Node) else key) for key in self._keys]  # type: ignore[arg-type]
        sections = [section for found in ordered for section in found]
        positions = np.concatenate([section.positions for section in sections] or [np.zeros((1, 3), np.float32)])
        vertices = np.concatenate([_packed(section) for section in sections] or [np.zeros(1, VERTEX)])
        indices = np.concatenate([section.indices.reshape(-1) for section in sections] or [np.zeros(3, np.uint32)])
        usage = (
            spy.BufferUsage.shader_resource
            | spy.BufferUsage.unordered_access
            | spy.BufferUsage.acceleration_structure_build_input
            | spy.BufferUsage.index_buffer
        )
        self.positions = device.structured("positions", positions, usage)
        self.vertices = device.structured("vertices", vertices)
        self.indices = device.structured("indices", indices, usage)
        self._meshes: dict[int, GpuMesh] = {}
        first_vertex = first_index = first_previous = 0
        previous: list[NDArray[np.float32]] = []
        for key, found in zip(self._keys, ordered, strict=True):
            deforms = isinstance(key, Node)
            placed = []
            for section in found:
                place = first_vertex, first_index, first_previous if deforms else NOT_DEFORMED
                placed.append(PlacedSection(section, *place))
                first_vertex += len(section.positions)
                first_index += section.indices.size
                if deforms:
                    first_previous += len(section.positions)
                    previous.append(section.positions)
            self._meshes[id(key)] = GpuMesh(placed, self._parts(device, placed, deforms))
        self.previous_positions = device.structured(
            "previous positions", np.concatenate(previous or [np.zeros((1, 3), np.float32)])
        )

    def mesh(self, node: Node) -> GpuMesh:
        """The node's own mesh where it deforms it, else the shared one."""
        return self._meshes[id(node) if node.deforms else id(node.mesh)]

    def _parts(self, device: Device, sections: list[PlacedSection], deforms: bool) -> list[MeshPart]:
        parts = []
        for double_sided in (False, True):
            run = [p for p in sections if p.section.material.double_sided == double_sided]
            if not run:
                continue
            rt_sections = [
                RtSection(
                    first_vertex=p.first_vertex,
                    vertex_count=len(p.section.positions),
                    first_index=p.first_index,
                    index_count=p.section.indices.size,
                    opaque=p.section.material.alpha_mode is AlphaMode.OPAQUE,
                )
                for p in run
            ]
            kind = DeformingRtGeometry if deforms else RtGeometry
            geometry = kind(device, self.positions, self.indices, rt_sections)
            flags = ObjectFlags.CULL_DISABLE if double_sided else ObjectFlags.NONE
            parts.append(MeshPart(geometry, sections.index(run[0]), flags))
        return parts


def _ordered(mesh: Mesh) -> list[Section]:
    """The sections that have triangles, those of one sidedness together, so that each part is one run of records."""
    filled = [_without_unused(section) for section in mesh.sections if len(section.indices)]
    return sorted(filled, key=lambda section: section.material.double_sided)


def _without_unused(section: Section) -> Section:
    """The section with the vertices that its triangles use; files often share one big array among sections."""
    used, indices = np.unique(section.indices, return_inverse=True)
    if len(used) == len(section.positions):
        return section
    return section.take(used.astype(np.intp), indices.reshape(-1, 3).astype(np.uint32))


def _packed(section: Section) -> NDArray[np.void]:
    vertices = np.zeros(len(section.positions), VERTEX)
    vertices["normal"] = octahedral(section.normals)
    # The bitangent's sign takes the lowest bit, which costs the tangent 1/65536 of precision.
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
