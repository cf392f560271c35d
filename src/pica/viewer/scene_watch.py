"""Notices all changes of a scene, those of meshes, materials and images too."""

from collections.abc import Iterable

from pica.scene.changes import Followed
from pica.scene.material import Material, Texture
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Scene
from pica.scene.node import Node
from pica.scene.primitives import Primitives


class SceneWatch:
    """What has happened to a scene since it was asked last."""

    def __init__(self, scene: Scene) -> None:
        self._changes = scene.subscribe()
        self._follow(scene.nodes())

    def take(self) -> bool:
        """Whether anything has changed since the last call."""
        changes = self._changes.take()
        self._follow(changes.added)
        for edited in changes.edited:
            self._follow_content(edited)
        return changes.any()

    def _follow(self, nodes: Iterable[Node]) -> None:
        content: set[Mesh | Material] = set()
        for node in nodes:
            content |= set() if node.mesh is None else {node.mesh}
            content |= set() if node.detail is None else {node.detail.material}
        for each in content:
            self._follow_content(each)

    def _follow_content(self, content: Followed | Scene) -> None:
        """A mesh, a part of one or a material, with what it is made of."""
        if isinstance(content, Followed):
            content.follow(self._changes)
        match content:
            case Mesh():
                for part in content.parts:
                    self._follow_content(part)
            case Section() | Primitives():
                self._follow_content(content.material)
            case Material():
                for value in vars(content).values():
                    if isinstance(value, Texture):
                        value.image.follow(self._changes)
