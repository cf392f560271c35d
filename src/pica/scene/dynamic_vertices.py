"""Meshes whose vertices the user sets from frame to frame: cloth, or any other simulation (RTG 19, 19.2.1.3)."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.scene.arrays import floats
from pica.scene.deformer import Deformer, Floats, unit
from pica.scene.model import Mesh, Node, Section
from pica.scene.values import checked, instance

_NOTHING = np.zeros(0, np.uint32)


class DynamicVertices(Deformer):
    """Moves the vertices of a node's mesh to positions from `set`. Triangles, texture coordinates and colours stay.

        cloth = DynamicVertices(node)
        cloth.set(positions)  # before each frame

    The arrays have a row for each vertex of the mesh, section by section. The node
    shows copies of the sections; other nodes with the same mesh are not affected. Raises SceneError for a node
    without triangles and for one that is deformed otherwise.
    """

    def __init__(self, node: Node) -> None:
        checked("dynamic vertices: node", instance(Node), node)
        if node.mesh is None or not node.mesh.sections or node.mesh.primitives:
            raise SceneError(f"dynamic vertices: node {node.name!r} needs a mesh that is made of triangles alone")
        if node.deforms:
            raise SceneError(f"dynamic vertices: node {node.name!r} has a skin, weights or a deformer already")
        firsts = np.cumsum([0] + [len(section.positions) for section in node.mesh.sections])
        numbered = [
            replace(section, rows=first + np.arange(len(section.positions), dtype=np.uint32))
            for section, first in zip(node.mesh.sections, firsts[:-1].astype(np.uint32), strict=True)
        ]
        self._node_name, self.count = node.name, int(firsts[-1])
        self._rest = _joined(numbered)
        self._flat_rows = np.concatenate([s.rows for s in numbered if s.flat and s.rows is not None] or [_NOTHING])
        self.positions = self._rest.positions
        """(count, 3) float32, metres in the node's space, as they were last set."""
        self.normals: NDArray[np.float32] | None = None
        """(count, 3) as they were last set; None: they follow the triangles."""
        self.version = 1
        """Counts calls of `set`."""
        node.deformer = self
        node.show(Mesh(numbered, node.mesh.name))

    def set(self, positions: ArrayLike, normals: ArrayLike | None = None) -> None:
        """Move the vertices to `positions` (count, 3), metres in the node's space, from the next picture on.

        `normals` (count, 3) of any length but 0; None: those of the triangles round each vertex, weighted by
        area, and averaged over coincident vertices with equal normals in the original mesh. Tangents follow the
        triangles. Both arrays, or tensors, are copied. Raises SceneError for other shapes and for numbers that are not
        finite.
        """
        checked = self._checked("positions", positions)
        given = None if normals is None else self._checked("normals", normals)
        if given is not None and not given.any(axis=1).all():
            raise SceneError(f"dynamic vertices of node {self._node_name!r}: a normal has no length; leave normals out")
        self._renew(positions=checked, normals=given, version=self.version + 1)
        self.__dict__.pop("_frames", None)
        self.changed()

    def deform(self, section: Section) -> tuple[Floats, Floats, Floats]:
        """As Deformer."""
        assert section.rows is not None
        normals, tangents = self._frames
        signs = self._rest.tangents[section.rows, 3]
        return self.positions_of(section), normals[section.rows], np.column_stack([tangents[section.rows], signs])

    def positions_of(self, section: Section) -> Floats:
        """As Deformer; needs no normals."""
        assert section.rows is not None
        return self.positions[section.rows].astype(np.float64)

    @cached_property
    def corners(self) -> "Corners":
        """The triangles round each vertex."""
        return corners_of(self._rest, self._flat_rows)

    @cached_property
    def _frames(self) -> tuple[Floats, Floats]:
        """(count, 3) normals and tangents of all vertices."""
        rest, round_each = self._rest, self.corners
        owner = np.repeat(np.arange(self.count), np.diff(round_each.first))
        here = self.positions.astype(np.float64)
        edges = here[round_each.others] - here[round_each.at][:, None]
        normals, tangents = np.zeros((2, self.count, 3))
        np.add.at(normals, owner, np.cross(edges[:, 0], edges[:, 1]))
        np.add.at(tangents, owner, np.einsum("ce,cei->ci", round_each.tangents, edges))
        if self.normals is not None:
            normals = self.normals.astype(np.float64)
        normals = unit(normals, rest.normals.astype(np.float64))
        across = tangents - normals * np.sum(normals * tangents, axis=1, keepdims=True)
        return normals, unit(across, rest.tangents[:, :3].astype(np.float64))

    def _checked(self, name: str, values: ArrayLike) -> NDArray[np.float32]:
        where = f"dynamic vertices of node {shown(self._node_name)}: {name}"
        array = checked(where, floats(), values)
        if array.shape != (self.count, 3):
            raise SceneError(f"{where} of shape {array.shape}; give ({self.count}, 3), one row a vertex")
        return array.copy()


