"""The names behind the numbers of the AOVs instance and material, captured for a frame."""

from collections.abc import Iterable, Mapping
from typing import Any
from weakref import ref

from pica.images.labels import Labels, NodeRow
from pica.scene.material import Material
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Node, Scene
from pica.scene.primitives import Primitives

_NOTHING: tuple[str | None, tuple[str, ...]] = (None, ())


def snapshot(scene: Scene, numbers: Mapping[Node, int], materials: Iterable[tuple[int, Material]]) -> Labels:
    """The names of the nodes that have numbers, and of materials by row; later changes of the scene do not show."""
    number_of = dict(numbers)  # a plain one answers in a tenth of a weak one's time
    meshes: dict[Mesh, tuple[str, tuple[str, ...]]] = {}
    rows: list[NodeRow] = []
    for node in scene.nodes():
        number = number_of.get(node)
        if number is None:
            continue
        mesh, labels = node.mesh, _NOTHING
        if mesh is not None:
            if mesh not in meshes:
                meshes[mesh] = mesh.name, _materials_of(mesh)
            labels = meshes[mesh]
        above = 0 if node.parent is None else number_of.get(node.parent, 0)
        rows.append((number, node.name, above, *labels, _copied(node.extras) if node.extras else {}, ref(node)))
    return Labels(rows, [(row + 1, material.name, _copied(material.extras)) for row, material in materials])


def _materials_of(mesh: Mesh) -> tuple[str, ...]:
    parts: list[Section | Primitives] = [*mesh.sections, *mesh.primitives]
    return tuple(dict.fromkeys(part.material.name for part in parts))


def _copied(value: Any) -> Any:
    """A copy of values that JSON can hold; other objects are kept by reference."""
    if isinstance(value, dict):
        return {key: _copied(member) for key, member in value.items()}
    if isinstance(value, list):
        return [_copied(member) for member in value]
    return value
