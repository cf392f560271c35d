"""Nodes: the hierarchy, and the content of each (3.5)."""

from collections import Counter
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import Pose, compose
from pica.scene.construction import unchecked_constructor
from pica.scene.gltf import columns
from pica.scene.gltf.accessors import element_count, read_floats, read_matrices
from pica.scene.gltf.animations import read_animations
from pica.scene.gltf.cameras import read_camera
from pica.scene.gltf.container import Document
from pica.scene.gltf.deformation import bind, read_skin
from pica.scene.gltf.element import Element
from pica.scene.gltf.environments import read_background, read_environment
from pica.scene.gltf.lights import Lights, read_visibility
from pica.scene.gltf.materials import Materials
from pica.scene.gltf.meshes import Meshes
from pica.scene.gltf.pointers import VISIBLE, parsed
from pica.scene.gltf.variants import Variants
from pica.scene.limits import OBJECT_BYTES
from pica.scene.model import Mesh, Node, Scene
from pica.scene.node import worth_checking
from pica.scene.skin import Skin
from pica.scene.values import LARGEST

_INSTANCING, _VISIBILITY = "EXT_mesh_gpu_instancing", "KHR_node_visibility"
_NO_TRANSLATION, _NO_ROTATION, _NO_SCALE = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0)
_INSTANCE_DEFAULTS = {"TRANSLATION": _NO_TRANSLATION, "ROTATION": _NO_ROTATION, "SCALE": _NO_SCALE}
_PLAIN = {"name", "mesh", "children", "extras", "matrix", "translation", "rotation", "scale"}
"""The keys of nodes that at most show a mesh, as nearly all of a large file do."""
_plain_node = unchecked_constructor(Node)

_INSTANCE_BYTES = 400
"""Memory for composing a matrix."""

_NO_TURN = "a quaternion of zeros is no rotation"


def build_scene(document: Document) -> Scene:
    """The file's default scene, else its first, else all root nodes. Raises SceneError."""
    hierarchy = _Hierarchy(document)
    name, roots = hierarchy.shown()
    scene = Scene(name, read_environment(document, hierarchy.scene))
    scene.background = read_background(document, hierarchy.scene)
    scene.variants = Variants(document).names
    made = _make_nodes(document, hierarchy, roots)
    nodes = made.nodes
    for root in roots:
        scene.add(nodes[root])
    _bind_skins(document, made)
    far = _place_in_world(made, hierarchy)
    entries = {nodes[entry]: entry for entry in dict.fromkeys([*made.special, *far])}
    for node in worth_checking(list(entries)):
        entries[node].apply(node.check)  # a renderer's checks, with the place in the file
    scene.animations = read_animations(document, nodes, made.hidden, made.materials)
    if not any(len(section.indices) for node in scene.nodes() if node.mesh for section in node.mesh.sections):
        document.warn("shows nothing, its scene has no mesh with triangles")
    return scene


