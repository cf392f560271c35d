"""Nodes: the hierarchy, and what stands at each place (3.5)."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.animation import Pose, compose
from pica.scene.camera import Camera
from pica.scene.gltf.accessors import read_floats
from pica.scene.gltf.animations import read_animations
from pica.scene.gltf.checks import choice, extension, listing, mapping, number, numbers, text
from pica.scene.gltf.container import Document
from pica.scene.gltf.deformation import bind, read_skin, target_count
from pica.scene.gltf.lights import read_light, read_visibility
from pica.scene.gltf.meshes import Meshes
from pica.scene.model import Node, Scene
from pica.scene.skin import Skin

_PERSPECTIVE, _ORTHOGRAPHIC = "perspective", "orthographic"
_CAMERAS = {kind: kind for kind in (_PERSPECTIVE, _ORTHOGRAPHIC)}
_ORTHOGRAPHIC_FAR = 1e4
_INSTANCE_DEFAULTS = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}


def build_scene(document: Document) -> Scene:
    """The file's default scene, else its first, else all nodes without a parent. Raises SceneError."""
    parents = _parents(document)
    name, roots = _roots(document, parents)
    scene = Scene(name)
    builder = _Builder(document)
    for root in roots:
        scene.add(builder.tree(root))
    builder.bind_skins()
    scene.animations = read_animations(document, builder.nodes)
    if not scene.triangle_count():
        document.warn("shows nothing, its scene has no mesh with triangles")
    return scene


class _Builder:
    def __init__(self, document: Document) -> None:
        self.nodes: dict[int, Node] = {}
        """What was made, by number in the file."""
        self._document = document
        self._meshes = Meshes(document)

    def tree(self, root: int) -> Node:
        """Node `root` with all below it. The hierarchy was found free of cycles."""
        top = self._node(root)
        stack = [(root, top)]
        while stack:
            index, node = stack.pop()
            for child in _children(self._document, index):
                stack.append((child, node.add(self._node(child))))
        return top

    def _node(self, index: int) -> Node:
        entry, where = self._document.gltf.nodes[index], f"nodes[{index}]"
        node = Node(
            name=text(entry.name),
            mesh=None if entry.mesh is None else self._meshes.get(entry.mesh, where),
            light=read_light(self._document, entry, where),
            camera=None if entry.camera is None else _camera(self._document, entry.camera, text(entry.name), where),
            instances=_instances(self._document, entry, where),
            extras=mapping(entry.extras, f"{where}.extras"),
            **read_visibility(entry, where),
        )
        if entry.matrix is not None:
            node.transform = _matrix(entry, where)
        else:
            node.pose = _pose(entry, where)
            node.transform = node.pose.matrix()
        if entry.mesh is not None:
            self._set_weights(node, index, entry.mesh)
        self.nodes[index] = node
        return node

    def _set_weights(self, node: Node, index: int, mesh: int) -> None:
        """The node's weights, else the mesh's, else zeros (3.7.2.2)."""
        count = target_count(self._document, mesh)
        if not count or node.mesh is None or not node.mesh.sections:
            return
        zeros = (0.0,) * count
        # from the JSON as it is: pygltflib drops a node's weights
        of_node = self._document.json["nodes"][index].get("weights")
        of_mesh = self._document.gltf.meshes[mesh].weights or None
        default = numbers(of_mesh, count, f"meshes[{mesh}].weights", default=zeros)
        node.weights = np.array(numbers(of_node, count, f"nodes[{index}].weights", default=default))

    def bind_skins(self) -> None:
        """Give nodes their skins, once all joints hang in their tree."""
        skins: dict[int, Skin] = {}
        for index, node in self.nodes.items():
            number, where = self._document.gltf.nodes[index].skin, f"nodes[{index}]"
            if number is None or node.mesh is None:
                continue
            if number not in skins:
                skins[number] = read_skin(self._document, number, self.nodes, f"{where}.skin")
            bind(self._document, node, skins[number], where)


def _children(document: Document, index: int) -> list[int]:
    return listing(document.gltf.nodes[index].children, f"nodes[{index}].children")


def _parents(document: Document) -> list[int | None]:
    """The parent of every node. Raises SceneError for a node with two, or one that is its own ancestor (3.5.2)."""
    count = len(listing(document.gltf.nodes, "nodes"))
    parents: list[int | None] = [None] * count
    for index in range(count):
        for child in _children(document, index):
            document.item("nodes", child, f"nodes[{index}].children")
            if parents[child] is not None:
                raise SceneError(f"nodes[{child}]: is a child twice, of nodes[{parents[child]}] and nodes[{index}]")
            parents[child] = index
    stack = [index for index in range(count) if parents[index] is None]
    unreached = set(range(count))
    while stack:
        index = stack.pop()
        unreached.discard(index)
        stack.extend(_children(document, index))
    if unreached:
        raise SceneError(f"nodes[{min(unreached)}]: is its own ancestor, or below a node that is")
    return parents


