"""Meshes: sections become primitives of indexed triangles (3.7.2)."""

from dataclasses import replace
from typing import Any

import numpy as np

from pica.scene.building import tangent_uvs, unit_tangents
from pica.scene.deformer import CameraFacing, Deformer
from pica.scene.gltf.deformation import normalized
from pica.scene.gltf.meshes import TRIANGLES, renumbered, triangulate
from pica.scene.gltf_export.container import INDICES, VERTICES, Asset
from pica.scene.gltf_export.materials import Materials
from pica.scene.mesh import Mesh, Section
from pica.scene.node import Node

_SHORT = 0xFFFF
"""The index that restarts primitives in other renderers, and so none of a vertex (3.7.2.1)."""


class Meshes:
    """The meshes of a file, each added once, when first used."""

    def __init__(self, asset: Asset) -> None:
        self._asset = asset
        self.materials = Materials(asset)
        self._added: dict[Mesh, int | None] = {}

    def get(self, node: Node) -> int | None:
        """The index of a node's mesh; None where it shows no triangles that could be saved."""
        if node.detail is not None:
            self._asset.leave_out("meshes of landscapes")
            return None
        mesh = node.mesh
        if mesh is None:
            return None
        if node.deformer is None:
            if mesh not in self._added:
                self._added[mesh] = self._add(mesh)
            return self._added[mesh]
        if isinstance(node.deformer, CameraFacing):
            self._asset.leave_out("particles and ribbons")
            return None
        self._asset.leave_out("deformations of vertices in code, whose meshes are as they were at that moment")
        return self._add(Mesh([_posed(section, node.deformer) for section in mesh.sections], mesh.name))

    def _add(self, mesh: Mesh) -> int | None:
        if mesh.primitives:
            self._asset.leave_out("primitives that are not triangles", sum(map(len, mesh.primitives)))
        used = [part for section in mesh.sections if (part := _in_use(section)) is not None]
        if not used:
            return None
        return self._asset.add("meshes", {"name": mesh.name, "primitives": [self._primitive(part) for part in used]})

    def _primitive(self, section: Section) -> dict[str, Any]:
        asset, count = self._asset, len(section.positions)
        short = np.uint16 if count <= _SHORT else np.uint32
        attributes = {
            "POSITION": asset.accessor(section.positions, VERTICES, bounded=True),
            "NORMAL": asset.accessor(section.normals, VERTICES),
        }
        # Those that the loader makes are left out.
        generated = tangent_uvs(section.material) is None and section.morph_tangents is None
        if not generated or not np.array_equal(section.tangents, unit_tangents(None, section.normals)):
            attributes["TANGENT"] = asset.accessor(section.tangents, VERTICES)
        for number, coordinates in enumerate((section.uv0, section.uv1)):
            if coordinates.any():
                attributes[f"TEXCOORD_{number}"] = asset.accessor(coordinates, VERTICES)
        if (section.colors != 1).any():
            attributes["COLOR_0"] = asset.accessor(section.colors, VERTICES)
        primitive: dict[str, Any] = {
            "attributes": attributes | self._joints(section),
            "indices": asset.accessor(section.indices.astype(short).reshape(-1), INDICES),
            "material": self.materials.get(section.material),
        }
        if targets := self._targets(section):
            primitive["targets"] = targets
        if section.flat:
            primitive["extras"] = {"pica": {"flat": True}}
        return primitive

    def _joints(self, section: Section) -> dict[str, int]:
        """In sets of four a vertex."""
        if section.joints is None or section.weights is None:
            return {}
        joints, weights = normalized(section.joints, section.weights)
        missing = ((0, 0), (0, -joints.shape[1] % 4))
        joints, weights = np.pad(joints, missing), np.pad(weights, missing)
        attributes = {}
        for number in range(joints.shape[1] // 4):
            columns = slice(4 * number, 4 * number + 4)
            attributes[f"JOINTS_{number}"] = self._asset.accessor(joints[:, columns], VERTICES)
            attributes[f"WEIGHTS_{number}"] = self._asset.accessor(weights[:, columns], VERTICES)
        return attributes

    def _targets(self, section: Section) -> list[dict[str, int]]:
        named = {
            "POSITION": section.morph_positions, "NORMAL": section.morph_normals, "TANGENT": section.morph_tangents,
        }  # fmt: skip
        given = {name: offsets for name, offsets in named.items() if offsets is not None}
        count = max((len(offsets) for offsets in given.values()), default=0)
        return [
            {
                name: self._asset.accessor(offsets[target], VERTICES, bounded=name == "POSITION")
                for name, offsets in given.items()
            }
            for target in range(count)
        ]


def _in_use(section: Section) -> Section | None:
    """The section as the loader keeps it: without degenerate triangles and unused vertices; None if nothing is left."""
    triangles, vertices = renumbered(triangulate(section.indices.reshape(-1), TRIANGLES), len(section.positions))
    if not len(triangles):
        return None
    if vertices is None and len(triangles) == len(section.indices):
        return section
    return section.take(np.arange(len(section.positions)) if vertices is None else vertices, triangles)


def _posed(section: Section, deformer: Deformer) -> Section:
    """The section as a deformer has its vertices now."""
    positions, normals, tangents = (values.astype(np.float32) for values in deformer.deform(section))
    return replace(section, positions=positions, normals=normals, tangents=tangents, rows=None)
