"""Deformation of meshes: joints of vertices, morph targets, and skins (3.7.2.2 and 3.7.3)."""

from collections.abc import Collection
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.gltf.accessors import Rows, element_count, read_accessor, read_floats, read_matrices
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.model import Node
from pica.scene.skin import Skin

_MORPHED = ("POSITION", "NORMAL", "TANGENT")
_UNIT_WITHIN = 1e-6
"""By how much sums of weights differ from 1 by rounding to 32 bits."""
_JOINT_BYTES = 1000
"""Bytes per joint of a skin: its matrices, and its rows of indices."""


def morph_offsets(
    document: Document, primitive: Element, base: Collection[str], vertex_count: int, subset: Rows | None
) -> dict[str, NDArray[np.float32]]:
    """Offsets of the morph targets for those of POSITION, NORMAL and TANGENT in `base`.

    (vertices, targets, 3), for the `subset` vertices, or for all.
    """
    offsets: dict[str, NDArray[np.float32]] = {}
    if "targets" not in primitive:
        return offsets
    targets = primitive.objects("targets")
    count = vertex_count if subset is None else len(subset)

    def room() -> NDArray[np.float32]:
        document.take(primitive, "targets", bytes=2 * 12 * count * len(targets))  # twice: by target in the end
        return np.zeros((count, len(targets), 3), np.float32)

    for number, target in enumerate(targets):
        if not target.keys() <= set(_MORPHED):
            document.warn("morph targets change positions, normals and tangents; what else theirs do is left out")
        for name in _MORPHED:
            if name not in base or name not in target:
                continue
            check_per_vertex(document, target, name, vertex_count)
            values = read_floats(document, target, name, ("VEC3",), subset)
            if name not in offsets:
                offsets[name] = room()
            offsets[name][:, number] = values
    if targets and "POSITION" not in offsets:
        offsets["POSITION"] = room()
    return offsets


def joints_and_weights(
    document: Document, accessors: Element, vertex_count: int, subset: Rows | None
) -> tuple[NDArray[np.uint16], NDArray[np.float32]] | None:
    """(vertices, k) each, of the `subset` vertices or all, from any number of sets, without columns of zero weight.

    None if there are none.
    """
    joint_sets, weight_sets = [], []
    for number in count():
        names = f"JOINTS_{number}", f"WEIGHTS_{number}"
        missing = [name for name in names if name not in accessors]
        if len(missing) == 2:
            break
        if missing:
            raise accessors.fault(f"lacks {missing[0]}, which goes with {(set(names) - set(missing)).pop()}")
        for name in names:
            check_per_vertex(document, accessors, name, vertex_count)
        joints = read_accessor(document, accessors, names[0], ("VEC4",), subset)
        weights = read_floats(document, accessors, names[1], ("VEC4",), subset)
        if joints.dtype not in (np.uint8, np.uint16):
            raise accessors.fault("joints must be unsigned integers of 8 or 16 bits", names[0])
        if weights.min() < 0:
            raise accessors.fault(f"a weight is negative ({weights.min():g})", names[1])
        joint_sets.append(joints)
        weight_sets.append(weights)
    if not joint_sets:
        return None
    return normalized(np.concatenate(joint_sets, axis=1), np.concatenate(weight_sets, axis=1))


def normalized(joints: NDArray[Any], weights: NDArray[np.float32]) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """Weights with sums of 1; a vertex without any follows its first joint. Joints without weight become 0."""
    sums = weights.sum(axis=1, dtype=np.float64)
    divisors = np.where((sums > 0) & (np.abs(sums - 1) > _UNIT_WITHIN), sums, 1)  # others are kept to the bit
    weights = np.where(sums[:, None] > 0, weights / divisors[:, None], 0).astype(np.float32)
    weights[sums == 0, 0] = 1
    used = weights.any(axis=0)
    return np.where(weights > 0, joints, 0)[:, used].astype(np.uint16), weights[:, used]


def read_skin(document: Document, entry: Element, nodes: dict[Element, Node]) -> Skin:
    """A skin; `nodes`: the scene's nodes by their indices in the file. Raises SceneError."""
    joints = entry.references("joints", document.entries("nodes"))
    if not joints:
        raise entry.fault("is empty", "joints")
    for index, joint in enumerate(joints):
        if joint not in nodes:
            raise entry.fault(f"{joint.place()} is not in the scene that is shown", "joints", index)
    document.take(entry, "joints", bytes=len(joints) * _JOINT_BYTES)
    inverse_bind = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in entry:
        matrices = read_matrices(document, entry, "inverseBindMatrices")
        if len(matrices) < len(joints):
            raise entry.fault(f"{len(matrices)} matrices for {len(joints)} joints", "inverseBindMatrices")
        inverse_bind = matrices[: len(joints)]
    return entry.apply(Skin, [nodes[joint] for joint in joints], inverse_bind, entry.name)


def bind(document: Document, entry: Element, node: Node, skin: Skin) -> None:
    """Bind the node's mesh to the skin. Raises SceneError if it has too few joints; warns of meshes without any."""
    for section in node.mesh.sections if node.mesh is not None else ():
        if section.joints is None:
            document.warn(f"{entry.place()}: its skin is left out, the mesh lacks JOINTS_0 and WEIGHTS_0")
            return
        if section.joints.max() >= len(skin.joints):
            raise entry.fault(f"its mesh follows joint {section.joints.max()} of {len(skin.joints)}", "skin")
    node.skin = skin


def check_per_vertex(document: Document, source: Element, key: str, vertex_count: int) -> None:
    """Raise SceneError unless the accessor that `source` has under `key` has an element for every vertex."""
    elements = element_count(document, source, key)
    if elements != vertex_count:
        raise source.fault(f"{elements} elements for {vertex_count} positions", key)