class _Hierarchy:
    """Parents and children (3.5.2). Raises SceneError for a node with two parents, or one that is its own ancestor."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._nodes = document.entries("nodes")
        self.children = {
            node: node.references("children", self._nodes) for node in self._nodes if "children" in node.values
        }
        self._parents: dict[Element, Element] = {}
        for node, children in self.children.items():
            for child in children:
                if child in self._parents:
                    first = self._parents[child].place()
                    raise child.fault(f"is a child twice, of {first} and {node.place()}")
                self._parents[child] = node
        tops = [node for node in self._nodes if node not in self._parents]
        reached = self.below(tops)
        if len(reached) < len(self._nodes):
            reachable = set(reached)
            lost = next(node for node in self._nodes if node not in reachable)
            raise lost.fault("is its own ancestor, or below a node that is")

    def below(self, tops: list[Element]) -> list[Element]:
        """The nodes and all below them, parents first."""
        order = list(tops)
        for node in order:
            if node in self.children:
                order += self.children[node]
        return order

    @cached_property
    def scene(self) -> Element | None:
        """The scene to show, if the file has any."""
        scenes = self._document.entries("scenes")
        if "scene" in self._document.root:
            return self._document.root.reference("scene", scenes)
        return scenes[0] if scenes else None

    def shown(self) -> tuple[str, list[Element]]:
        """Name and root nodes of the scene to show."""
        scene = self.scene
        if scene is None:
            return "", [node for node in self._nodes if node not in self._parents]
        roots = scene.references("nodes", self._nodes)
        for index, root in enumerate(roots):
            if root in self._parents:
                parent = self._parents[root].place()
                raise scene.fault(f"{root.place()} is not a root, it is a child of {parent}", "nodes", index)
        if len(set(roots)) < len(roots):
            raise scene.fault("names a node twice", "nodes")
        return scene.name, roots


class _MadeNodes(NamedTuple):
    """The nodes of a scene."""

    nodes: dict[Element, Node]
    """By their indices in the file, parents first."""
    special: list[Element]
    """Nodes with more than a rigid mesh."""
    transforms: NDArray[np.float64]
    """(nodes, 4, 4) node to parent."""
    hidden: set[Element]
    """Nodes without mesh and light, of KHR_node_visibility."""
    materials: Materials


def _make_nodes(document: Document, hierarchy: _Hierarchy, roots: list[Element]) -> _MadeNodes:
    """The nodes and all below them, each where it is relative to its parent."""
    lights, meshes = Lights(document), Meshes(document)
    entries = hierarchy.below(roots)
    document.take(document.root, "nodes", bytes=len(entries) * OBJECT_BYTES)
    transforms, poses = _places(entries)
    transforms.setflags(write=False)
    near = np.einsum("nij,nij->n", transforms, transforms) <= LARGEST  # so that none is too large
    hidden = _hidden(document, hierarchy, entries)
    if any("mesh" in entry for entry in entries):
        meshes.expect(entry for entry in entries if entry not in hidden)
    nodes: dict[Element, Node] = {}
    special: list[Element] = []
    copies: Counter[Mesh | None] = Counter()
    still: dict[Any, Mesh | None] = {None: None}
    """Meshes without morph targets, by their indices."""
    for entry, matrix, pose, fits in zip(entries, transforms, poses, near.tolist(), strict=True):
        values, extras = entry.values, entry.extras
        index = values.get("mesh")
        if entry in hidden:
            nodes[entry] = node = _invisible(document, entry)
            entry.apply(setattr, node, "transform", matrix)
            node.place(node.transform, pose)
            special.append(entry)
            continue
        if index is not None and (type(index) is not int or index not in still):
            candidate = meshes.get(entry)
            if not meshes.target_count(candidate):
                still[index] = candidate
        if fits and index in still and values.keys() <= _PLAIN and "pica" not in extras:
            mesh = still[index]
            nodes[entry] = _plain_node(
                name=entry.name, mesh=mesh, pose=pose, extras=extras, _transform=matrix
            )  # fmt: skip
            copies[mesh] += 1
        else:
            nodes[entry] = node = _node(document, entry, lights, meshes)
            entry.apply(setattr, node, "transform", matrix)
            node.place(node.transform, pose)
            special.append(entry)
    meshes.complete()
    for mesh, count in copies.items():
        if mesh is not None:
            meshes.count_shown(mesh, count)
    for entry, children in hierarchy.children.items():
        if entry in nodes:
            node = nodes[entry]
            node._children = [nodes[child] for child in children]
            for child in node._children:
                child._parent = node
    return _MadeNodes(nodes, special, transforms, hidden, meshes.materials)


def _hidden(document: Document, hierarchy: _Hierarchy, entries: list[Element]) -> set[Element]:
    """The nodes that KHR_node_visibility hides at all times, with all below them."""
    places = [parsed(pointer) for pointer in document.animated_pointers if pointer.endswith(VISIBLE)]
    rows = {place.row for place in places if place is not None}
    moved = {entry for row, entry in enumerate(document.entries("nodes")) if row in rows} if rows else set()
    tops = [
        entry
        for entry in entries
        if "extensions" in entry
        and not entry.extension(_VISIBILITY).flag("visible", default=True)
        and entry not in moved
    ]
    return set(hierarchy.below(tops)) if tops else set()


def _invisible(document: Document, entry: Element) -> Node:
    """A node of which nothing is shown; it may still move others, or hold a camera."""
    camera = read_camera(document, entry) if "camera" in entry else None
    return entry.apply(Node, name=entry.name, camera=camera, extras=entry.extras)


def _node(document: Document, entry: Element, lights: Lights, meshes: Meshes) -> Node:
    """A node with its content, except for its skin and transform."""
    mesh = meshes.get(entry) if "mesh" in entry else None
    copies = _copies(document, entry)
    if mesh is not None or copies is not None:
        meshes.count_placed(entry, mesh, 1 if copies is None else copies)
    node = entry.apply(
        Node,
        name=entry.name,
        mesh=mesh,
        light=lights.get(entry),
        camera=read_camera(document, entry) if "camera" in entry else None,
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


def _places(entries: list[Element]) -> tuple[NDArray[np.float64], list[Pose | None]]:
    """Transforms of nodes (3.5.3): (nodes, 4, 4) relative to their parents, and their components.

    Computed together: one by one it would take most of the time.
    """
    has_matrix = np.array(["matrix" in entry for entry in entries], bool)
    posed = [entry for entry, has in zip(entries, has_matrix.tolist(), strict=True) if not has]
    translations = columns.numbers(posed, "translation", 3, _NO_TRANSLATION)
    rotations = columns.numbers(posed, "rotation", 4, _NO_ROTATION)
    scales = columns.numbers(posed, "scale", 3, _NO_SCALE)
    for row in _zero_rotations(rotations):
        raise posed[row].fault(_NO_TURN, "rotation")
    transforms = np.empty((len(entries), 4, 4))
    transforms[has_matrix] = _matrices([entry for entry in entries if "matrix" in entry])
    transforms[~has_matrix] = compose(translations, rotations, scales)
    poses = map(Pose.of, translations, rotations, scales)
    return transforms, [None if has else next(poses) for has in has_matrix.tolist()]


def _place_in_world(made: _MadeNodes, hierarchy: _Hierarchy) -> list[Element]:
    """Compute the nodes' world matrices, level by level. Returns those that may be too far away."""
    entries = list(made.nodes)
    rows = {entry: row for row, entry in enumerate(entries)}
    parents = np.full(len(entries), -1)
    for entry, children in hierarchy.children.items():
        if entry in rows:
            parents[[rows[child] for child in children]] = rows[entry]
    worlds = made.transforms.copy()
    start, end = 0, int(np.count_nonzero(parents < 0))
    with np.errstate(over="ignore", invalid="ignore"):
        while end < len(entries):
            start, end = end, int(np.searchsorted(parents, end))
            worlds[start:end] = worlds[parents[start:end]] @ worlds[start:end]
        near = np.einsum("nij,nij->n", worlds, worlds) <= LARGEST
    worlds.setflags(write=False)
    for node, world in zip(made.nodes.values(), worlds, strict=True):
        node._world = world
    return [entries[row] for row in np.flatnonzero(~near)]


