"""Meshes: primitives become sections of indexed triangles with every attribute present (3.7.2)."""

from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.scene.building import Attributes, complete, tangent_uvs
from pica.scene.gltf import points_and_lines
from pica.scene.gltf.accessors import Rows, element_count, read_floats, read_indices
from pica.scene.gltf.container import Document
from pica.scene.gltf.deformation import check_per_vertex, joints_and_weights, morph_offsets
from pica.scene.gltf.draco import decoded
from pica.scene.gltf.element import Element
from pica.scene.gltf.materials import Materials
from pica.scene.gltf.section_batch import SectionBatch
from pica.scene.model import Mesh, Section

TRIANGLES, _STRIP, _FAN = 4, 5, 6
_TYPES = {
    "POSITION": ("VEC3",), "NORMAL": ("VEC3",), "TANGENT": ("VEC4",),
    "TEXCOORD_0": ("VEC2",), "TEXCOORD_1": ("VEC2",), "COLOR_0": ("VEC3", "VEC4"),
}  # fmt: skip

_SECTION_BYTES = 1 << 15
"""The budget's cost of a section besides its vertices: more than its 3 kB, because each takes up to 0.3 ms."""
_VERTEX_BYTES, _CORNER_BYTES, _TANGENT_BYTES = 200, 16, 200
"""Memory for completing a vertex, and for a triangle's corner and its tangent: as measured,
and for vertices as much again for the device."""


class _Counts(NamedTuple):
    """Information on a mesh that thousands of nodes may show."""

    parts: int
    shining: int
    """Vertices of triangles that emit light."""
    targets: int
    entry: Element


