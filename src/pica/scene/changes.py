"""Records the changes of a scene's nodes and of their content, for subscribers with a copy of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar
from weakref import ref

from pica.scene.construction import FieldsOnly

if TYPE_CHECKING:
    from pica.scene.model import Node, Scene


@dataclass
class Changes:
    """Changes of a scene's nodes; each node at most once per list."""

    added: "list[Node]"
    removed: "list[Node]"
    moved: "list[Node]"
    """With all below them."""
    deformed: "list[Node]"
    """Their vertices moved against each other, by weights or by joints."""
    altered: "list[Node]"
    """Nodes whose light, visibility or lighting channels were set."""
    edited: "list[Followed | Scene]"
    """Meshes, their parts, materials and images that were written to; the scene when its environment or background was
    set."""

    def then(self, later: "Changes") -> "Changes":
        """These changes followed by later ones."""
        return Changes(
            self.added + later.added,
            self.removed + later.removed,
            self.moved + later.moved,
            self.deformed + later.deformed,
            self.altered + later.altered,
            self.edited + later.edited,
        )

    def any(self) -> bool:
        """Whether there was any change."""
        return bool(self.added or self.removed or self.moved or self.deformed or self.altered or self.edited)


class ChangeSet:
    """Collects changes for a subscriber; made by Scene.subscribe."""

    def __init__(self) -> None:
        self.added: dict[Node, None] = {}
        self.removed: dict[Node, None] = {}
        self.moved: dict[Node, None] = {}
        self.deformed: dict[Node, None] = {}
        self.altered: dict[Node, None] = {}
        self.edited: dict[Followed | Scene, None] = {}

    def add(self, node: "Node") -> None:
        """A node was added; a node that was removed and added again counts as both."""
        self.added[node] = None

    def remove(self, node: "Node") -> None:
        """A node was removed."""
        if node in self.added and node not in self.removed:
            del self.added[node]
        else:
            self.removed[node] = None
            self.added.pop(node, None)
        self.moved.pop(node, None)
        self.deformed.pop(node, None)
        self.altered.pop(node, None)

    def show_anew(self, node: "Node") -> None:
        """A node shows another mesh, or another number of instances."""
        self.remove(node)
        self.add(node)

    def take(self) -> Changes:
        """The changes since the last call, which are then cleared."""
        changes = Changes(
            list(self.added),
            list(self.removed),
            list(self.moved),
            list(self.deformed),
            list(self.altered),
            list(self.edited),
        )
        self.__init__()  # type: ignore[misc]
        return changes


class Followers:
    """Weakly referenced change sets. Every movement iterates over them: WeakSet, which does the same, takes six
    times as long. A copy has no subscribers."""

    def __init__(self) -> None:
        self._references: list[ref[ChangeSet]] = []

    def add(self, changes: ChangeSet) -> None:
        """Add subscribers, referenced weakly."""
        if all(reference() is not changes for reference in self._references):
            self._references.append(ref(changes, self._references.remove))

    def __iter__(self) -> Iterator[ChangeSet]:
        listeners = [reference() for reference in tuple(self._references)]
        return (changes for changes in listeners if changes is not None)

    def __getstate__(self) -> Any:
        return ()

    def __setstate__(self, state: Any) -> None:
        self._references = []


class Followed(FieldsOnly):
    """Content that several nodes may show, such as a material: setting a tracked field informs the subscribers."""

    _followers: "ClassVar[Followers | tuple[()]]" = ()

    def follow(self, changes: ChangeSet) -> None:
        """Add weakly referenced sets of edits."""
        if isinstance(self._followers, tuple):
            vars(self)["_followers"] = Followers()
        assert isinstance(self._followers, Followers)
        self._followers.add(changes)

    def _written(self, field: str, before: Any) -> None:
        """As tracked_field.Holder."""
        for changes in self._followers:
            changes.edited[self] = None


class Listeners(Followers):
    """The change sets of a scene."""

    def __init__(self, scene: "Scene") -> None:
        super().__init__()
        self._scene: Callable[[], Scene | None] = ref(scene)

    @property
    def in_use(self) -> bool:
        """Whether the scene is still alive."""
        return self._scene() is not None

    def __getstate__(self) -> "tuple[Scene | None]":
        return (self._scene(),)

    def __setstate__(self, state: "tuple[Scene | None]") -> None:
        """The copy refers to the copied scene, which has no subscribers yet."""
        (scene,) = state
        super().__setstate__(())
        self._scene = (lambda: None) if scene is None else ref(scene)
