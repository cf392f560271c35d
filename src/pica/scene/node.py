"""A transform in a scene with its content. NumPy only, without GPU code.

World matrices are float64, right-handed, +Y up, metres; column vectors: world = parent * local.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.scene.animation import Pose
from pica.scene.arrays import affine, affines, doubles, integers
from pica.scene.camera import Camera
from pica.scene.changes import Listeners
from pica.scene.channels import ALL_CHANNELS, checked_channels
from pica.scene.checked_field import CheckedField, described, fitting, read_only
from pica.scene.construction import FieldsOnly, fields_only
from pica.scene.deformer import CameraFacing, Deformer
from pica.scene.light import WIDEST, Light, extent
from pica.scene.mesh import Mesh
from pica.scene.skin import Skin
from pica.scene.tracked_field import TrackedField
from pica.scene.values import LARGEST, checked, flag, instance, optional, text

if TYPE_CHECKING:
    from pica.scene.landscape import Landscape
    from pica.scene.model import Scene


def _as_it_is(value: Any) -> Any:
    """Fields that only Landscape sets, which this module cannot import."""
    return value


_WEIGHTS = doubles("targets")
_IDENTITIES = optional(integers(np.int64, "count"))
_FARTHEST = LARGEST**2
_IN_PLACE = np.eye(4)
_IN_PLACE.setflags(write=False)


@fields_only
@dataclass(eq=False)
class Node(FieldsOnly):
    """A transform in the world with its content. Set `transform` to move it with its children.

    Assignments to fields are in the next picture. Arrays in fields are read-only.
    """

    name: CheckedField[str] = CheckedField(text, "")
    mesh: TrackedField[Mesh | None] = TrackedField(optional(instance(Mesh)), None)
    light: TrackedField[Light | None] = TrackedField(optional(instance(*get_args(Light))), None)
    """Lights are immutable: set another one, such as `dataclasses.replace(node.light, intensity=3.0)`."""
    camera: CheckedField[Camera | None] = CheckedField(optional(instance(Camera)), None)
    """Its own transform is ignored: the node's world matrix places it."""
    instances: TrackedField[NDArray[np.float64] | None] = TrackedField(optional(affines), None)
    """(count, 4, 4) copies of the mesh relative to this node (EXT_mesh_gpu_instancing); None: one, at the node."""
    extras: dict[str, object] = field(default_factory=dict)
    visible_to_camera: TrackedField[bool] = TrackedField(flag, True)
    """Whether the camera sees the mesh. This and the following fields concern the node's own mesh, not its children."""
    visible_to_reflections: TrackedField[bool] = TrackedField(flag, True)
    """Whether reflection rays hit it; otherwise its emission lights nothing."""
    casts_shadows: TrackedField[bool] = TrackedField(flag, True)
    """Whether it hides lights of its channels, and the environment."""
    lighting_channels: TrackedField[frozenset[int]] = TrackedField(checked_channels, ALL_CHANNELS)
    """Of 0 to 5: lights reach meshes in one of their channels, and only these occlude them. The mesh's own emission
    reaches those in one of its channels. SceneError for other numbers."""
    pose: TrackedField[Pose | None] = TrackedField(optional(instance(Pose)), None)
    """Translation, rotation and scale of `transform`; assign one to place the node. None: a plain matrix, which
    animations cannot change."""
    detail: TrackedField["Landscape | None"] = TrackedField(_as_it_is, None)
    """Provides the node's meshes for each camera, instead of its own."""
    identities: TrackedField[NDArray[np.int64] | None] = TrackedField(_IDENTITIES, None)
    """(count,) identity of each instance: a change means a new object, not a motion. None: constant."""
    _children: list["Node"] = field(default_factory=list, init=False, repr=False)
    _parent: "Node | None" = field(default=None, init=False, repr=False)
    _transform: NDArray[np.float64] = field(default_factory=lambda: _IN_PLACE)
    _world: NDArray[np.float64] | None = field(default=None, repr=False)
    _weights: NDArray[np.float64] | None = field(default=None, repr=False)
    _skin: Skin | None = field(default=None, repr=False)
    _deformer: Deformer | None = field(default=None, repr=False)
    _carried: "tuple[Node, ...]" = field(default=(), repr=False)
    """The skinned nodes that this one places, as their skin's root."""
    _bent: "tuple[Node, ...]" = field(default=(), repr=False)
    """The skinned nodes that this one deforms, as a link of their skin."""
    _listeners: Listeners | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.pose is not None and np.array_equal(self._transform, _IN_PLACE):
            self.place(self.pose.matrix())

    @property
    def children(self) -> tuple["Node", ...]:
        """The children, which move with this node: `add` adds one, Scene.remove removes one."""
        return tuple(self._children)

    @property
    def parent(self) -> "Node | None":
        """The node that this one is a child of."""
        return self._parent

    @property
    def transform(self) -> NDArray[np.float64]:
        """(4, 4) this node to its parent, last row 0, 0, 0, 1; read-only. Assign a new matrix, which is copied, to move
        the node. Raises SceneError for one that is not finite."""
        return self._transform

    @transform.setter
    def transform(self, matrix: ArrayLike) -> None:
        self.place(fitting(self, "transform", affine, matrix))

    def place(self, matrix: NDArray[np.float64], pose: Pose | None = None) -> None:
        """Set `transform` to a valid matrix that is not shared with writers, and `pose` to its components,
        if there are any."""
        if pose is not None:
            vars(self)["pose"] = pose
        matrix.setflags(write=False)
        self.__dict__["_transform"] = matrix  # past FieldsOnly: moving nodes are set in every frame
        for node in self.walk() if self._children else (self,):
            node.__dict__["_world"] = None
            for listener in node._listeners or ():
                listener.moved[node] = None
                for skinned in node._carried:
                    listener.moved[skinned] = None
        for listener in self._listeners or () if self._bent else ():
            listener.deformed.update(dict.fromkeys(self._bent))

    @property
    def weights(self) -> NDArray[np.float64] | None:
        """(targets,) weight of each morph target, read-only; None: undeformed."""
        return self._weights

    @weights.setter
    def weights(self, weights: ArrayLike) -> None:
        values = fitting(self, "weights", _WEIGHTS, weights)
        self._check_weights(values)
        deformed, self._weights = self.deforms, read_only(values.copy())
        if deformed:
            self.tell_deformed()
        else:
            self._show_anew()

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
        self._show_anew()

    @property
    def deformer(self) -> Deformer | None:
        """Writes the mesh's vertices instead of a skin and weights; can be set once."""
        return self._deformer

    @deformer.setter
    def deformer(self, deformer: Deformer) -> None:
        fitting(self, "deformer", instance(Deformer), deformer)
        if self._deformer is not None:
            raise SceneError(f"{described(self)}: deformer: it has one already")
        if deformer.node is not None:
            raise SceneError(f"{described(self)}: its deformer belongs to {described(deformer.node)} already")
        self._deformer, deformer.node = deformer, self
        self._show_anew()

    @property
    def deforms(self) -> bool:
        """Whether the mesh is deformed at this node, by a skin, by weights or by a deformer."""
        own = self._skin is not None or self._weights is not None or self._deformer is not None
        return own and self.mesh is not None

    @property
    def follows_camera(self) -> bool:
        """Whether each view has its own geometry of the node, by its camera."""
        return self.detail is not None or (self._deformer is not None and isinstance(self._deformer, CameraFacing))

    def tell_deformed(self) -> None:
        """Have the mesh's vertices rewritten."""
        for listener in self._listeners or ():
            listener.deformed[self] = None

    def show(self, mesh: Mesh | None) -> None:
        """Show a mesh from the next picture on, like assigning it, but without motion of vertices from the
        previous picture: the node counts as new."""
        self.mesh = mesh

    def place_instances(self, instances: NDArray[np.float64], identities: NDArray[np.int64] | None = None) -> None:
        """Put the copies of the mesh elsewhere: `instances` and `identities` as above, both at once, as many as there
        were or not."""
        placed = fitting(self, "instances", affines, instances)
        numbers = fitting(self, "identities", _IDENTITIES, identities)
        self._check_identities(placed, numbers)
        vars(self)["identities"] = read_only(numbers)
        self.instances = placed

    def _written(self, field: str, before: Any) -> None:
        """As tracked_field.Holder."""
        if field == "pose":
            if self.pose is not None and "_transform" in vars(self):  # which it has once it is made
                self.place(self.pose.matrix())
            return
        for listener in self._listeners or ():
            if field in ("mesh", "detail") or (field == "instances" and _count(self.instances) != _count(before)):
                listener.show_anew(self)
            elif field in ("instances", "identities"):
                listener.moved[self] = None
            else:
                listener.altered[self] = None

    def _show_anew(self) -> None:
        for listener in self._listeners or ():
            listener.show_anew(self)

    @property
    def world(self) -> NDArray[np.float64]:
        """(4, 4) this node to the world, read-only."""
        outdated: list[Node] = []
        above = self
        while above._world is None and above._parent is not None:  # a loop: files nest deeper than Python recurses
            outdated.append(above)
            above = above._parent
        world = above._transform if above._world is None else above._world
        above.__dict__["_world"] = world
        for node in reversed(outdated):
            world = world.dot(node._transform)  # unlike @ it does not warn of overflow: check does
            world.setflags(write=False)
            node.__dict__["_world"] = world
        return world

    def add(self, child: "Node") -> "Node":
        """Make `child` a child of this node and return it. Raises SceneError if it has a parent or scene already, and
        for this node or an ancestor."""
        below = loose(child, self)
        if self in below:
            raise SceneError(f"{described(self)}: add: {described(child)} is this node, or above it")
        child._parent = self
        self._children.append(child)
        enter(below, self._listeners)
        return child

    def __repr__(self) -> str:
        parts = [] if self.mesh is None else [f"mesh {shown(self.mesh.name)}"]
        parts += [type(item).__name__ for item in (self.light, self.camera) if item is not None]
        parts += [f"children {', '.join(shown(child.name) for child in self.children[:3])}"] if self.children else []
        parts += [f"and {len(self.children) - 3:,} more"] if len(self.children) > 3 else []
        return f"<pica.Node {shown(self.name)}: {', '.join(parts) or 'nothing'}>"

    def walk(self) -> Iterator["Node"]:
        """This node and all below it, parents first."""
        stack = [self]
        while stack:
            node = stack.pop()
            yield node
            stack.extend(reversed(node._children))

    def instance_transforms(self) -> NDArray[np.float64]:
        """(count, 4, 4) object to world of every copy of the mesh; count is 1 without `instances`.

        The skin's root instead of the node itself places a skinned mesh.
        """
        world = self.world if self._skin is None else self._skin.world
        return world[None] if self.instances is None else world @ self.instances

    @property
    def is_plain(self) -> bool:
        """Whether the node has at most a mesh, without instances or deformation."""
        return (
            self.light is None
            and self.instances is None
            and self.identities is None
            and self._weights is None
            and self._skin is None
        )

    def check(self) -> None:
        """Raises SceneError if the content, except for the mesh's own arrays, is invalid."""
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


