"""Skins and morph targets: how the vertices of a node's mesh move against each other (glTF 2.0, 3.7.2.2 and 3.7.3)."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.arrays import doubles
from pica.scene.checked_field import described, fitting
from pica.scene.fixed import Fixed
from pica.scene.normals import face_normals, perpendicular
from pica.scene.values import UnfitError, items, text

if TYPE_CHECKING:
    from pica.scene.model import Node, Section

Floats = NDArray[np.float64]


@checked_names(SceneError)
@dataclass(eq=False)
class Skin(Fixed):
    """The joints of skinned meshes. Make it when the joints are in their tree, where they must stay.

    Skinned vertices are relative to `root`, the joints' closest common ancestor, whose world matrix places them; the
    skinned node's own is ignored (glTF 2.0, 3.7.3.3). So a figure that moves as a whole needs a new instance transform
    but neither skinning nor a new bottom-level structure, and 32-bit positions stay exact far from the world's origin.
    Raises SceneError unless there are one or more joints and a finite matrix for each.
    """

    joints: Sequence["Node"]
    inverse_bind: Floats
    """(joints, 4, 4) object space of the mesh to that of each joint, in the bind pose."""
    name: str = ""
    root: "Node | None" = field(init=False)
    """None where the joints have no ancestor in common: vertices are in world space."""
    links: "tuple[Node, ...]" = field(init=False)
    """The joints and all nodes between them and the root, parents first: moving one of them moves vertices."""
    _parent_rows: list[int] = field(init=False)
    _joint_rows: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self._renew(name=fitting(self, "name", text, self.name))
        self._renew(
            joints=fitting(self, "joints", _joints, self.joints),
            inverse_bind=fitting(self, "inverse_bind", doubles("joints", 4, 4), self.inverse_bind),
        )
        if len(self.inverse_bind) != len(self.joints):
            fault = f"{len(self.inverse_bind)} matrices for {len(self.joints)} joints"
            raise SceneError(f"{described(self)}: inverse_bind: {fault}")
        lines = _with_ancestors(self.joints)
        branches = Counter(node.parent for node in lines)
        below = {node.parent: node for node in lines}
        joints = set(self.joints)
        root: Node | None = None
        above = set()
        while root not in joints and branches[root] == 1:
            root = below[root]
            above.add(root)
        self.root = root
        self.links = tuple(node for node in lines if node not in above)
        rows: dict[Node | None, int] = {node: row for row, node in enumerate(self.links, start=1)}
        self._parent_rows = [rows.get(node.parent, 0) for node in self.links]
        self._joint_rows = [rows.get(joint, 0) for joint in self.joints]
        self._complete = True

    @property
    def world(self) -> Floats:
        """(4, 4) the space of skinned vertices to the world."""
        return np.eye(4) if self.root is None else self.root.world

    def joint_matrices(self) -> Floats:
        """(joints, 4, 4) M: a vertex p of the mesh is transformed to sum(weight * M[joint]) p, relative to the root."""
        to_root = np.empty((len(self.links) + 1, 4, 4))
        to_root[0] = np.eye(4)
        for row, (link, parent) in enumerate(zip(self.links, self._parent_rows, strict=True), start=1):
            np.matmul(to_root[parent], link.transform, out=to_root[row])
        return to_root[self._joint_rows] @ self.inverse_bind


def deform(section: "Section", node: "Node") -> tuple[Floats, Floats, Floats]:
    """Positions (vertices, 3), unit normals (vertices, 3) and tangents (vertices, 4) of a section, posed by `node`.

    First morphed, then skinned; node.instance_transforms() places them in the world. Tangents stay orthogonal
    to the normals. It is the reference of the shaders. A node with a deformer uses that instead.
    """
    if node.deformer is not None:
        return node.deformer.deform(section)
    positions, normals, tangents = (
        _morphed(base, offsets, node.weights)
        for base, offsets in (
            (section.positions, section.morph_positions),
            (section.normals, section.morph_normals),
            (section.tangents[:, :3], section.morph_tangents),
        )
    )
    if node.skin is not None and section.joints is not None and section.weights is not None:
        blended = _blended(node.skin.joint_matrices()[:, :3], section.joints, section.weights)
        linear = blended[:, :, :3]
        positions = np.einsum("vij,vj->vi", linear, positions) + blended[:, :, 3]
        normals = np.einsum("vij,vj->vi", _cofactors(linear), normals)
        tangents = np.einsum("vij,vj->vi", linear, tangents)
    if section.flat:
        normals[section.indices] = face_normals(positions, section.indices)[:, None]
    normals = _unit(normals, section.normals)
    tangents = tangents - normals * np.sum(normals * tangents, axis=1, keepdims=True)
    tangents = _unit(tangents, perpendicular(normals))
    return positions, normals, np.column_stack([tangents, section.tangents[:, 3]])


def deformed_positions(section: "Section", node: "Node") -> Floats:
    """(vertices, 3) as `deform` has them."""
    return deform(section, node)[0] if node.deformer is None else node.deformer.positions_of(section)


def _joints(values: Any) -> "tuple[Node, ...]":
    from pica.scene.model import Node  # which imports skins

    joints = items(Node)(values)
    if not joints:
        raise UnfitError("are none")
    return joints


def _with_ancestors(joints: Iterable["Node"]) -> "dict[Node, None]":
    """The nodes and all above them, each once, parents first."""
    ordered: dict[Node, None] = {}
    for joint in joints:
        line = []
        node: Node | None = joint
        while node is not None and node not in ordered:
            line.append(node)
            node = node.parent
        ordered.update(dict.fromkeys(reversed(line)))
    return ordered


def _morphed(base: NDArray[np.float32], offsets: NDArray[np.float32] | None, weights: Floats | None) -> Floats:
    # glTF 2.0, 3.7.2.2: base + sum(weight * offset)
    start = base.astype(np.float64)
    return start if offsets is None or weights is None else start + np.tensordot(weights, offsets, 1)


def _blended(matrices: Floats, joints: NDArray[np.uint16], weights: NDArray[np.float32]) -> Floats:
    """(vertices, 3, 4) sums of each vertex's joint matrices times its weights."""
    total = np.zeros((len(joints), 3, 4))
    for joint, weight in zip(joints.T, weights.T, strict=True):
        total += weight[:, None, None] * matrices[joint]
    return total


def _cofactors(linear: Floats) -> Floats:
    """(count, 3, 3) transforms of normals for `linear`, those of points: cof(A) (a x b) = (A a) x (A b)."""
    x, y, z = linear[:, :, 0], linear[:, :, 1], linear[:, :, 2]
    return np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=2)


def _unit(vectors: Floats, spare: NDArray[np.float32]) -> Floats:
    """The vectors at unit length; the spare ones where that is impossible."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1), spare)
