"""Nodes: the hierarchy, and what stands at each place (3.5)."""

import math
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import Pose, compose
from pica.scene.camera import Camera
from pica.scene.gltf.accessors import element_count, read_floats
from pica.scene.gltf.animations import read_animations
from pica.scene.gltf.container import Document
from pica.scene.gltf.deformation import bind, read_skin
from pica.scene.gltf.element import Element
from pica.scene.gltf.lights import Lights, read_visibility
from pica.scene.gltf.meshes import Meshes
from pica.scene.limits import OBJECT_BYTES
from pica.scene.model import Mesh, Node, Scene
from pica.scene.node import worth_checking
from pica.scene.skin import Skin
from pica.scene.values import LARGEST

_PERSPECTIVE, _ORTHOGRAPHIC = "perspective", "orthographic"
_CAMERAS = {kind: kind for kind in (_PERSPECTIVE, _ORTHOGRAPHIC)}
_ORTHOGRAPHIC_FAR = 1e4
_INSTANCING = "EXT_mesh_gpu_instancing"
_NO_TRANSLATION, _NO_ROTATION, _NO_SCALE = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0)
_INSTANCE_DEFAULTS = {"TRANSLATION": _NO_TRANSLATION, "ROTATION": _NO_ROTATION, "SCALE": _NO_SCALE}

_INSTANCE_BYTES = 400
"""What it takes to put a matrix together."""

_NO_TURN = "a quaternion of zeros is no rotation"


def build_scene(document: Document) -> Scene:
    """The file's default scene, else its first, else all nodes without a parent. Raises SceneError."""
    hierarchy = _Hierarchy(document)
    name, roots = hierarchy.shown()
    scene = Scene(name)
    nodes = _make_nodes(document, hierarchy, roots)
    for root in roots:
        scene.add(nodes[root])
    _bind_skins(document, nodes)
    entries = {node: entry for entry, node in nodes.items()}
    for node in worth_checking(list(entries)):
        entries[node].apply(node.check)  # what a renderer would find, where it stands in the file
    scene.animations = read_animations(document, nodes)
    if not any(len(section.indices) for node in scene.nodes() if node.mesh for section in node.mesh.sections):
        document.warn("shows nothing, its scene has no mesh with triangles")
    return scene


