"""Tracks assignments to visible meshes, sections, materials and images, and the data that they invalidate."""

from collections.abc import Iterable, Set
from typing import TypeAlias

from pica.gpu_scene.geometry import GeometryBuffers
from pica.gpu_scene.materials import MaterialTable
from pica.scene.changes import Changes, ChangeSet, Followed
from pica.scene.material import Image, Material
from pica.scene.model import Mesh, Node, Scene

Edit: TypeAlias = Mesh | Material | Scene
"""A mesh to upload again, a material to pack again, or the scene, for its environment and background."""


class Edits:
    """Subscribes to edits of the nodes' content, and applies them to the tables."""

    def __init__(self, changes: ChangeSet, materials: MaterialTable, geometry: GeometryBuffers) -> None:
        """`changes`: where it is noted."""
        self._changes, self._materials, self._geometry = changes, materials, geometry

    def follow(self, nodes: Iterable[Node]) -> None:
        """Follow nodes that become visible. The material table follows their images."""
        for mesh in {node.mesh for node in nodes if node.mesh is not None}:
            self._follow_mesh(mesh)

    def needed(self, changes: Changes, scene: Scene) -> list[Edit]:
        """The updates that these changes require.

        A material costs only its row, unless draws, structures or programs depend on the changed field: then all meshes
        with that material are uploaded again.
        """
        if not changes.edited:
            return []
        edits: dict[Edit, None] = {}
        materials: set[Material] = set()
        parts: set[Followed] = set()
        for edited in changes.edited:
            if isinstance(edited, Scene | Mesh):
                edits[edited] = None
            elif isinstance(edited, Material):
                materials.add(edited)
            elif isinstance(edited, Image):
                materials.update(self._materials.with_image(edited))
            else:
                parts.add(edited)
        materials = {material for material in materials if self._materials.has(material)}
        anew = {material for material in materials if not self._materials.can_renew(material)}
        edits.update(dict.fromkeys(materials - anew))
        if anew or parts:
            for mesh in {node.mesh: None for node in scene.nodes() if node.mesh is not None}:
                if any(part in parts or part.material in anew for part in mesh.parts):
                    edits[mesh] = None
        return list(edits)

    def check(self, edits: list[Edit]) -> None:
        """Raises SceneError or MaterialTypeError for invalid content; the programs have its types already."""
        for edit in edits:
            if not isinstance(edit, Material):
                edit.check()
            for material in _materials(edit):
                self._materials.check(material)

    def take(self, edits: list[Edit]) -> Set[Material]:
        """Pack the materials again. The caller removes and adds the nodes of edited meshes. Returns the materials whose
        emission differs."""
        used = {material: None for edit in edits for material in _materials(edit) if self._materials.has(material)}
        meshes = {edit for edit in edits if isinstance(edit, Mesh)}
        if meshes:
            self._geometry.retire(meshes, {material for material in used if not self._materials.can_renew(material)})
            for mesh in meshes:
                self._follow_mesh(mesh)
        return {material for material in used if self._materials.renew(material)}

    def _follow_mesh(self, mesh: Mesh) -> None:
        mesh.follow(self._changes)
        for part in mesh.parts:
            part.follow(self._changes)
            part.material.follow(self._changes)


def _materials(edit: Edit) -> Iterable[Material]:
    match edit:
        case Material():
            return (edit,)
        case Mesh():
            return {part.material: None for part in edit.parts}
        case _:
            return ()
