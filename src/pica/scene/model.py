"""The scene: meshes, nodes and the environment. NumPy only, without GPU code."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError, plain, shown
from pica.scene.animation import Animation, together
from pica.scene.camera import Camera
from pica.scene.changes import ChangeSet, Listeners
from pica.scene.checked_field import CheckedField, described, fitting
from pica.scene.construction import FieldsOnly
from pica.scene.environment import Environment
from pica.scene.extents import framed, subject_box, whole_box
from pica.scene.light import Color
from pica.scene.mesh import Mesh, Section
from pica.scene.node import Node, enter, loose, worth_checking
from pica.scene.source import Source
from pica.scene.tracked_field import TrackedField
from pica.scene.values import BRIGHTEST, UnfitError, instance, items, number, optional, text, vector

__all__ = ["Mesh", "Node", "Scene", "Section"]


_COLOR = vector(3, 0, BRIGHTEST)


def _background(value: Any) -> Color | Environment:
    if isinstance(value, Environment):
        return value
    red, green, blue = _COLOR(value)
    return red, green, blue


class Scene(FieldsOnly):
    """Nodes and an environment. A renderer keeps a copy on the GPU and tracks assignments to all fields of the scene,
    its nodes and their content; data that is not tracked is read-only."""

    name: CheckedField[str] = CheckedField(text, "")
    environment: TrackedField[Environment | None] = TrackedField(optional(instance(Environment)), None)
    """Environments are immutable: set another one, such as `dataclasses.replace(scene.environment, strength=2.0)`."""
    background: TrackedField[Color | Environment | None] = TrackedField(optional(_background), None)
    """Radiance of pixels without a surface, which gives no light: a colour, linear Rec. 709, nits, or an environment,
    such as `scene.environment.blurred(0.2)`; None: that of the environment."""

    animations: list[Animation]
    variants: tuple[str, ...]
    """Names of the file's KHR_materials_variants, for pica.load."""
    source: Source | None
    """What the file says of itself, such as its copyright, which `save` keeps; None for scenes made in code."""

    def __init__(self, name: str = "", environment: Environment | None = None) -> None:
        self._listeners = Listeners(self)
        self._origin = object()
        self.name = name
        self.environment = environment
        self.background = None
        self._roots: list[Node] = []
        self.animations = []
        self.variants = ()
        self.source = None
        self._together: tuple[tuple[Animation, ...], Animation] = ((), Animation([]))

    @property
    def origin(self) -> object:
        """The same for the copies of SceneViews, which share arrays."""
        return self._origin

    @property
    def roots(self) -> tuple[Node, ...]:
        """The root nodes: `add` adds one, `remove` removes one."""
        return tuple(self._roots)

    def add(self, node: Node) -> Node:
        """Add a node without a parent, with all below it, and return it. Raises SceneError for one that has a parent or
        is in a scene."""
        below = loose(node, self)
        self._roots.append(node)
        enter(below, self._listeners)
        return node

    def remove(self, node: Node) -> None:
        """Remove a node, with its descendants. Raises SceneError if it is not in this scene."""
        if not isinstance(node, Node):
            raise SceneError(f"remove: {shown(node)} is not a Node")
        siblings = self._roots if node._parent is None else node._parent._children
        if node._listeners is not self._listeners or node not in siblings:
            raise SceneError(f"remove: {described(node)} is not in the scene")
        siblings.remove(node)
        node._parent = None
        for below in node.walk():
            below._world = None
            below._listeners = None
            for listener in self._listeners:
                listener.remove(below)

    def __repr__(self) -> str:
        nodes = list(self.nodes())
        counts = {
            "node": len(nodes),
            "triangle": self.triangle_count(),
            "light": sum(node.light is not None for node in nodes),
            "camera": sum(node.camera is not None for node in nodes),
            "animation": len(self.animations),
        }
        parts = [f"{count:,} {what}{'s' * (count != 1)}" for what, count in counts.items() if count or what == "node"]
        if self.environment is not None:
            height, width, _ = self.environment.radiance.shape
            parts.append(f"environment {width}x{height}")
        return f"<pica.Scene {shown(self.name)}: {', '.join(parts)}>"

    def __contains__(self, node: Node) -> bool:
        return node._listeners is self._listeners

    def _written(self, field: str, before: Any) -> None:
        """As tracked_field.Holder."""
        for listener in self._listeners:
            listener.edited[self] = None

    def check(self) -> None:
        """Raises SceneError if the content, except for the meshes' own arrays, is invalid."""
        if self.environment is not None:
            self.environment.check()
        if isinstance(self.background, Environment):
            self.background.check()
        for node in worth_checking(list(self.nodes())):
            node.check()

    def nodes(self) -> Iterator[Node]:
        """Every node, parents before children."""
        for root in self._roots:
            if root._children:
                yield from root.walk()
            else:
                yield root

    def animate(self, time: float, animation: int | str | None = None) -> None:
        """Set nodes and weights to the state of an animation, by number or name, at `time` seconds.

        None: all at once; if two set the same property, the later one wins. The first and last state are held: use
        `time % scene.animations[i].duration` for a loop. Raises SceneError if there is no such animation.
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
                self._together = animations, together(list(animations))
            return self._together[1]
        for index, animation in enumerate(animations):
            if type(which) in (int, str) and which in (index, animation.name):
                return animation
        names = ", ".join(f"{index} {animation.name!r}" for index, animation in enumerate(animations))
        raise SceneError(f"animate: no animation {shown(which)}; the scene has {names or 'none'}")

    def save(self, path: str | Path) -> None:
        """Write the scene as glTF 2.0, for pica.load and others: .glb, or .gltf with a .bin and PNG files beside it.

        Existing files are replaced. Numbers of arrays are 32 bits wide; all else is the same after loading. Warns, once
        for each kind, of content that has no place in the file (docs/guide/gltf.md, "Saving"). Raises SceneError for
        another suffix and an invalid scene, PicaError for a file that cannot be written.
        """
        from pica.scene import gltf_export  # which takes scenes apart

        gltf_export.write(self, path)

    def subscribe(self) -> ChangeSet:
        """A new record of the scene's changes; updated as long as the caller holds it."""
        changes = ChangeSet()
        self._listeners.add(changes)
        return changes

    def cameras(self) -> list[Camera]:
        """The cameras in the scene, placed in the world; scale is dropped."""
        return [_placed(node.camera, node.world) for node in self.nodes() if node.camera is not None]

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the bounds of all meshes, (3,) each; a unit box if there are none.

        Raises SceneError for an invalid mesh or transform.
        """
        return whole_box(self.nodes())

    def subject_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest corner of the subject's bounds, (3,) each: all meshes but grounds, walls and
        skies that are far larger than the rest (docs/guide/cameras.md). Raises SceneError as bounds.
        """
        return subject_box(self.nodes())

    def default_camera(self, aspect: float) -> Camera:
        """The file's first camera, or one that frames `subject_bounds`; `aspect` is width over height.

        It stays on this side of walls around the subject, if there is room. Raises SceneError for an invalid
        scene.
        """
        cameras = self.cameras()
        return cameras[0] if cameras else framed(self.nodes(), aspect)

    def triangle_count(self) -> int:
        """Triangles over all nodes and copies."""
        return sum(
            sum(len(section.indices) for section in node.mesh.sections) * len(node.instance_transforms())
            for node in self.nodes()
            if node.mesh is not None
        )


def _placed(camera: Camera, world: NDArray[np.float64]) -> Camera:
    rotation, _ = np.linalg.qr(world[:3, :3])
    rotation = rotation * np.where(np.sum(rotation * world[:3, :3], axis=0) < 0, -1, 1)  # a scale of 0 has no sign
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, world[:3, 3]
    return replace(camera, transform=transform)
