"""What deforms meshes: the joints that vertices follow, morph targets, and skins (3.7.2.2 and 3.7.3)."""

from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.gltf.accessors import read_accessor, read_floats
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.model import Node
from pica.scene.skin import Skin

_MORPHED = ("POSITION", "NORMAL", "TANGENT")


def morph_offsets(
    document: Document, primitive: Element, base: dict[str, NDArray[Any]], vertex_count: int
) -> dict[str, NDArray[np.float32]]:
    """Offsets (vertices, targets, 3) to those of POSITION, NORMAL and TANGENT that `base` has and a target changes."""
    offsets: dict[str, NDArray[np.float32]] = {}
    targets = primitive.objects("targets")
    for number, target in enumerate(targets):
        if not target.keys() <= set(_MORPHED):
            document.warn("morph targets change positions, normals and tangents; what else theirs do is left out")
        for name in _MORPHED:
            if name not in base or name not in target:
                continue
            values = read_floats(document, target, name, ("VEC3",))
            if name not in offsets:
                offsets[name] = np.zeros((vertex_count, len(targets), 3), np.float32)
            offsets[name][:, number] = per_vertex(values, vertex_count, target, name)
    if targets:
        offsets.setdefault("POSITION", np.zeros((vertex_count, len(targets), 3), np.float32))
    return offsets


def joints_and_weights(
    document: Document, accessors: Element, vertex_count: int
) -> tuple[NDArray[np.uint16], NDArray[np.float32]] | None:
    """(vertices, k) each, from any number of sets, without columns that have no weight; None where there are none."""
    joint_sets, weight_sets = [], []
    for number in count():
        names = f"JOINTS_{number}", f"WEIGHTS_{number}"
        missing = [name for name in names if name not in accessors]
        if len(missing) == 2:
            break
        if missing:
            raise accessors.fault(f"lacks {missing[0]}, which goes with {(set(names) - set(missing)).pop()}")
        joints = per_vertex(read_accessor(document, accessors, names[0], ("VEC4",)), vertex_count, accessors, names[0])
        weights = per_vertex(read_floats(document, accessors, names[1], ("VEC4",)), vertex_count, accessors, names[1])
        if joints.dtype not in (np.uint8, np.uint16):
            raise accessors.fault("joints must be unsigned integers of 8 or 16 bits", names[0])
        if weights.min() < 0:
            raise accessors.fault(f"a weight is negative ({weights.min():g})", names[1])
        joint_sets.append(joints)
        weight_sets.append(weights)
    if not joint_sets:
        return None
    return _normalized(np.concatenate(joint_sets, axis=1), np.concatenate(weight_sets, axis=1))


def _normalized(joints: NDArray[Any], weights: NDArray[np.float32]) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """Weights with sums of 1; a vertex without any follows its first joint. Joints without weight become 0."""
    sums = weights.sum(axis=1, dtype=np.float64)
    weights = np.where(sums[:, None] > 0, weights / np.where(sums > 0, sums, 1)[:, None], 0).astype(np.float32)
    weights[sums == 0, 0] = 1
    used = weights.any(axis=0)
    return np.where(weights > 0, joints, 0)[:, used].astype(np.uint16), weights[:, used]


def read_skin(document: Document, entry: Element, nodes: dict[Element, Node]) -> Skin:
    """A skin; `nodes` are those of the scene, by what the file says of them. Raises SceneError."""
    joints = entry.references("joints", document.entries("nodes"))
    if not joints:
        raise entry.fault("is empty", "joints")
    for index, joint in enumerate(joints):
        if joint not in nodes:
            raise entry.fault(f"{joint.place()} is not in the scene that is shown", "joints", index)
    inverse_bind = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in entry:
        matrices = read_floats(document, entry, "inverseBindMatrices", ("MAT4",))
        if len(matrices) < len(joints):
            raise entry.fault(f"{len(matrices)} matrices for {len(joints)} joints", "inverseBindMatrices")
        inverse_bind = matrices[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)
    return Skin([nodes[joint] for joint in joints], inverse_bind, entry.name)


def bind(document: Document, entry: Element, node: Node, skin: Skin) -> None:
    """Let the node's mesh follow the skin. Raises SceneError when it has not enough joints; warns of what has none."""
    for section in node.mesh.sections if node.mesh is not None else ():
        if section.joints is None:
            document.warn(f"{entry.place()}: its skin is left out, the mesh lacks JOINTS_0 and WEIGHTS_0")
            return
        if section.joints.max() >= len(skin.joints):
            raise entry.fault(f"its mesh follows joint {section.joints.max()} of {len(skin.joints)}", "skin")
    node.skin = skin


def per_vertex(values: NDArray[Any], vertex_count: int, source: Element, key: str) -> NDArray[Any]:
    """The values that `source` has under `key`. Raises SceneError unless there is one for every vertex."""
    if len(values) != vertex_count:
        raise source.fault(f"{len(values)} elements for {vertex_count} positions", key)
    return values