def _roots(document: Document, parents: list[int | None]) -> tuple[str, list[int]]:
    """Name and root nodes of the scene to show."""
    gltf = document.gltf
    if gltf.scene is None and not listing(gltf.scenes, "scenes"):
        return "", [index for index, parent in enumerate(parents) if parent is None]
    index = 0 if gltf.scene is None else gltf.scene
    entry, where = document.item("scenes", index, "scene"), f"scenes[{index}].nodes"
    roots: list[int] = listing(entry.nodes, where)
    for root in roots:
        document.item("nodes", root, where)
        if parents[root] is not None:
            raise SceneError(f"{where}: nodes[{root}] is not a root, it is a child of nodes[{parents[root]}]")
    if len(set(roots)) < len(roots):
        raise SceneError(f"{where}: names a node twice")
    return text(entry.name), roots


def _matrix(entry: Any, where: str) -> NDArray[np.float64]:
    """(4, 4) node to parent, of a node that gives it as a matrix (3.5.3)."""
    matrix = np.array(numbers(entry.matrix, 16, f"{where}.matrix")).reshape(4, 4).T
    if not np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-4):
        raise SceneError(f"{where}.matrix: its last row must be 0, 0, 0, 1")
    return matrix


def _pose(entry: Any, where: str) -> Pose:
    """Node to parent, of a node that gives it in parts, or not at all."""
    translation = numbers(entry.translation, 3, f"{where}.translation", default=(0.0, 0.0, 0.0))
    rotation = numbers(entry.rotation, 4, f"{where}.rotation", default=(0.0, 0.0, 0.0, 1.0))
    scale = numbers(entry.scale, 3, f"{where}.scale", default=(1.0, 1.0, 1.0))
    _check_rotations(np.array([rotation]), f"{where}.rotation")
    return Pose(np.array(translation), np.array(rotation), np.array(scale))


def _check_rotations(rotations: NDArray[np.float64], where: str) -> None:
    if not (np.linalg.norm(rotations, axis=1) > 0).all():
        raise SceneError(f"{where}: a quaternion of zeros is no rotation")


def _instances(document: Document, entry: Any, where: str) -> NDArray[np.float64] | None:
    """(count, 4, 4) copies relative to the node (EXT_mesh_gpu_instancing)."""
    instancing = extension(entry, "EXT_mesh_gpu_instancing", where)
    if instancing is None:
        return None
    where = f"{where}.extensions.EXT_mesh_gpu_instancing"
    accessors = mapping(instancing.get("attributes"), f"{where}.attributes")
    given = {
        name: read_floats(document, accessors[name], f"{where}.{name}", (f"VEC{len(default)}",)).astype(np.float64)
        for name, default in _INSTANCE_DEFAULTS.items()
        if name in accessors
    }
    counts = {len(values) for values in given.values()}
    if not counts:
        return None
    if len(counts) > 1:
        raise SceneError(f"{where}: attributes differ in count ({', '.join(map(str, sorted(counts)))})")
    count = counts.pop()
    translation, rotation, scale = (
        given.get(name, np.tile(default, (count, 1))) for name, default in _INSTANCE_DEFAULTS.items()
    )
    _check_rotations(rotation, f"{where}.ROTATION")
    return compose(translation, rotation, scale)


def _camera(document: Document, index: int, node_name: str, where: str) -> Camera:
    """A camera (3.10); the node places it."""
    entry = document.item("cameras", index, where)
    where = f"cameras[{index}]"
    kind = choice(entry.type, f"{where}.type", _CAMERAS)
    lens = getattr(entry, kind)
    where = f"{where}.{kind}"
    if lens is None:
        raise SceneError(f"{where}: is missing")
    name = text(entry.name) or node_name
    near = number(lens.znear, f"{where}.znear", low=0)
    if kind == _PERSPECTIVE:
        fov = number(lens.yfov, f"{where}.yfov", 0, math.pi)
        if not 0 < fov < math.pi or near == 0:
            raise SceneError(f"{where}: yfov must lie between 0 and pi and znear above 0")
        return Camera(np.eye(4), vertical_fov=fov, near=near, name=name)
    far = number(lens.zfar, f"{where}.zfar", low=near, default=_ORTHOGRAPHIC_FAR)
    height = 2 * abs(number(lens.ymag, f"{where}.ymag"))
    if height == 0 or far == near:
        raise SceneError(f"{where}: ymag must not be 0 and zfar must lie beyond znear")
    return Camera(np.eye(4), near=near, far=far, orthographic_height=height, name=name)
