"""What becomes of a scene's nodes and of what they show, gathered for somebody who keeps a copy of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar
from weakref import ref

from pica.scene.construction import FieldsOnly

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
    edited: "list[Followed | Scene]"
    """Meshes, their parts, materials and images that were written to; the scene when its environment was set."""

    def then(self, later: "Changes") -> "Changes":
        """These changes and those that followed them."""
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
    """Collects changes for somebody who follows a scene; made by Scene.subscribe."""

    def __init__(self) -> None:
        self.added: dict[Node, None] = {}
        self.removed: dict[Node, None] = {}
        self.moved: dict[Node, None] = {}
        self.deformed: dict[Node, None] = {}
        self.altered: dict[Node, None] = {}
        self.edited: dict[Followed | Scene, None] = {}

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

    def show_anew(self, node: "Node") -> None:
        """A node that stays shows something else: another mesh, or as many copies of it as there were not."""
        self.remove(node)
        self.add(node)

    def take(self) -> Changes:
        """The changes since the last call, and forget them."""
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
    """Change sets that somebody still holds. Whatever moves goes through them: WeakSet, which does the same, takes six
    times as long. Nobody follows a copy."""

    def __init__(self) -> None:
        self._references: list[ref[ChangeSet]] = []

    def add(self, changes: ChangeSet) -> None:
        """Tell these too, as long as somebody holds them."""
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
    """What several nodes may show, such as a material: who shows it hears when one of its tracked fields is set."""

    _followers: "ClassVar[Followers | tuple[()]]" = ()

    def follow(self, changes: ChangeSet) -> None:
        """Note in these, as long as somebody holds them, when this is written to."""
        if isinstance(self._followers, tuple):
            vars(self)["_followers"] = Followers()
        assert isinstance(self._followers, Followers)
        self._followers.add(changes)

    def _written(self, field: str, before: Any) -> None:
        """As tracked_field.Holder."""
        for changes in self._followers:
            changes.edited[self] = None


class Listeners(Followers):
    """Those of a scene."""

    def __init__(self, scene: "Scene") -> None:
        super().__init__()
        self._scene: Callable[[], Scene | None] = ref(scene)

    @property
    def in_use(self) -> bool:
        """Whether anybody still has the scene."""
        return self._scene() is not None

    def __getstate__(self) -> "tuple[Scene | None]":
        return (self._scene(),)

    def __setstate__(self, state: "tuple[Scene | None]") -> None:
        """A copy follows the copied scene, and nobody follows that yet."""
        (scene,) = state
        super().__setstate__(())
        self._scene = (lambda: None) if scene is None else ref(scene)
