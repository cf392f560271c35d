"""Copies of a scene for the views of a renderer, which differ in what arrays give to each (domain randomization)."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.names import did_you_mean, unknown
from pica.scene.arrays import affines, as_array
from pica.scene.checked_field import CheckedField, described
from pica.scene.environment import Environment
from pica.scene.material import Image, Material, Texture
from pica.scene.mesh import Mesh
from pica.scene.model import Scene
from pica.scene.node import Node
from pica.scene.values import UnfitError, checked, instance, whole

_MOST = 4096
_FLAGS = ("visible_to_camera", "visible_to_reflections", "casts_shadows")
_Named = TypeVar("_Named", Node, Material)


class SceneViews(Sequence[Scene]):
    """A copy of a scene for each view of a renderer. Arrays set what differs, with a row for each view.

        views = pica.SceneViews(scene, 64)
        renderer = pica.Renderer(views, size=(128, 128))
        views.set_transforms("cube", places)  # (64, 4, 4)
        views.set_material("paint", base_color=colors, roughness=roughness)  # (64, 4), (64,)
        views.set_light("lamp", intensity=candela)  # (64,)
        batch = renderer.render(4, camera=cameras)

    Arrays are of NumPy, or tensors as everywhere in a scene (docs/guide/scaling.md). What is set is in the next
    picture and stays until it is set again; rows that are as before cost nothing. Nodes and materials are those of
    `scene`, or names that only one of them has. `views[i]` is view i's pica.Scene, in which all else can be changed.
    Copies share vertices, images and the environment, in memory and on the device; later edits of `scene` are not
    theirs.

    Methods raise SceneError, and change nothing, for an unknown node, material or field, another number of rows, and
    values that a scene does not take.
    """

    def __init__(self, scene: Scene, views: int) -> None:
        checked("scene views: scene", instance(Scene), scene)
        count = checked("scene views: views", whole(1, _MOST), views)
        nodes = list(scene.nodes())
        meshes = [node.mesh for node in nodes if node.mesh is not None]
        self._nodes: dict[Node, list[Node]] = {node: [] for node in nodes}
        """Of each view, by those of the original."""
        self._materials: dict[Material, list[Material]] = {part.material: [] for mesh in meshes for part in mesh.parts}
        shared = _shared(scene, meshes)
        self._scenes: list[Scene] = []
        for _ in range(count):
            memo: dict[int, Any] = {id(content): content for content in shared}
            try:
                self._scenes.append(deepcopy(scene, memo))
            except RecursionError:
                raise SceneError(f"{described(scene)}: its nodes are nested too deeply to be copied") from None
            for copies in (self._nodes, self._materials):
                for original, of_each in copies.items():
                    of_each.append(memo[id(original)])

    @overload
    def __getitem__(self, index: int) -> Scene: ...

    @overload
    def __getitem__(self, index: slice) -> list[Scene]: ...

    def __getitem__(self, index: int | slice) -> Scene | list[Scene]:
        return self._scenes[index]

    def __len__(self) -> int:
        return len(self._scenes)

    def __repr__(self) -> str:
        return f"<pica.SceneViews: {len(self)} copies of {self._scenes[0]!r}>"

    def nodes(self, node: Node | str) -> tuple[Node, ...]:
        """A node of the scene in each view, such as for a pica.DynamicVertices each."""
        return tuple(self._nodes[_original(self._nodes, "node", node)])

    def materials(self, material: Material | str) -> tuple[Material, ...]:
        """A material of the scene in each view."""
        return tuple(self._materials[_original(self._materials, "material", material)])

    def set_transforms(self, node: Node | str, transforms: ArrayLike) -> None:
        """Move a node, with all below it. `transforms`: (views, 4, 4) the node to its parent, as Node.transform."""
        original = _original(self._nodes, "node", node)
        copies = self._nodes[original]
        matrices = checked(f"scene views: {described(original)}: transforms", self._rows(affines), transforms)
        before = np.stack([copy.transform for copy in copies])
        for row in np.flatnonzero((matrices != before).any(axis=(1, 2))).tolist():
            copies[row].place(matrices[row].copy())

    def set_visible(self, node: Node | str, visible: ArrayLike) -> None:
        """Show or hide the meshes of a node and of all below it. `visible`: (views,) bool.

        A hidden mesh is not seen, reflects and emits no light, and casts no shadow; its nodes' lights stay. One that
        is shown has the fields `visible_to_camera`, `visible_to_reflections` and `casts_shadows` of the scene that was
        copied.
        """
        original = _original(self._nodes, "node", node)
        shows = checked(f"scene views: {described(original)}: visible", self._rows(_flags), visible)
        for below in (each for each in original.walk() if each in self._nodes):
            for copy, shown_here in zip(self._nodes[below], shows.tolist(), strict=True):
                for flag in _FLAGS:
                    _assign(copy, flag, shown_here and getattr(below, flag))

    def set_material(self, material: Material | str, **fields: Any) -> None:
        """Set fields of a material: each with (views,) numbers or objects, such as pica.Texture, or (views, n) vectors.

        `fields`: as pica.Material has them.
        """
        original = _original(self._materials, "material", material)
        what, values = described(original), {}
        for name, given in fields.items():
            field = vars(Material).get(name)
            if not isinstance(field, CheckedField):
                names = [name for name, each in vars(Material).items() if isinstance(each, CheckedField)]
                raise SceneError(f"scene views: {what}: {unknown(name, names)}")
            values[name] = [
                checked(f"scene views: {what}: {name}: view {view}", field.check, value)
                for view, value in enumerate(self._values(f"{what}: {name}", given))
            ]
        for name, of_each in values.items():
            for copy, value in zip(self._materials[original], of_each, strict=True):
                _assign(copy, name, value)

    def set_light(self, node: Node | str, **fields: Any) -> None:
        """Set fields of a node's light, as `set_material`: `intensity` (views,), `color` (views, 3) and others.

        `fields`: as the light's class has them, such as pica.PointLight, with its units.
        """
        original = _original(self._nodes, "node", node)
        copies = self._nodes[original]
        lights = self._replaced(described(original), "light", [copy.light for copy in copies], fields)
        for copy, light in zip(copies, lights, strict=True):
            _assign(copy, "light", light)

    def set_environment(self, **fields: Any) -> None:
        """Set fields of the environments, as `set_material`: `strength` (views,), `rotation` (views,) radians,
        `radiance` a sequence of arrays. `fields`: as pica.Environment has them."""
        before = [scene.environment for scene in self._scenes]
        environments = self._replaced(described(self._scenes[0]), "environment", before, fields)
        for scene, environment in zip(self._scenes, environments, strict=True):
            _assign(scene, "environment", environment)

    def _replaced(self, what: str, kind: str, content: Sequence[Any], fields: dict[str, Any]) -> list[Any]:
        """Content with these fields in each view. Raises SceneError without any."""
        values = {name: self._values(f"{what}: {kind}: {name}", given) for name, given in fields.items()}
        made = []
        for view, before in enumerate(content):
            if before is None:
                raise SceneError(f"scene views: {what}: view {view} has no {kind}")
            now = {name: of_each[view] for name, of_each in values.items()}
            if all(name in vars(before) and _same(vars(before)[name], value) for name, value in now.items()):
                made.append(before)
                continue
            try:
                made.append(replace(before, **now))
            except SceneError as fault:
                raise SceneError(f"scene views: {what}: view {view}: {fault}") from None
        return made

    def _values(self, what: str, values: Any) -> list[Any]:
        """One for each view, vectors as tuples."""
        if isinstance(values, list | tuple):
            rows: list[Any] = list(values)
        else:
            array = checked(f"scene views: {what}", lambda given: as_array(given, (), "fiub", "values"), values)
            rows = [tuple(row) if isinstance(row, list) else row for row in np.atleast_1d(array).tolist()]
            if not array.ndim:
                raise SceneError(f"scene views: {what}: {shown(values)}: must be an array with a row for each view")
        if len(rows) != len(self):
            raise SceneError(f"scene views: {what}: has {len(rows)} rows, not one for each of {len(self)} views")
        return rows

    def _rows(self, check: Callable[[Any], NDArray[Any]]) -> Callable[[Any], NDArray[Any]]:
        """A check that there is a row for each view too."""

        def rows(values: Any) -> NDArray[Any]:
            array = check(values)
            if len(array) != len(self):
                raise UnfitError(f"has {len(array)} rows, not one for each of {len(self)} views")
            return array

        return rows


def _shared(scene: Scene, meshes: Iterable[Mesh]) -> list[Any]:
    """What copies of a scene share: content that never changes, and images."""
    shared: list[Any] = [scene.environment, scene.background]
    for mesh in meshes:
        for part in mesh.parts:
            shared += [value for value in vars(part).values() if isinstance(value, np.ndarray)]
            textures = (value for value in vars(part.material).values() if isinstance(value, Texture))
            shared += (texture.image for texture in textures)
    return [scene.origin, *(content for content in shared if isinstance(content, np.ndarray | Image | Environment))]


def _original(copies: Mapping[_Named, object], kind: str, which: _Named | str) -> _Named:
    """The node or material, by itself or by its name. Raises SceneError unless there is exactly one."""
    if not isinstance(which, str):
        if isinstance(which, Node | Material) and which in copies:
            return which
        raise SceneError(f"scene views: {shown(which)} is not a {kind} of the scene that was copied, nor a name")
    named = [original for original in copies if original.name == which]
    if len(named) > 1:
        raise SceneError(f"scene views: {len(named)} {kind}s have the name {shown(which)}; give the {kind} itself")
    if not named:
        near = did_you_mean(which, [original.name for original in copies])
        raise SceneError(f"scene views: no {kind} has the name {shown(which)}{near}")
    return named[0]


def _flags(values: Any) -> NDArray[np.bool_]:
    return as_array(values, ("views",), "b", "True and False")


def _assign(holder: Any, name: str, value: Any) -> None:
    """Unless it has the value already, as changes cost work."""
    if not _same(getattr(holder, name), value):
        setattr(holder, name, value)


def _same(before: Any, now: Any) -> bool:
    if isinstance(before, np.ndarray) or isinstance(now, np.ndarray):
        return before is now
    return before is now or bool(before == now)
