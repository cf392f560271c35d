"""What becomes of a scene's nodes, gathered for somebody who keeps a copy of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import ref

if TYPE_CHECKING:
    from pica.scene.model import Node, Scene


@dataclass
class Changes:
    """What became of a scene's nodes; each node once a list."""

    added: "list[Node]"
    removed: "list[Node]"
    moved: "list[Node]"
    """With all below them."""
    deformed: "list[Node]"
    """Their vertices moved against each other, by weights or by joints."""
    altered: "list[Node]"
    """What they carry as a light, who sees them or their lighting channels were set."""

    def then(self, later: "Changes") -> "Changes":
        """These changes and those that followed them."""
        return Changes(
            self.added + later.added,
            self.removed + later.removed,
            self.moved + later.moved,
            self.deformed + later.deformed,
            self.altered + later.altered,
        )

    def any(self) -> bool:
        """Whether there was any change."""
        return bool(self.added or self.removed or self.moved or self.deformed or self.altered)


class ChangeSet:
    """Collects changes for somebody who follows a scene; made by Scene.subscribe."""

    def __init__(self) -> None:
        self.added: dict[Node, None] = {}
        self.removed: dict[Node, None] = {}
        self.moved: dict[Node, None] = {}
        self.deformed: dict[Node, None] = {}
        self.altered: dict[Node, None] = {}

    def add(self, node: "Node") -> None:
        """A node has come; one that goes and comes back counts as both."""
        self.added[node] = None

    def remove(self, node: "Node") -> None:
        """A node has gone."""
        if node in self.added and node not in self.removed:
            del self.added[node]
        else:
            self.removed[node] = None
            self.added.pop(node, None)
        self.moved.pop(node, None)
        self.deformed.pop(node, None)
        self.altered.pop(node, None)

    def take(self) -> Changes:
        """The changes since the last call, and forget them."""
        collected = self.added, self.removed, self.moved, self.deformed, self.altered
        changes = Changes(*(list(nodes) for nodes in collected))
        for nodes in collected:
            nodes.clear()
        return changes


class Listeners:
    """The change sets of a scene that somebody still holds. Nodes go through them whenever they move: WeakSet, which
    does the same, takes six times as long."""

    def __init__(self, scene: "Scene") -> None:
        self._references: list[ref[ChangeSet]] = []
        self._scene: Callable[[], Scene | None] = ref(scene)

    @property
    def in_use(self) -> bool:
        """Whether anybody still has the scene."""
        return self._scene() is not None

    def add(self, changes: ChangeSet) -> None:
        """Tell these too, as long as somebody holds them."""
        self._references.append(ref(changes, self._references.remove))

    def __iter__(self) -> Iterator[ChangeSet]:
        found = [reference() for reference in tuple(self._references)]
        return (changes for changes in found if changes is not None)

    def __getstate__(self) -> "tuple[Scene | None]":
        return (self._scene(),)

    def __setstate__(self, state: "tuple[Scene | None]") -> None:
        """A copy follows the copied scene, and nobody follows that yet."""
        (scene,) = state
        self._references = []
        self._scene = (lambda: None) if scene is None else ref(scene)