class Meshes:
    """The meshes of a file, each made once, when first used; `complete` ends it."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self.materials = Materials(document)
        self._made: dict[Element, Mesh] = {}
        self._counts: dict[Mesh, _Counts] = {}
        self._batch = SectionBatch()

    @cached_property
    def _entries(self) -> list[Element]:
        return self._document.entries("meshes")

    def get(self, node: Element) -> Mesh:
        """The mesh of a node."""
        entry = node.reference("mesh", self._entries)
        if entry not in self._made:
            primitives = entry.objects("primitives")
            _check_target_counts(entry, primitives)
            parts = []
            for primitive in primitives:
                parts.append(self._section(decoded(self._document, primitive)))
                self._document.decoded.clear()  # no other primitive has its accessors
            sections = [section for section in parts if section is not None]
            mesh = self._made[entry] = entry.apply(Mesh, sections, entry.name)
            shining = sum(section.indices.size for section in sections if any(section.material.emission))
            self._counts[mesh] = _Counts(max(len(sections), 1), shining, mesh.target_count, entry)
        return self._made[entry]

    def expect(self, nodes: Iterable[Element]) -> None:
        """Get ready for the meshes that nodes show."""
        indices = (node.values["mesh"] for node in nodes if type(node.values.get("mesh")) is int)
        meshes = self._entries
        names = dict.fromkeys(mesh for mesh in indices if 0 <= mesh < len(meshes))
        primitives = [meshes[mesh].values.get("primitives") for mesh in names]
        self._document.small_accessors.prefetch(accessor for each in primitives for accessor in _accessors_of(each))
        self.materials.expect(primitive for each in primitives if type(each) is list for primitive in each)

    def complete(self) -> None:
        """Complete the meshes: until then sections may lack all but triangles and material."""
        self._batch.complete()

    def count_placed(self, node: Element, mesh: Mesh | None, copies: int) -> None:
        """Count a node's use of a mesh: its parts, whose emissive triangles are each a light in each copy."""
        parts, shining = (1, 0) if mesh is None else self._counts[mesh][:2]
        self._document.take(node, instances=copies * parts, vertices=copies * shining)

    def count_shown(self, mesh: Mesh, copies: int) -> None:
        """As count_placed, of a mesh that so many nodes show as it is."""
        self.count_placed(self._counts[mesh].entry, mesh, copies)

    def target_count(self, mesh: Mesh) -> int:
        """As of the mesh."""
        return self._counts[mesh].targets

    def _section(self, primitive: Element) -> Section | None:
        mode = primitive.integer("mode", high=_FAN, default=TRIANGLES) if "mode" in primitive else TRIANGLES
        accessors = primitive.object("attributes")
        if "POSITION" not in accessors:
            self._document.warn(f"{primitive.place()}: left out, it has no POSITION")
            return None
        self._document.take(primitive, bytes=_SECTION_BYTES)
        vertex_count = element_count(self._document, accessors, "POSITION")
        if mode < TRIANGLES:
            return self._points_or_lines(primitive, vertex_count, mode)
        triangles, used = self._triangles(primitive, vertex_count, mode)
        if not len(triangles):
            return None
        section = self._complete(primitive, triangles, used, vertex_count)
        if "extras" in primitive and primitive.pica.flag("flat", default=False):
            section.flat = True
        return section

    def _complete(
        self, primitive: Element, triangles: NDArray[np.uint32], used: Rows | None, vertex_count: int
    ) -> Section:  # fmt: skip
        """A section of the triangles; the batch may complete it later."""
        accessors, material = primitive.object("attributes"), self.materials.get(primitive)
        shared = "NORMAL" in accessors  # otherwise vertices of triangles are not shared
        vertices = triangles.size if not shared else vertex_count if used is None else len(used)
        tangents = tangent_uvs(material) is not None and not (shared and "TANGENT" in accessors)
        taken = vertices * _VERTEX_BYTES + tangents * triangles.size * _TANGENT_BYTES
        self._document.take(primitive, vertices=vertices, bytes=taken)
        attributes = self._attributes(primitive, accessors, vertex_count, used, self.materials.uv_sets(material))
        if not tangents and self._batch.takes(attributes, triangles):
            return self._batch.add(primitive, attributes, triangles, material)
        return primitive.apply(complete, attributes, triangles, material)

    def _points_or_lines(self, primitive: Element, vertex_count: int, mode: int) -> Section | None:
        accessors = primitive.object("attributes")
        named = (primitive, "indices") if "indices" in primitive else (accessors, "POSITION")
        count = element_count(self._document, *named)
        corners = 3 * count * points_and_lines.TRIANGLES
        vertices = count * points_and_lines.VERTICES
        self._document.take(primitive, vertices=vertices, bytes=vertices * _VERTEX_BYTES + corners * _CORNER_BYTES)
        order = self._order(primitive, vertex_count)
        uv_sets = self.materials.uv_sets(self.materials.get(primitive))
        attributes = self._attributes(primitive, accessors, vertex_count, None, uv_sets)
        attributes, triangles = points_and_lines.thickened(attributes, order, mode)
        if not len(triangles):
            return None
        material = self.materials.get(primitive) if "NORMAL" in accessors else self.materials.get_unlit(primitive)
        return primitive.apply(complete, attributes, triangles, material)

    def _order(self, primitive: Element, vertex_count: int) -> NDArray[np.uint32]:
        """The vertices that the primitive names, in its order."""
        if "indices" in primitive:
            return read_indices(self._document, primitive, "indices", vertex_count)
        return np.arange(vertex_count, dtype=np.uint32)

    def _triangles(self, primitive: Element, vertex_count: int, mode: int) -> tuple[NDArray[np.uint32], Rows | None]:
        """(triangles, 3) indices into the used vertices, and these vertices' indices in the file; None for all."""
        indexed = "indices" in primitive
        asks = (primitive, "indices") if indexed else (primitive.object("attributes"), "POSITION")
        corners = element_count(self._document, *asks) * (1 if mode == TRIANGLES else 3)
        self._document.take(*asks, bytes=corners * _CORNER_BYTES)
        return renumbered(triangulate(self._order(primitive, vertex_count), mode), vertex_count)

    def _attributes(
        self, primitive: Element, accessors: Element, vertex_count: int, used: Rows | None, uv_sets: tuple[int, int]
    ) -> Attributes:
        """The attributes of the vertices that are used, as far as the file has them; texture coordinates as if their
        numbers were 0 and 1."""
        attributes: Attributes = {}
        given_as = {f"TEXCOORD_{number}": f"TEXCOORD_{given}" for number, given in enumerate(uv_sets)}
        for name, types in _TYPES.items():
            given = given_as.get(name, name)
            if given in accessors:
                check_per_vertex(self._document, accessors, given, vertex_count)
                attributes[name] = read_floats(self._document, accessors, given, types, used)
        if "COLOR_0" in attributes:  # floats in files may be beyond
            attributes["COLOR_0"] = np.clip(attributes["COLOR_0"], 0, 1)
        offsets = morph_offsets(self._document, primitive, attributes, vertex_count, used)
        attributes |= {f"MORPH_{name}": values for name, values in offsets.items()}
        followed = joints_and_weights(self._document, accessors, vertex_count, used)
        if followed is not None:
            attributes["JOINTS"], attributes["WEIGHTS"] = followed
        return attributes


