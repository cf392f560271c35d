"""What there is to see: meshes, nodes and the scene that holds them. NumPy only, nothing of the GPU.

World matrices are float64, right-handed, +Y up, metres; column vectors: world = parent * local.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, plain, shown
from pica.scene.animation import Animation, Pose, together
from pica.scene.arrays import affine, affines, doubles, integers
from pica.scene.camera import Camera
from pica.scene.changes import ChangeSet, Listeners
from pica.scene.channels import ALL_CHANNELS, checked_channels
from pica.scene.checked_field import CheckedField, described, fitting
from pica.scene.deformer import CameraFacing, Deformer
from pica.scene.environment import Environment
from pica.scene.light import WIDEST, Light, extent
from pica.scene.mesh import Mesh, Section
from pica.scene.skin import Skin, deformed_positions
from pica.scene.tracked_field import TrackedField
from pica.scene.values import LARGEST, UnfitError, checked, flag, instance, items, number, optional, text

if TYPE_CHECKING:
    from pica.scene.landscape import Landscape

__all__ = ["Mesh", "Node", "Scene", "Section"]

_WEIGHTS = doubles("targets")
_IDENTITIES = optional(integers(np.int64, "count"))
_FARTHEST = LARGEST**2


@dataclass(eq=False)
class Node:
    """A place in the world and what stands there. Set `transform` to move it with its children."""

    name: CheckedField[str] = CheckedField(text, "")
    mesh: CheckedField[Mesh | None] = CheckedField(optional(instance(Mesh)), None)
    light: TrackedField[Light | None] = TrackedField(optional(instance(*get_args(Light))), None)
    """Lights are immutable: set another one, such as `dataclasses.replace(node.light, intensity=3.0)`."""
    camera: CheckedField[Camera | None] = CheckedField(optional(instance(Camera)), None)
    """Its own transform is ignored: the node's world matrix places it."""
    instances: CheckedField[NDArray[np.float64] | None] = CheckedField(optional(affines), None)
    """(count, 4, 4) copies of the mesh relative to this node (EXT_mesh_gpu_instancing); None: one, at the node."""
    extras: dict[str, object] = field(default_factory=dict)
    visible_to_camera: TrackedField[bool] = TrackedField(flag, True)
    """Whether the camera sees the mesh. This and what follows is about the node's own mesh, not about its children."""
    visible_to_reflections: TrackedField[bool] = TrackedField(flag, True)
    """Whether rays for reflected light meet it; if not, its emission lights nothing."""
    casts_shadows: TrackedField[bool] = TrackedField(flag, True)
    """Whether it hides lights of its channels, and the environment."""
    lighting_channels: TrackedField[frozenset[int]] = TrackedField(checked_channels, ALL_CHANNELS)
    """Of 0 to 5: lights reach meshes in one of their channels, and these alone hide them. The mesh's own emission
    reaches those in one of its channels. SceneError for other numbers."""
    pose: CheckedField[Pose | None] = CheckedField(optional(instance(Pose)), None)
    """What a file or an animation made `transform` from; None: a matrix, and animations cannot place the node."""
    detail: "Landscape | None" = None
    """What gives the meshes that the node shows to each camera instead of its own; set before it comes into a scene."""
    identities: CheckedField[NDArray[np.int64] | None] = CheckedField(_IDENTITIES, None)
    """(count,) which thing each instance shows: where that changes, it has come, not moved. None: always the same."""
    children: list["Node"] = field(default_factory=list, init=False)
    """Do not write into it: `add` and Scene.remove do."""
    parent: "Node | None" = field(default=None, init=False, repr=False)
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
        """(4, 4) this node to its parent, last row 0, 0, 0, 1. Assign a new matrix, which is copied, to move the node;
        do not write into it. Raises SceneError for one that is not finite."""
        return self._transform

    @transform.setter
    def transform(self, matrix: ArrayLike) -> None:
        self._transform = fitting(self, "transform", affine, matrix)
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
        values = fitting(self, "weights", _WEIGHTS, weights)
        self._check_weights(values)
        self._weights = values.copy()
        self.tell_deformed()

    @property
    def skin(self) -> Skin | None:
        """The joints that the mesh follows; set it once."""
        return self._skin

    @skin.setter
    def skin(self, skin: Skin) -> None:
        if self._skin is not None:
            raise SceneError(f"{described(self)}: skin: it has one already")
        self._skin = fitting(self, "skin", instance(Skin), skin)
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
        fitting(self, "deformer", instance(Deformer), deformer)
        if self._deformer is not None:
            raise SceneError(f"{described(self)}: deformer: it has one already")
        if deformer.node is not None:
            raise SceneError(f"{described(self)}: its deformer belongs to {described(deformer.node)} already")
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
        placed = fitting(self, "instances", affines, instances)
        numbers = fitting(self, "identities", _IDENTITIES, identities)
        self._check_identities(placed, numbers)
        self.instances, self.identities = placed, numbers
        if len(placed) != count:
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
            node._world = world = world.dot(node._transform)  # unlike @ it has no words for what overflows: check does
        return world

    def add(self, child: "Node") -> "Node":
        """Make `child` a child of this node and return it. Raises SceneError for one that stands elsewhere already, and
        for this node or one above it."""
        below = _loose(child, self)
        if self in below:
            raise SceneError(f"{described(self)}: add: {described(child)} is this node, or above it")
        child.parent = self
        self.children.append(child)
        _enter(below, self._listeners)
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

    def check(self) -> None:
        """Raises SceneError when what stands here, the mesh's own arrays apart, cannot be shown as it is now."""
        world = self.world if self._skin is None else self._skin.world
        if not np.vdot(world, world) <= _FARTHEST:
            raise SceneError(f"{described(self)}: its place in the world is too large for 32-bit floats")
        if self.instances is not None:
            farthest = np.abs(self.instances).max(initial=0)
            if not farthest * np.abs(world).max() <= LARGEST / 4:
                with np.errstate(over="ignore", invalid="ignore"):
                    placed = world @ self.instances
                checked(f"{described(self)}: instances: in the world", affines, placed)
        self._check_identities(self.instances, self.identities)
        if self.light is not None and extent(self.light):
            scale = np.linalg.norm(world[:3, :3], axis=0).max()
            if not extent(self.light) * scale <= WIDEST:
                raise SceneError(f"{described(self)}: light: with the node's scale it is too large for 32-bit floats")
        if self.mesh is not None and self._weights is not None:
            self._check_weights(self._weights)
        if self.mesh is not None and self._skin is not None:
            for section in self.mesh.sections:
                joint = 0 if section.joints is None else int(section.joints.max(initial=0))
                if joint >= len(self._skin.joints):
                    fault = f"its mesh follows joint {joint} of {len(self._skin.joints)}"
                    raise SceneError(f"{described(self)}: skin: {fault}")

    def _check_weights(self, weights: NDArray[np.float64]) -> None:
        count = 0 if self.mesh is None else self.mesh.target_count
        if len(weights) != count:
            raise SceneError(f"{described(self)}: {len(weights)} weights for a mesh with {count} morph targets")

    def _check_identities(self, instances: NDArray[np.float64] | None, identities: NDArray[np.int64] | None) -> None:
        count = 1 if instances is None else len(instances)
        if identities is not None and len(identities) != count:
            raise SceneError(f"{described(self)}: identities: {len(identities)} for {count} instances")


