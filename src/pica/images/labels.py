"""Names for the numbers in the AOVs instance and material, as they were when the frame was rendered."""

import difflib
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import ref

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError, shown
from pica.names import did_you_mean

if TYPE_CHECKING:
    from pica.scene.node import Node

NUMBERED = frozenset({"instance", "material"})
"""The AOVs with such numbers."""
BACKGROUND = 0
"""The number of the background in `instance`, `material` and semantic labels."""
NO_CLASS = "background"
"""The name of 0 in semantic labels."""

NodeRow = tuple[int, str, int, str | None, tuple[str, ...], dict[str, object], "ref[Node] | None"]
"""Of a node: its number, its name, its parent's number or 0, the names of its mesh and of the mesh's materials, its
extras, and which it is."""
MaterialRow = tuple[int, str, dict[str, object]]
_MOST_NAMES = 8
"""Names that a message lists."""


@dataclass(frozen=True, eq=False)
class NodeLabel:
    """A node as it was when the frame was rendered."""

    number: int
    """In the AOV `instance`, from 1."""
    name: str
    parent: "NodeLabel | None" = field(repr=False)
    """The parent; None for a root node."""
    mesh: str | None
    """The name of its mesh; None: it has none, and no pixel has its number."""
    materials: tuple[str, ...]
    """The names of the mesh's materials."""
    extras: dict[str, object]
    """A copy of the node's."""

    @property
    def path(self) -> str:
        """The names from the scene down to the node, such as "robot/arm/hand"; "#7" for node 7 if it has no name."""
        names, above = [self.step], self.parent
        while above is not None:
            names.append(above.step)
            above = above.parent
        return "/".join(reversed(names))

    @property
    def step(self) -> str:
        """Its name in paths."""
        return self.name or f"#{self.number}"

    def matches(self, path: str) -> bool:
        """Whether a path means it, or the end of one such as its name; "/robot" means the scene's own alone."""
        at: NodeLabel | None = self
        while at is not None:
            if path == at.step:
                return True
            if not path.endswith(f"/{at.step}"):
                return False
            path = path[: -len(at.step) - 1]
            if not path:
                return at.parent is None
            at = at.parent
        return False


@dataclass(frozen=True)
class MaterialLabel:
    """A material as it was when the frame was rendered."""

    number: int
    """In the AOV `material`, from 1."""
    name: str
    extras: dict[str, object]
    """A copy of the material's."""


class Semantic(NamedTuple):
    """Semantic classes of pixels."""

    labels: NDArray[np.int32]
    """(height, width) the number of each pixel's class; 0: of none."""
    names: tuple[str, ...]
    """The name of each class by its number; the first is "background"."""


