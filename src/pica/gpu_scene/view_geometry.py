"""The geometry that depends on a view's camera: facing quads and ribbons, and levels of detail of landscapes."""

from collections import Counter
from collections.abc import Set
from dataclasses import dataclass

import numpy as np

from pica.gpu_scene.deformation.deformation import Deformation, deform_all, facing_of
from pica.gpu_scene.deformation.particles import FacingWriter
from pica.gpu_scene.geometry import GpuMesh
from pica.gpu_scene.gpu_scene import GpuScene
from pica.gpu_scene.masks import instance_mask
from pica.gpu_scene.placement import Placement
from pica.rhi.acceleration import without_rounding
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.rt_view import RtView
from pica.rhi.tables import GrowingBuffer, Runs
from pica.scene.camera import Camera
from pica.scene.deformer import CameraFacing
from pica.scene.landscape import Landscape, Levels
from pica.scene.material import Material
from pica.scene.model import Mesh, Node


@dataclass(eq=False)
class _NodeGeometry:
    """The geometry of a node in the view."""

    placement: Placement
    mesh: GpuMesh
    records: range
    objects: range
    facing: tuple[Deformation, FacingWriter] | None
    is_placed: bool = False


class ViewGeometry:
    """Meshes, records and objects of one view, for the nodes that follow its camera."""

    def __init__(self, device: Device, scene: GpuScene) -> None:
        self._device, self._scene = device, scene
        self.rt = RtView(device, scene.rt_scene)
        self.records = scene.record_set()
        self.previous = GrowingBuffer(device, "previous positions of a view's own", 12)
        """float32 (vertices, 3), where they were in the view's frame before."""
        self._previous_rows = Runs()
        self._of_node: dict[Node, _NodeGeometry] = {}
        self._touched = {node: None for node, placement in scene.placements.items() if placement.mesh is None}
        self._written: set[Node] = set()
        """Nodes written in the previous frame; if static now, their previous positions equal the current ones."""
        self._levels: dict[Landscape, Levels] = {}
        self._patches: Counter[Landscape] = Counter()
        self.revision = 0
        """Counts frames in which anything changed."""
        self.placed = 0
        """Counts how often nodes came or went, or took another mesh."""

    @property
    def is_empty(self) -> bool:
        """Whether the view sees what all views of the scene see."""
        return not (self._of_node or self._touched)

    def touch(self, nodes: list[Node]) -> None:
        """Mark nodes that were added, removed, moved or deformed, or whose mask changed."""
        self._touched.update(dict.fromkeys(nodes))

    def relight(self, materials: Set[Material]) -> None:
        """Update emissive triangles after a change of these materials' emission."""
        for geometry in self._of_node.values():
            self.records.relight(geometry.mesh, geometry.records, materials)

    def mesh(self, node: Node) -> GpuMesh:
        """The view's mesh of a node."""
        return self._of_node[node].mesh

    def shown(self, node: Node) -> tuple[GpuMesh, range]:
        """The view's mesh of a node, and its records."""
        geometry = self._of_node[node]
        return geometry.mesh, geometry.records

    def update(self, recording: Recording, camera: Camera) -> None:
        """Record a frame's updates: added nodes, new levels of detail, facing and changed geometry."""
        if not (self._of_node or self._touched):
            self.rt.build(recording)
            return
        touched, self._touched = self._touched, {}
        added = [*self._replaced(touched), *self._other_levels(camera)]
        for node in added:
            self._add(recording, node, camera)
        if added:
            self._scene.geometry.build(recording.encoder)
        written = self._write(recording, camera, touched)
        self._place([node for node in dict.fromkeys((*touched, *added)) if node in self._of_node])
        self.revision += bool(touched or added or written)
        self.rt.build(recording)

    def close(self) -> None:
        """Free the view's rows of the scene's tables."""
        for node in list(self._of_node):
            self._remove(node)

    def _replaced(self, touched: dict[Node, None]) -> list[Node]:
        """Remove nodes that are no longer shown; returns new ones."""
        added = []
        for node in touched:
            placement = self._scene.placements.get(node)
            if node in self._of_node and self._of_node[node].placement is not placement:
                self._remove(node)
            if placement is not None and node not in self._of_node:
                added.append(node)
        return added

    def _other_levels(self, camera: Camera) -> list[Node]:
        """Remove patches whose level or border has changed; returns them."""
        differing = []
        self._levels = {landscape: levels for landscape, levels in self._levels.items() if self._patches[landscape]}
        for landscape, before in self._levels.items():
            levels = self._levels[landscape] = landscape.levels_for(camera)
            differing += [node for node in landscape.differing(levels, before) if node in self._of_node]
        for node in differing:
            self._remove(node)
        return differing

    def _add(self, recording: Recording, node: Node, camera: Camera) -> None:
        placement, scene = self._scene.placements[node], self._scene
        geometry, facing = scene.geometry, None
        if node.deforms:
            mesh = geometry.acquire(recording.encoder, _mesh(node), self._previous_rows)
            facing = facing_of(self._device, node, geometry, mesh, self.previous)
        else:
            mesh = geometry.acquire(recording.encoder, self._patch(node, camera))
        [records] = self.records.add(mesh, [placement.instances])
        objects = len(placement.instances) * len(mesh.parts)
        first = self.rt.slots.take(objects)
        self._of_node[node] = _NodeGeometry(placement, mesh, records, range(first, first + objects), facing)
        self.placed += 1

    def _patch(self, node: Node, camera: Camera) -> Mesh:
        landscape = node.detail
        assert landscape is not None
        if landscape not in self._levels:
            self._levels[landscape] = landscape.levels_for(camera)
        self._patches[landscape] += 1
        return landscape.mesh(node, self._levels[landscape])

    def _remove(self, node: Node) -> None:
        geometry = self._of_node.pop(node)
        self.rt.remove(geometry.objects)
        self.records.remove(geometry.mesh, geometry.records)
        if geometry.facing is not None:
            geometry.facing[0].forget()
        self._scene.geometry.release(geometry.mesh)
        self._written.discard(node)
        if node.detail is not None:
            self._patches[node.detail] -= 1
        self.placed += 1

    def _write(self, recording: Recording, camera: Camera, touched: dict[Node, None]) -> bool:
        """Rewrite camera-facing geometry where it changed; False if all is as in the previous frame."""
        again, self._written = self._written, set()
        turned, settled = [], []
        for node, geometry in self._of_node.items():
            if geometry.facing is None:
                continue
            assert isinstance(node.deformer, CameraFacing)
            deformation, writer = geometry.facing
            eye = node.deformer.eye(camera) or writer.eye
            if deformation.is_new or node in touched or not eye.same(writer.eye):
                self._written.add(node)
                turned.append(deformation)
            elif node in again:
                settled.append(deformation)
            writer.eye = eye
        self.previous.reserve(recording.encoder, self._previous_rows.end)
        for deformation in settled:
            deformation(recording)
        deform_all(recording, turned)
        if turned:
            self.rt.changed()
        return bool(turned)

    def _place(self, nodes: list[Node]) -> None:
        """Place objects at their instances, with their masks."""
        table, rows = self._scene.instance_table.rows, self.rt.slots.rows
        for node in nodes:
            geometry = self._of_node[node]
            instances = slice(geometry.placement.instances.start, geometry.placement.instances.stop)
            places = without_rounding(table["to_world"][instances])
            transforms = np.repeat(places, len(geometry.mesh.parts), axis=0)
            objects, mask = slice(geometry.objects.start, geometry.objects.stop), instance_mask(node)
            masks = rows["id_and_mask"][objects] >> 24
            if geometry.is_placed and np.array_equal(rows["transform"][objects], transforms) and (masks == mask).all():
                continue
            for placing in self.records.objects(geometry.mesh, np.array(geometry.records), np.array(geometry.objects)):
                self.rt.place(*placing)
            self.records.renew(geometry.mesh, geometry.records)
            geometry.is_placed = True


def _mesh(node: Node) -> Mesh:
    assert node.mesh is not None
    return node.mesh