def _accessors_of(primitives: Any) -> Iterator[Any]:
    """The accessors of primitives with a surface, unchecked."""
    for primitive in primitives if type(primitives) is list else ():
        if type(primitive) is dict and primitive.get("mode") in (None, TRIANGLES, _STRIP, _FAN):
            attributes = primitive.get("attributes")
            if type(attributes) is dict and "POSITION" in attributes:
                yield primitive.get("indices")
                yield from (accessor for name, accessor in attributes.items() if name in _TYPES)


def renumbered(triangles: NDArray[np.uint32], vertex_count: int) -> tuple[NDArray[np.uint32], Rows | None]:
    """The triangles, (n, 3), as indices into the used vertices, and these vertices; None for all."""
    if vertex_count > 8 * triangles.size:  # part of a large mesh: a mask over all its vertices would be slower
        used, corners = np.unique(triangles, return_inverse=True)
        return corners.reshape(-1, 3).astype(np.uint32), used.astype(np.intp)
    in_use = np.zeros(vertex_count, bool)
    in_use[triangles] = True
    if np.count_nonzero(in_use) == vertex_count:
        return triangles, None
    numbers = np.cumsum(in_use, dtype=np.uint32) - np.uint32(1)
    return numbers[triangles], np.flatnonzero(in_use)


def _check_target_counts(mesh: Element, primitives: list[Element]) -> None:
    """Raises SceneError when the primitives differ in their number of morph targets (3.7.2.2)."""
    if not any("targets" in primitive for primitive in primitives):
        return
    counts = sorted({len(primitive.objects("targets")) for primitive in primitives})
    if len(counts) > 1:
        raise mesh.fault(f"differ in their number of morph targets ({counts[0]} to {counts[-1]})", "primitives")


def triangulate(order: NDArray[np.uint32], mode: int) -> NDArray[np.uint32]:
    """(triangles, 3) of a list of vertices as triangles, strip or fan; those with a repeated vertex are dropped."""
    # 3.7.2.1: every second triangle of a strip has its last two vertices swapped, a fan turns about its first
    if mode == TRIANGLES:
        triangles = order[: len(order) // 3 * 3].reshape(-1, 3)
    elif mode == _STRIP:
        triangles = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
        triangles[1::2, 1:] = triangles[1::2, :0:-1]
    else:
        triangles = np.stack([order[1:-1], order[2:], np.full(max(len(order) - 2, 0), order[0])], axis=1)
    a, b, c = triangles.T
    kept = (a != b) & (b != c) & (c != a)
    return triangles if np.count_nonzero(kept) == len(kept) else triangles[kept]