class Corners:
    """For each vertex, the corners of the triangles that its normal and its tangent follow."""

    def __init__(
        self,
        first: NDArray[np.uint32],
        at: NDArray[np.uint32],
        others: NDArray[np.uint32],
        tangents: NDArray[np.float32],
    ) -> None:
        self.first = first
        """(count + 1,) of each vertex among the corners."""
        self.at = at
        """(corners,) the vertex at the corner: this one, or one that coincides with it."""
        self.others = others
        """(corners, 2) the triangle's other two vertices, counter-clockwise."""
        self.tangents = tangents
        """(corners, 2) the tangent's components along the edges from them, times the triangle's area at rest."""


def corners_of(rest: Section, flat_rows: NDArray[np.uint32]) -> Corners:
    """The corners round each vertex of a section, as it was made; `flat_rows`: vertices with a face's normal."""
    # Coincident vertices share a normal, except in flat sections, where vertices belong to one triangle each.
    alone = np.zeros(len(rest.positions))
    alone[flat_rows] = 1 + np.arange(len(flat_rows))
    extent = max(float(np.ptp(rest.positions, axis=0).max()), 1e-30)
    steps = np.rint(np.column_stack([rest.positions * (2.0**20 / extent), rest.normals * 1024.0]))
    alike = np.column_stack([steps, alone]) + 0.0  # -0 is 0
    group = np.unique(alike, axis=0, return_inverse=True)[1].reshape(-1)
    turned = np.concatenate([rest.indices, np.roll(rest.indices, -1, 1), np.roll(rest.indices, -2, 1)])
    turned = turned[np.argsort(group[turned[:, 0]], kind="stable")]
    counts = np.bincount(group[turned[:, 0]], minlength=group.max() + 1)
    starts = np.cumsum(counts) - counts
    per_vertex = counts[group]
    first = np.concatenate([[0], np.cumsum(per_vertex)])
    which = np.repeat(starts[group] - first[:-1], per_vertex) + np.arange(first[-1])
    corners = turned[which]
    tangents = np.repeat(rest.tangents[:, :3].astype(np.float64), per_vertex, axis=0)
    at_rest = rest.positions.astype(np.float64)
    a, b = (at_rest[corners[:, side]] - at_rest[corners[:, 0]] for side in (1, 2))
    # The tangent's components along each edge: least squares by the normal equations, whose determinant is 4 area².
    aa, ab, bb = (np.sum(u * v, axis=1) for u, v in ((a, a), (a, b), (b, b)))
    ta, tb = np.sum(tangents * a, axis=1), np.sum(tangents * b, axis=1)
    determinant = aa * bb - ab * ab
    flat = determinant <= 1e-12 * np.maximum(aa * bb, 1e-300)
    area = np.sqrt(np.maximum(determinant, 0))
    shares = np.stack([ta * bb - tb * ab, tb * aa - ta * ab], 1) / np.where(flat, 1, area)[:, None]
    return Corners(
        first.astype(np.uint32),
        corners[:, 0],
        corners[:, 1:],
        np.where(flat[:, None], 0, shares / max(float(area.mean()) if len(area) else 1, 1e-30)).astype(np.float32),
    )


def _joined(sections: list[Section]) -> Section:
    """All vertices and triangles as one section; materials do not count."""

    def column(name: str) -> NDArray[np.float32]:
        return np.concatenate([getattr(section, name) for section in sections])

    return Section(
        positions=column("positions"),
        normals=column("normals"),
        tangents=column("tangents"),
        uv0=column("uv0"),
        uv1=column("uv1"),
        colors=column("colors"),
        indices=np.concatenate([section.rows[section.indices] for section in sections if section.rows is not None]),
        material=sections[0].material,
    )