def _loose(node: Node, above: "Node | Scene") -> list[Node]:
    """A node that is to come below another or into a scene, and all below it. Raises SceneError unless it is free."""
    if not isinstance(node, Node):
        raise SceneError(f"{described(above)}: add: {shown(node)} is not a Node")
    if node.parent is not None:
        fault = f"is below {described(node.parent)} already"
        raise SceneError(f"{described(above)}: add: {described(node)} {fault}; a node has one parent")
    if node._listeners is not None and node._listeners.in_use:
        raise SceneError(f"{described(above)}: add: {described(node)} is in a scene already; remove it there first")
    return list(node.walk())


def _enter(nodes: list[Node], listeners: Listeners | None) -> None:
    """Nodes that were free come into a scene, or below a node that is in none."""
    for node in nodes:
        node._world = None
        node._listeners = listeners
        for listener in listeners or ():
            listener.add(node)


class Scene:
    """Nodes and an environment. A renderer keeps a copy on the GPU and follows what moves."""

    name: CheckedField[str] = CheckedField(text, "")
    environment: CheckedField[Environment | None] = CheckedField(optional(instance(Environment)), None)

    def __init__(self, name: str = "", environment: Environment | None = None) -> None:
        self.name = name
        self.environment = environment
        self.roots: list[Node] = []
        """Do not write into it: `add` and `remove` do."""
        self.animations: list[Animation] = []
        self._together: tuple[list[Animation], Animation] = ([], Animation([]))
        self._listeners = Listeners(self)

    def add(self, node: Node) -> Node:
        """Add a node without a parent, with all below it, and return it. Raises SceneError for one that has a parent or
        is in a scene."""
        below = _loose(node, self)
        self.roots.append(node)
        _enter(below, self._listeners)
        return node

    def remove(self, node: Node) -> None:
        """Take a node out, with all below it. Raises SceneError when it is not in this scene."""
        if not isinstance(node, Node):
            raise SceneError(f"remove: {shown(node)} is not a Node")
        siblings = self.roots if node.parent is None else node.parent.children
        if node._listeners is not self._listeners or node not in siblings:
            raise SceneError(f"remove: {described(node)} is not in the scene")
        siblings.remove(node)
        node.parent = None
        for below in node.walk():
            below._world = None
            below._listeners = None
            for listener in self._listeners:
                listener.remove(below)

    def __contains__(self, node: Node) -> bool:
        return node._listeners is self._listeners

    def check(self) -> None:
        """Raises SceneError when something, the meshes' own arrays apart, cannot be shown as it is now."""
        if self.environment is not None:
            self.environment.check()
        for node in self.nodes():
            node.check()

    def nodes(self) -> Iterator[Node]:
        """Every node, parents before children."""
        for root in self.roots:
            yield from root.walk()

    def animate(self, time: float, animation: int | str | None = None) -> None:
        """Move nodes and set weights to where an animation, by number or name, has them at `time` seconds.

        None: all at once; where two move the same thing, the later one does. An animation holds its ends: use
        `time % scene.animations[i].duration` for a loop. Raises SceneError when there is no such animation.
        """
        try:
            seconds = number()(time)
        except UnfitError:
            raise SceneError(f"animate: time {shown(time)} is not a number of seconds") from None
        self._animation(plain(animation)).apply(seconds)

    def _animation(self, which: int | str | None) -> Animation:
        animations = fitting(self, "animations", items(Animation), self.animations)
        if which is None:
            if self._together[0] != animations:
                self._together = list(animations), together(animations)
            return self._together[1]
        for index, animation in enumerate(animations):
            if type(which) in (int, str) and which in (index, animation.name):
                return animation
        known = ", ".join(f"{index} {animation.name!r}" for index, animation in enumerate(animations))
        raise SceneError(f"animate: no animation {shown(which)}; the scene has {known or 'none'}")

    def subscribe(self) -> ChangeSet:
        """A new record of moved and deformed nodes; kept up to date for as long as the caller holds it."""
        changes = ChangeSet()
        self._listeners.add(changes)
        return changes

    def cameras(self) -> list[Camera]:
        """The cameras in the scene, placed in the world; scale is dropped."""
        return [_placed(node.camera, node.world) for node in self.nodes() if node.camera is not None]

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the box round all meshes, (3,) each; a unit box when there are none.

        Raises SceneError for a mesh that cannot be shown, or cannot where it stands.
        """
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
            if not np.abs(points).max(initial=0) <= LARGEST:
                raise SceneError(f"{described(node)}: its mesh is too large in the world for 32-bit floats")
            low = np.minimum(low, points.min((0, 1), initial=np.inf))
            high = np.maximum(high, points.max((0, 1), initial=-np.inf))
        if not (low <= high).all():
            return np.full(3, -0.5), np.full(3, 0.5)
        return low, high

    def default_camera(self, aspect: float) -> Camera:
        """The file's first camera, or one that frames the whole scene; `aspect` is width over height.

        Raises SceneError for a scene that cannot be shown.
        """
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
    """(8, 3) corners of the box round what the node's mesh shows; (0, 3) when that is nothing. Raises SceneError."""
    mesh.check()
    node.check()
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
    rotation = rotation * np.where(np.sum(rotation * world[:3, :3], axis=0) < 0, -1, 1)  # a scale of 0 has no sign
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, world[:3, 3]
    return replace(camera, transform=transform)
