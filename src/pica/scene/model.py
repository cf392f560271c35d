"""What there is to see: meshes, nodes and the scene that holds them. NumPy only, nothing of the GPU.

World matrices are float64, right-handed, +Y up, metres; column vectors: world = parent * local.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError
from pica.scene.animation import Animation, Pose, together
from pica.scene.camera import Camera
from pica.scene.changes import ChangeSet, Listeners
from pica.scene.channels import ALL_CHANNELS, checked_channels
from pica.scene.deformer import CameraFacing, Deformer
from pica.scene.environment import Environment
from pica.scene.light import Light
from pica.scene.material import Material
from pica.scene.primitives import Primitives
from pica.scene.skin import Skin, deformed_positions
from pica.scene.tracked_field import TrackedField

if TYPE_CHECKING:
    from pica.scene.landscape import Landscape


@dataclass(eq=False)
class Section:
    """A part of a mesh with one material (a glTF primitive): indexed triangles.

    Attributes that a file lacks are generated when it is loaded, so all are always there.
    """

    positions: NDArray[np.float32]
    """(vertices, 3) metres, object space."""
    normals: NDArray[np.float32]
    """(vertices, 3) unit length."""
    tangents: NDArray[np.float32]
    """(vertices, 4) unit length, w = sign of the bitangent cross(normal, tangent) (glTF 2.0, 3.7.2.1)."""
    uv0: NDArray[np.float32]
    """(vertices, 2) first texture coordinates, v down."""
    uv1: NDArray[np.float32]
    """(vertices, 2) second texture coordinates."""
    colors: NDArray[np.float32]
    """(vertices, 4) linear, multiplies the base colour."""
    indices: NDArray[np.uint32]
    """(triangles, 3), counter-clockwise from the front."""
    material: Material
    flat: bool = False
    """Normals are those of the triangles, which share no vertices; where those bend, normals follow their new faces."""
    joints: NDArray[np.uint16] | None = None
    """(vertices, k) which of the skin's joints a vertex follows; None: no skin can move it."""
    weights: NDArray[np.float32] | None = None
    """(vertices, k) how far it follows each: 0 or more, sums of 1."""
    morph_positions: NDArray[np.float32] | None = None
    """(targets, vertices, 3) metres, offsets that the node's weights scale and add; None: no morph targets."""
    morph_normals: NDArray[np.float32] | None = None
    """(targets, vertices, 3) offsets to the normals; None: they stay."""
    morph_tangents: NDArray[np.float32] | None = None
    """(targets, vertices, 3) offsets to the tangents' directions; None: they stay."""

    rows: NDArray[np.uint32] | None = None
    """(vertices,) which rows of a deformer's arrays the vertices take; None: no deformer has an array for them."""

    def take(self, vertices: NDArray[np.intp], indices: NDArray[np.uint32]) -> "Section":
        """The section with only the given vertices, (count,), in that order; `indices` (triangles, 3) count in them."""
        per_vertex = {name: getattr(self, name) for name in ("joints", "weights", "rows")}
        per_target = {name: getattr(self, name) for name in ("morph_positions", "morph_normals", "morph_tangents")}
        return replace(
            self,
            **{name: getattr(self, name)[vertices] for name in _ATTRIBUTES},
            **{name: values[vertices] for name, values in per_vertex.items() if values is not None},
            **{name: values[:, vertices] for name, values in per_target.items() if values is not None},
            indices=indices,
        )


_ATTRIBUTES = ("positions", "normals", "tangents", "uv0", "uv1", "colors")


@dataclass(eq=False)
class Mesh:
    """Sections and primitives that move together."""

    sections: list[Section] = field(default_factory=list)
    name: str = ""
    primitives: list[Primitives] = field(default_factory=list)
    """What is not made of triangles. A node whose mesh has any can be moved, but not skinned or morphed."""

    @property
    def target_count(self) -> int:
        """How many morph targets the sections have, all the same number."""
        targets = (section.morph_positions for section in self.sections)
        return max((len(positions) for positions in targets if positions is not None), default=0)