def _matrices(entries: list[Element]) -> NDArray[np.float64]:
    """(entries, 4, 4) node to parent, of nodes with a matrix."""
    matrices = columns.numbers(entries, "matrix", 16).reshape(-1, 4, 4).transpose(0, 2, 1)
    affine = np.isclose(matrices[:, 3], (0, 0, 0, 1), atol=1e-4).all(axis=1)
    for row in np.flatnonzero(~affine):
        raise entries[row].fault("its last row must be 0, 0, 0, 1", "matrix")
    matrices[:, 3] = (0, 0, 0, 1)
    return matrices


def _zero_rotations(rotations: NDArray[np.float64]) -> NDArray[np.intp]:
    """Which of the quaternions, (count, 4), are zero, and so no rotation."""
    return np.flatnonzero(np.linalg.norm(rotations, axis=1) == 0)


def _bind_skins(document: Document, made: _MadeNodes) -> None:
    """Bind skins once all joints are in their tree."""
    nodes = made.nodes
    skins: dict[Element, Skin] = {}
    bound: Counter[Skin] = Counter()
    for entry in made.special:
        node = nodes[entry]
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
    """Number of instances of a node (EXT_mesh_gpu_instancing, or matrices of its extras); None if it has none."""
    if "instances" in entry.pica:
        return element_count(document, entry.pica, "instances")
    attributes = entry.extension(_INSTANCING).object("attributes")
    counts = {element_count(document, attributes, name) for name in _INSTANCE_DEFAULTS if name in attributes}
    if len(counts) > 1:
        raise attributes.fault(f"differ in count ({', '.join(map(str, sorted(counts)))})")
    return counts.pop() if counts else None


def _instances(document: Document, entry: Element, count: int) -> NDArray[np.float64]:
    """(count, 4, 4) copies relative to the node."""
    document.take(entry, bytes=count * _INSTANCE_BYTES)
    if "instances" in entry.pica:
        return read_matrices(document, entry.pica, "instances")
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