def _count(instances: NDArray[np.float64] | None) -> int | None:
    return None if instances is None else len(instances)


def all_instance_transforms(nodes: list[Node]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Node.instance_transforms of nodes, (n, 4, 4), node by node; and their number for each."""
    each = [
        node.world if node.instances is None and node._skin is None else node.instance_transforms().reshape(-1, 4)
        for node in nodes
    ]
    counts = np.array([len(rows) for rows in each], np.int64) // 4
    return np.concatenate([*each, np.zeros((0, 4))]).reshape(-1, 4, 4), counts


def worth_checking(nodes: list[Node]) -> list[Node]:
    """Nodes whose `check` may fail, found in one batch: most nodes have just a mesh, not far away."""
    worlds = np.concatenate([*(node.world for node in nodes), np.zeros((0, 4))]).reshape(-1, 16)
    with np.errstate(over="ignore", invalid="ignore"):
        near = np.einsum("ij,ij->i", worlds, worlds) <= _FARTHEST
    return [node for node, stands_near in zip(nodes, near.tolist(), strict=True) if not (stands_near and node.is_plain)]


def loose(node: Node, above: "Node | Scene") -> list[Node]:
    """A node to be added, and its descendants. Raises SceneError unless it has no parent or scene."""
    if not isinstance(node, Node):
        raise SceneError(f"{described(above)}: add: {shown(node)} is not a Node")
    if node._parent is not None:
        fault = f"is below {described(node._parent)} already"
        raise SceneError(f"{described(above)}: add: {described(node)} {fault}; a node has one parent")
    if node._listeners is not None and node._listeners.in_use:
        raise SceneError(f"{described(above)}: add: {described(node)} is in a scene already; remove it there first")
    return list(node.walk()) if node._children else [node]


def enter(nodes: list[Node], listeners: Listeners | None) -> None:
    """Add nodes to a scene, or below a node that is in none."""
    subscribers = list(listeners or ())
    for node in nodes:
        node._world = None
        node._listeners = listeners
        for listener in subscribers:
            listener.add(node)
