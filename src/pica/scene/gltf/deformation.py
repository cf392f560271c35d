"""What deforms meshes: the joints that vertices follow, morph targets, and skins (3.7.2.2 and 3.7.3)."""

from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.gltf.accessors import read_accessor, read_floats
from pica.scene.gltf.checks import listing, mapping, shown, text
from pica.scene.gltf.container import Document
from pica.scene.model import Node
from pica.scene.skin import Skin

_MORPHED = ("POSITION", "NORMAL", "TANGENT")


def target_count(document: Document, mesh: int) -> int:
    """How many morph targets a mesh has. Raises SceneError when its primitives differ in that."""
    where = f"meshes[{mesh}].primitives"
    primitives = listing(document.gltf.meshes[mesh].primitives, where)
    counts = {len(listing(primitive.targets, f"{where}[{i}].targets")) for i, primitive in enumerate(primitives)}
    if len(counts) > 1:
        raise SceneError(f"{where}: differ in their number of morph targets ({', '.join(map(str, sorted(counts)))})")
    return counts.pop() if counts else 0


def morph_offsets(
    document: Document, targets: list[Any], base: dict[str, NDArray[Any]], vertex_count: int, where: str
) -> dict[str, NDArray[np.float32]]:
    """Offsets (vertices, targets, 3) to those of POSITION, NORMAL and TANGENT that `base` has and a target changes."""
    offsets: dict[str, NDArray[np.float32]] = {}
    for number, entry in enumerate(targets):
        target, place = mapping(entry, f"{where}.targets[{number}]"), f"{where}.targets[{number}]"
        if not target.keys() <= set(_MORPHED):
            document.warn("morph targets change positions, normals and tangents; what else theirs do is left out")
        for name in _MORPHED:
            if name not in base or target.get(name) is None:
                continue
            values = read_floats(document, target[name], f"{place}.{name}", ("VEC3",))
            if name not in offsets:
                offsets[name] = np.zeros((vertex_count, len(targets), 3), np.float32)
            offsets[name][:, number] = per_vertex(values, vertex_count, f"{place}.{name}")
    if targets:
        offsets.setdefault("POSITION", np.zeros((vertex_count, len(targets), 3), np.float32))
    return offsets


def joints_and_weights(
    document: Document, accessors: dict[str, Any], vertex_count: int, where: str
) -> tuple[NDArray[np.uint16], NDArray[np.float32]] | None:
    """(vertices, k) each, from any number of sets, without columns that have no weight; None where there are none."""
    joint_sets, weight_sets = [], []
    for number in count():
        names = f"JOINTS_{number}", f"WEIGHTS_{number}"
        missing = [name for name in names if accessors.get(name) is None]
        if len(missing) == 2:
            break
        if missing:
            raise SceneError(f"{where}: lacks {missing[0]}, which goes with {(set(names) - set(missing)).pop()}")
        joints, weights = (f"{where}.{name}" for name in names)
        joint_sets.append(
            per_vertex(read_accessor(document, accessors[names[0]], joints, ("VEC4",)), vertex_count, joints)
        )
        weight_sets.append(
            per_vertex(read_floats(document, accessors[names[1]], weights, ("VEC4",)), vertex_count, weights)
        )
        if joint_sets[-1].dtype not in (np.uint8, np.uint16):
            raise SceneError(f"{joints}: joints must be unsigned integers of 8 or 16 bits")
        if weight_sets[-1].min() < 0:
            raise SceneError(f"{weights}: a weight is negative ({weight_sets[-1].min():g})")
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


def read_skin(document: Document, index: int, nodes: dict[int, Node], where: str) -> Skin:
    """Skin `index`; `nodes` are those of the scene, by their number in the file. Raises SceneError."""
    entry = document.item("skins", index, where)
    where = f"skins[{index}]"
    joints = listing(entry.joints, f"{where}.joints")
    if not joints:
        raise SceneError(f"{where}.joints: is empty")
    for joint in joints:
        document.item("nodes", joint, f"{where}.joints")
        if joint not in nodes:
            raise SceneError(f"{where}.joints: nodes[{joint}] is not in the scene that is shown")
    inverse_bind = np.tile(np.eye(4), (len(joints), 1, 1))
    if entry.inverseBindMatrices is not None:
        name = f"{where}.inverseBindMatrices"
        matrices = read_floats(document, entry.inverseBindMatrices, name, ("MAT4",))
        if len(matrices) < len(joints):
            raise SceneError(f"{name}: {len(matrices)} matrices for {len(joints)} joints")
        inverse_bind = matrices[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)
    return Skin([nodes[joint] for joint in joints], inverse_bind, text(entry.name))


def bind(document: Document, node: Node, skin: Skin, where: str) -> None:
    """Let the node's mesh follow the skin. Raises SceneError when it has not enough joints; warns of what has none."""
    for section in node.mesh.sections if node.mesh is not None else ():
        if section.joints is None:
            document.warn(f"{where}: its skin is left out, the mesh lacks JOINTS_0 and WEIGHTS_0")
            return
        if section.joints.max() >= len(skin.joints):
            raise SceneError(f"{where}: its mesh follows joint {section.joints.max()} of {len(skin.joints)}")
    node.skin = skin


def per_vertex(values: NDArray[Any], vertex_count: int, where: str) -> NDArray[Any]:
    """The values. Raises SceneError unless there is one for every vertex."""
    if len(values) != vertex_count:
        raise SceneError(f"{where}: {len(values)} elements for {shown(vertex_count)} positions")
    return values