class _Hierarchy:
    """Who is whose child (3.5.2). Raises SceneError for a node with two parents, or one that is its own ancestor."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._nodes = document.entries("nodes")
        self.children = {node: node.references("children", self._nodes) for node in self._nodes}
        self._parents: dict[Element, Element] = {}
        for node, children in self.children.items():
            for child in children:
                if child in self._parents:
                    first = self._parents[child].place()
                    raise child.fault(f"is a child twice, of {first} and {node.place()}")
                self._parents[child] = node
        tops = [node for node in self._nodes if node not in self._parents]
        reached = set(self.below(tops))
        for node in self._nodes:
            if node not in reached:
                raise node.fault("is its own ancestor, or below a node that is")

    def below(self, tops: list[Element]) -> list[Element]:
        """The nodes and all below them, parents first."""
        found = list(tops)
        for node in found:
            found += self.children[node]
        return found

    def shown(self) -> tuple[str, list[Element]]:
        """Name and root nodes of the scene to show."""
        scenes = self._document.entries("scenes")
        if "scene" in self._document.root:
            scene = self._document.root.reference("scene", scenes)
        elif scenes:
            scene = scenes[0]
        else:
            return "", [node for node in self._nodes if node not in self._parents]
        roots = scene.references("nodes", self._nodes)
        for index, root in enumerate(roots):
            if root in self._parents:
                parent = self._parents[root].place()
                raise scene.fault(f"{root.place()} is not a root, it is a child of {parent}", "nodes", index)
        if len(set(roots)) < len(roots):
            raise scene.fault("names a node twice", "nodes")
        return scene.name, roots


def _make_nodes(document: Document, hierarchy: _Hierarchy, roots: list[Element]) -> dict[Element, Node]:
    """The nodes and all below them, by what the file says of them."""
    lights, meshes = Lights(document), Meshes(document)
    entries = hierarchy.below(roots)
    document.take(document.root, "nodes", bytes=len(entries) * OBJECT_BYTES)
    nodes = {entry: _node(document, entry, lights, meshes) for entry in entries}
    _place(nodes)
    for entry, node in nodes.items():
        for child in hierarchy.children[entry]:
            node.add(nodes[child])
    return nodes


def _node(document: Document, entry: Element, lights: Lights, meshes: Meshes) -> Node:
    """A node with what stands there, but for its skin; it is not placed yet."""
    mesh = meshes.get(entry) if "mesh" in entry else None
    copies = _copies(document, entry) if entry.has_extension(_INSTANCING) else None
    if mesh is not None or copies is not None:
        meshes.count_placed(entry, mesh, 1 if copies is None else copies)
    node = entry.apply(
        Node,
        name=entry.name,
        mesh=mesh,
        light=lights.get(entry),
        camera=_camera(document, entry) if "camera" in entry else None,
        instances=None if copies is None else _instances(document, entry, copies),
        extras=entry.extras,
        **read_visibility(entry),
    )
    count = 0 if mesh is None else meshes.target_count(mesh)
    if mesh is not None and count:
        # 3.7.2.2: the node's weights, else the mesh's, else zeros
        given = entry.reference("mesh", document.entries("meshes"))
        default = given.numbers("weights", count, default=(0.0,) * count)
        weights = np.array(entry.numbers("weights", count, default=default))
        entry.apply(setattr, node, "weights", weights)
        document.take(entry, vertices=_vertex_count(mesh))
    return node


def _vertex_count(mesh: Mesh) -> int:
    return sum(len(section.positions) for section in mesh.sections)


def _place(nodes: dict[Element, Node]) -> None:
    """Put the nodes where the file says (3.5.3): all in one go, one by one it would take most of the time."""
    with_matrix = [entry for entry in nodes if "matrix" in entry]
    _set_transforms(with_matrix, nodes, _matrices(with_matrix))
    posed = [entry for entry in nodes if "matrix" not in entry]
    translations = _rows(posed, "translation", _NO_TRANSLATION)
    rotations = _rows(posed, "rotation", _NO_ROTATION)
    scales = _rows(posed, "scale", _NO_SCALE)
    for row in _zero_rotations(rotations):
        raise posed[row].fault(_NO_TURN, "rotation")
    _set_transforms(posed, nodes, compose(translations, rotations, scales))
    for entry, *pose in zip(posed, translations, rotations, scales, strict=True):
        nodes[entry].pose = Pose.of(*pose)


def _set_transforms(entries: list[Element], nodes: dict[Element, Node], matrices: NDArray[np.float64]) -> None:
    near = np.einsum("nij,nij->n", matrices, matrices) <= LARGEST  # so that none is too large
    for entry, matrix, fits in zip(entries, matrices, near.tolist(), strict=True):
        if fits:
            nodes[entry].place(matrix)
        else:
            entry.apply(setattr, nodes[entry], "transform", matrix)


def _matrices(entries: list[Element]) -> NDArray[np.float64]:
    """(entries, 4, 4) node to parent, of nodes that give it as a matrix."""
    values = [entry.numbers("matrix", 16) for entry in entries]
    matrices = np.array(values, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
    affine = np.isclose(matrices[:, 3], (0, 0, 0, 1), atol=1e-4).all(axis=1)
    for row in np.flatnonzero(~affine):
        raise entries[row].fault("its last row must be 0, 0, 0, 1", "matrix")
    matrices[:, 3] = (0, 0, 0, 1)
    return matrices


def _rows(entries: list[Element], key: str, default: tuple[float, ...]) -> NDArray[np.float64]:
    """(entries, components)"""
    values = [entry.numbers(key, len(default), default=default) for entry in entries]
    return np.array(values, np.float64).reshape(-1, len(default))


def _zero_rotations(rotations: NDArray[np.float64]) -> NDArray[np.intp]:
    """Which of the quaternions, (count, 4), are zero, and so no rotation."""
    return np.flatnonzero(np.linalg.norm(rotations, axis=1) == 0)


def _bind_skins(document: Document, nodes: dict[Element, Node]) -> None:
    """Give nodes their skins, once all joints hang in their tree."""
    skins: dict[Element, Skin] = {}
    bound: Counter[Skin] = Counter()
    for entry, node in nodes.items():
        if "skin" not in entry or node.mesh is None:
            continue
        element = entry.reference("skin", document.entries("skins"))
        if element not in skins:
            skins[element] = read_skin(document, element, nodes)
        skin = skins[element]
        bound[skin] += 1
        # Each link has a tuple of the nodes that it bends, which is made anew; nodes with weights are counted already.
        vertices = _vertex_count(node.mesh) if node.weights is None else 0
        document.take(entry, "skin", vertices=vertices, bytes=8 * len(skin.links) * bound[skin])
        bind(document, entry, node, skin)


def _copies(document: Document, entry: Element) -> int | None:
    """How many copies of its mesh a node shows (EXT_mesh_gpu_instancing); None where it does not say."""
    attributes = entry.extension(_INSTANCING).object("attributes")
    counts = {element_count(document, attributes, name) for name in _INSTANCE_DEFAULTS if name in attributes}
    if len(counts) > 1:
        raise attributes.fault(f"differ in count ({', '.join(map(str, sorted(counts)))})")
    return counts.pop() if counts else None


def _instances(document: Document, entry: Element, count: int) -> NDArray[np.float64]:
    """(count, 4, 4) copies relative to the node."""
    document.take(entry, bytes=count * _INSTANCE_BYTES)
    attributes = entry.extension(_INSTANCING).object("attributes")
    translation, rotation, scale = (
        read_floats(document, attributes, name, (f"VEC{len(default)}",)).astype(np.float64)
        if name in attributes
        else np.tile(default, (count, 1))
        for name, default in _INSTANCE_DEFAULTS.items()
    )
    if len(_zero_rotations(rotation)):
        raise attributes.fault(_NO_TURN, "ROTATION")
    return compose(translation, rotation, scale)


def _camera(document: Document, node: Element) -> Camera:
    """A node's camera (3.10); the node places it."""
    entry = node.reference("camera", document.entries("cameras"))
    kind = entry.choice("type", _CAMERAS)
    lens = entry.object(kind, required=True)
    name = entry.name or node.name
    near = lens.number("znear", low=0)
    if kind == _PERSPECTIVE:
        fov = lens.number("yfov", 0, math.pi)
        if not 0 < fov < math.pi or near == 0:
            raise lens.fault("yfov must lie between 0 and pi and znear above 0")
        return lens.apply(Camera, np.eye(4), vertical_fov=fov, near=near, name=name)
    far = lens.number("zfar", low=near, default=_ORTHOGRAPHIC_FAR)
    height = 2 * abs(lens.number("ymag"))
    if height == 0 or far == near:
        raise lens.fault("ymag must not be 0 and zfar must lie beyond znear")
    return lens.apply(Camera, np.eye(4), near=near, far=far, orthographic_height=height, name=name)