@dataclass(eq=False)
class Node:
    """A place in the world and what stands there. Set `transform` to move it with its children."""

    name: str = ""
    mesh: Mesh | None = None
    light: TrackedField[Light | None] = TrackedField(None)
    """Lights are immutable: set another one, such as `dataclasses.replace(node.light, intensity=3.0)`."""
    camera: Camera | None = None
    """Its own transform is ignored: the node's world matrix places it."""
    instances: NDArray[np.float64] | None = None
    """(count, 4, 4) copies of the mesh relative to this node (EXT_mesh_gpu_instancing); None: one, at the node."""
    extras: dict[str, object] = field(default_factory=dict)
    visible_to_camera: TrackedField[bool] = TrackedField(True)
    """Whether the camera sees the mesh. This and what follows is about the node's own mesh, not about its children."""
    visible_to_reflections: TrackedField[bool] = TrackedField(True)
    """Whether rays for reflected light meet it; if not, its emission lights nothing."""
    casts_shadows: TrackedField[bool] = TrackedField(True)
    """Whether it hides lights of its channels, and the environment."""
    lighting_channels: TrackedField[frozenset[int]] = TrackedField(ALL_CHANNELS, checked_channels)
    """Of 0 to 5: lights reach meshes in one of their channels, and these alone hide them. The mesh's own emission
    reaches those in one of its channels. SceneError for other numbers."""
    pose: Pose | None = None
    """What a file or an animation made `transform` from; None: a matrix, and animations cannot place the node."""
    detail: "Landscape | None" = None
    """What gives the meshes that the node shows to each camera instead of its own; set before it comes into a scene."""
    identities: NDArray[np.int64] | None = None
    """(count,) which thing each instance shows: where that changes, it has come, not moved. None: always the same."""
    children: list["Node"] = field(default_factory=list)
    parent: "Node | None" = field(default=None, repr=False)
    _transform: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    _world: NDArray[np.float64] | None = field(default=None, repr=False)
    _weights: NDArray[np.float64] | None = field(default=None, repr=False)
    _skin: Skin | None = field(default=None, repr=False)
    _deformer: Deformer | None = field(default=None, repr=False)
    _carried: "tuple[Node, ...]" = field(default=(), repr=False)
    """The skinned nodes that this one places, as their skin's root."""
    _bent: "tuple[Node, ...]" = field(default=(), repr=False)
    """The skinned nodes that this one deforms, as a link of their skin."""
    _listeners: Listeners | None = field(default=None, repr=False)

    @property
    def transform(self) -> NDArray[np.float64]:
        """(4, 4) this node to its parent. Assign a new matrix to move the node; do not write into it."""
        return self._transform

    @transform.setter
    def transform(self, matrix: ArrayLike) -> None:
        self._transform = np.array(matrix, np.float64).reshape(4, 4)
        for node in self.walk():
            node._world = None
            for listener in node._listeners or ():
                listener.moved[node] = None
                for skinned in node._carried:
                    listener.moved[skinned] = None
        for listener in self._listeners or () if self._bent else ():
            listener.deformed.update(dict.fromkeys(self._bent))

    @property
    def weights(self) -> NDArray[np.float64] | None:
        """(targets,) how far the mesh goes towards each morph target; None: the mesh as it is. Assign, do not write."""
        return self._weights

    @weights.setter
    def weights(self, weights: ArrayLike) -> None:
        values = np.array(weights, np.float64).reshape(-1)
        count = 0 if self.mesh is None else self.mesh.target_count
        if len(values) != count:
            raise SceneError(f"node {self.name!r}: {len(values)} weights for a mesh with {count} morph targets")
        self._weights = values
        self.tell_deformed()

    @property
    def skin(self) -> Skin | None:
        """The joints that the mesh follows; set it once."""
        return self._skin

    @skin.setter
    def skin(self, skin: Skin) -> None:
        self._skin = skin
        if skin.root is not None:
            skin.root._carried += (self,)
        for link in skin.links:
            link._bent += (self,)

    @property
    def deformer(self) -> Deformer | None:
        """What writes the mesh's vertices instead of a skin and weights; set it once, before the node is shown."""
        return self._deformer

    @deformer.setter
    def deformer(self, deformer: Deformer) -> None:
        if deformer.node is not None:
            raise SceneError(f"node {self.name!r}: its deformer belongs to node {deformer.node.name!r} already")
        self._deformer, deformer.node = deformer, self

    @property
    def deforms(self) -> bool:
        """Whether the mesh has a shape of its own at this node, by a skin, by weights or by a deformer."""
        own = self._skin is not None or self._weights is not None or self._deformer is not None
        return self.mesh is not None and own

    @property
    def follows_camera(self) -> bool:
        """Whether each view shows the node in its own way, by where its camera is."""
        return self.detail is not None or isinstance(self._deformer, CameraFacing)

    def tell_deformed(self) -> None:
        """The mesh's vertices are to be written anew."""
        for listener in self._listeners or ():
            listener.deformed[self] = None

    def show(self, mesh: Mesh | None) -> None:
        """Show another mesh from the next picture on."""
        self.mesh = mesh
        for listener in self._listeners or ():
            listener.remove(self)
            listener.add(self)

    def place_instances(self, instances: NDArray[np.float64], identities: NDArray[np.int64] | None = None) -> None:
        """Put the copies of the mesh elsewhere: `instances` and `identities` as above, as many as there were or not."""
        count = None if self.instances is None else len(self.instances)
        self.instances, self.identities = instances, identities
        if len(instances) != count:
            self.show(self.mesh)
        for listener in self._listeners or ():
            listener.moved[self] = None

    @property
    def world(self) -> NDArray[np.float64]:
        """(4, 4) this node to the world."""
        outdated: list[Node] = []
        above = self
        while above._world is None and above.parent is not None:  # a loop: files nest deeper than Python recurses
            outdated.append(above)
            above = above.parent
        world = above._transform if above._world is None else above._world
        above._world = world
        for node in reversed(outdated):
            node._world = world = world @ node._transform
        return world

    def add(self, child: "Node") -> "Node":
        """Make `child` a child of this node and return it."""
        child.parent = self
        self.children.append(child)
        for node in child.walk():
            node._world = None
            node._listeners = self._listeners
            for listener in self._listeners or ():
                listener.add(node)
        return child

    def walk(self) -> Iterator["Node"]:
        """This node and all below it, parents first."""
        stack = [self]
        while stack:
            node = stack.pop()
            yield node
            stack.extend(reversed(node.children))

    def instance_transforms(self) -> NDArray[np.float64]:
        """(count, 4, 4) object to world of every copy of the mesh; count is 1 without `instances`.

        The skin's root instead of the node itself places a skinned mesh.
        """
        world = self.world if self._skin is None else self._skin.world
        return world[None] if self.instances is None else world @ self.instances