class Labels:
    """All nodes and materials of a scene at one time, by their numbers."""

    def __init__(self, nodes: list[NodeRow], materials: list[MaterialRow]) -> None:
        """`nodes`: parents before children."""
        self._rows, self._material_rows = nodes, materials

    def __getstate__(self) -> dict[str, Any]:
        rows = [(*row[:-1], None) for row in self._rows]  # nodes are the scene's
        return {"_rows": rows, "_material_rows": self._material_rows}

    @cached_property
    def nodes(self) -> dict[int, NodeLabel]:
        """By number, parents before children."""
        by_number: dict[int, NodeLabel] = {}
        for number, name, above, mesh, materials, extras, _ in self._rows:
            by_number[number] = NodeLabel(number, name, by_number.get(above), mesh, materials, extras)
        return by_number

    @cached_property
    def materials(self) -> dict[int, MaterialLabel]:
        """By number."""
        return {row[0]: MaterialLabel(*row) for row in sorted(self._material_rows, key=lambda row: row[0])}

    def numbers(self, which: "str | Node | NodeLabel") -> set[int]:
        """The numbers of a node, or of all that a name or path means, with all below. Raises PicaError for none."""
        inside = {which.number} if isinstance(which, NodeLabel) else self._named(which)
        if not inside:
            raise PicaError(self._unknown(which))
        for number, label in self.nodes.items():
            if label.parent is not None and label.parent.number in inside:
                inside.add(number)
        return inside

    def mask(self, instance: NDArray[np.uint32], which: "str | Node | NodeLabel") -> NDArray[np.bool_]:
        """(height, width) where an AOV `instance` shows the node or one below it. Raises PicaError."""
        return _looked_up(dict.fromkeys(self.numbers(which), True), instance, np.bool_)

    def semantic(
        self,
        instance: NDArray[np.uint32],
        classes: "str | Callable[[NodeLabel], str | None]",
        names: Sequence[str] | None,
    ) -> Semantic:
        """See Frame.semantic."""
        if isinstance(classes, str):
            self._warn_of_missing(classes)
        of_nodes: dict[int, str] = {}
        for number, label in self.nodes.items():
            name = _class_of(label, classes)
            if name is None and label.parent is not None:
                name = of_nodes.get(label.parent.number)
            if name is not None:
                of_nodes[number] = name
        class_names = (NO_CLASS, *(sorted({*of_nodes.values()} - {NO_CLASS}) if names is None else _checked(names)))
        if missing := sorted(set(of_nodes.values()) - set(class_names)):
            raise PicaError(f"semantic: names lack {_listed(missing)}, which nodes have")
        numbers = {name: number for number, name in enumerate(class_names)}
        values = {number: numbers[name] for number, name in of_nodes.items()}
        return Semantic(_looked_up(values, instance, np.int32), class_names)

    def _warn_of_missing(self, key: str) -> None:
        keys = dict.fromkeys(key for label in self.nodes.values() for key in label.extras)
        if key not in keys:
            there = f"the keys that nodes have are {_listed(keys)}" if keys else "no node has any"
            hint = did_you_mean(key, keys)
            warnings.warn(f"semantic: no node has {shown(key)} among its extras; {there}{hint}", stacklevel=4)

    def _named(self, which: "str | Node") -> set[int]:
        if isinstance(which, str):
            return {number for number, label in self.nodes.items() if label.matches(which)}
        return {row[0] for row in self._rows if row[-1] is not None and row[-1]() is which}

    def _unknown(self, which: object) -> str:
        if not isinstance(which, str):
            return f"no node {shown(which)} in this frame; give a node that was in its scene, a name or a path"
        names = dict.fromkeys(label.step for label in self.nodes.values())
        last = which.rpartition("/")[2]
        near = difflib.get_close_matches(last, names, _MOST_NAMES)
        near += [name for name in names if last and last.lower() in name.lower() and name not in near]
        if near:
            paths = dict.fromkeys(label.path for label in self.nodes.values() if label.step in near[:_MOST_NAMES])
            return f"no node {shown(which)} in this frame; near: {_listed(paths)}"
        return f"no node {shown(which)} in this frame; there are {_listed(list(names)) or 'none'}"


def _looked_up(values: dict[int, Any], instance: NDArray[np.uint32], dtype: type[np.generic]) -> NDArray[Any]:
    """Maps the numbers in a picture; 0 for missing ones."""
    table = np.zeros(max(int(instance.max(initial=0)), *values, 0) + 1, dtype)
    table[list(values)] = list(values.values())
    return table[instance]


def _class_of(label: NodeLabel, classes: str | Callable[[NodeLabel], str | None]) -> str | None:
    value = label.extras.get(classes) if isinstance(classes, str) else classes(label)
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, int):
        return str(value)
    raise PicaError(f"semantic: the class of node {shown(label.step)} is {shown(value)}, not a name")


def _checked(names: Sequence[str]) -> list[str]:
    """Without the background, which a table that `semantic` gave begins with."""
    given = [] if isinstance(names, str) else list(names)
    if not all(isinstance(name, str) for name in given) or len(set(given)) < len(given) or isinstance(names, str):
        raise PicaError(f'semantic: names: {shown(names)} is not a list of different names such as ["chair", "table"]')
    return [name for name in given if name != NO_CLASS]


def _listed(names: Iterable[str]) -> str:
    quoted = [shown(name) for name in names]
    more = f" and {len(quoted) - _MOST_NAMES} more" if len(quoted) > _MOST_NAMES else ""
    return ", ".join(quoted[:_MOST_NAMES]) + more