class Scene:
    """Nodes and an environment. A renderer keeps a copy on the GPU and follows what moves."""

    def __init__(self, name: str = "", environment: Environment | None = None) -> None:
        self.name = name
        self.environment = environment
        self.roots: list[Node] = []
        self.animations: list[Animation] = []
        self._together: tuple[list[Animation], Animation] = ([], Animation([]))
        self._listeners = Listeners()

    def add(self, node: Node) -> Node:
        """Add a node without a parent, with all below it, and return it."""
        self.roots.append(node)
        for below in node.walk():
            below._listeners = self._listeners
            for listener in self._listeners:
                listener.add(below)
        return node

    def remove(self, node: Node) -> None:
        """Take a node out, with all below it. Raises SceneError when it is not in this scene."""
        siblings = self.roots if node.parent is None else node.parent.children
        if node._listeners is not self._listeners or node not in siblings:
            raise SceneError(f"remove: node {node.name!r} is not in the scene")
        siblings.remove(node)
        node.parent = None
        for below in node.walk():
            below._listeners = None
            for listener in self._listeners:
                listener.remove(below)

    def nodes(self) -> Iterator[Node]:
        """Every node, parents before children."""
        for root in self.roots:
            yield from root.walk()

    def animate(self, time: float, animation: int | str | None = None) -> None:
        """Move nodes and set weights to where an animation, by number or name, has them at `time` seconds.

        None: all at once; where two move the same thing, the later one does. An animation holds its ends: use
        `time % scene.animations[i].duration` for a loop. Raises SceneError when there is no such animation.
        """
        if not math.isfinite(time):
            raise SceneError(f"animate: time {time} is not a number of seconds")
        self._animation(animation).apply(time)

    def _animation(self, which: int | str | None) -> Animation:
        if which is None:
            if self._together[0] != self.animations:
                self._together = list(self.animations), together(self.animations)
            return self._together[1]
        for number, animation in enumerate(self.animations):
            if which in (number, animation.name):
                return animation
        known = ", ".join(f"{number} {animation.name!r}" for number, animation in enumerate(self.animations))
        raise SceneError(f"animate: no animation {which!r}; the scene has {known or 'none'}")

    def subscribe(self) -> ChangeSet:
        """A new record of moved and deformed nodes; kept up to date for as long as the caller holds it."""
        changes = ChangeSet()
        self._listeners.add(changes)
        return changes

    def cameras(self) -> list[Camera]:
        """The cameras in the scene, placed in the world; scale is dropped."""
        return [_placed(node.camera, node.world) for node in self.nodes() if node.camera is not None]

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the box round all meshes, (3,) each; a unit box when there are none."""
        boxes: dict[int, NDArray[np.float64]] = {}
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for node in self.nodes():
            if node.mesh is None:
                continue
            key = id(node if node.deforms else node.mesh)
            if key not in boxes:
                boxes[key] = _corners(node, node.mesh)
            corners = boxes[key]
            if not len(corners):
                continue
            world = node.instance_transforms()
            points = np.einsum("nij,pj->npi", world[:, :3, :3], corners) + world[:, None, :3, 3]
            low = np.minimum(low, points.min((0, 1), initial=np.inf))
            high = np.maximum(high, points.max((0, 1), initial=-np.inf))
        if not (low <= high).all():
            return np.full(3, -0.5), np.full(3, 0.5)
        return low, high

    def default_camera(self, aspect: float) -> Camera:
        """The file's first camera, or one that frames the whole scene; `aspect` is width over height."""
        cameras = self.cameras()
        return cameras[0] if cameras else Camera.framing(*self.bounds(), aspect)

    def triangle_count(self) -> int:
        """Triangles over all nodes and copies."""
        return sum(
            sum(len(section.indices) for section in node.mesh.sections) * len(node.instance_transforms())
            for node in self.nodes()
            if node.mesh is not None
        )


def _corners(node: Node, mesh: Mesh) -> NDArray[np.float64]:
    """(8, 3) corners of the box round what the node's mesh shows; (0, 3) when that is nothing."""
    used = [
        (deformed_positions(section, node) if node.deforms else section.positions)[np.unique(section.indices)]
        for section in mesh.sections
        if len(section.indices)
    ]
    used += [primitives.bounds.reshape(-1, 3) for primitives in mesh.primitives]
    if not sum(map(len, used)):
        return np.zeros((0, 3))
    points = np.concatenate(used).astype(np.float64)
    low, high = points.min(0), points.max(0)
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def _placed(camera: Camera, world: NDArray[np.float64]) -> Camera:
    rotation, _ = np.linalg.qr(world[:3, :3])
    rotation = rotation * np.sign(np.sum(rotation * world[:3, :3], axis=0))
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, world[:3, 3]
    return replace(camera, transform=transform)
