"""Adds nodes to a scene's GPU copy, in batches: many small NumPy calls cost more than their arithmetic."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from weakref import WeakKeyDictionary

import numpy as np

from pica.gpu_scene.geometry import GeometryBuffers, GpuMesh
from pica.gpu_scene.masks import mask_and_channels
from pica.gpu_scene.placement import Placement
from pica.gpu_scene.record_set import RecordSet
from pica.rhi.acceleration import RtScene
from pica.rhi.passes import Recording
from pica.rhi.tables import HostTable, rows_of_ranges, rows_of_runs
from pica.scene.model import Node
from pica.scene.node import all_instance_transforms


class Arrivals:
    """Allocates table rows for nodes, in two steps: objects need the structures that the first one uploads."""

    def __init__(self, instances: HostTable, records: RecordSet, geometry: GeometryBuffers, rt_scene: RtScene) -> None:
        """The tables of the scene."""
        self._instances, self._records = instances, records
        self._geometry, self._rt_scene = geometry, rt_scene
        self.numbers: WeakKeyDictionary[Node, int] = WeakKeyDictionary()
        """Label numbers, counted from 1 in order of addition; a node that is added again keeps its number."""
        self._count = 0

    def place(self, recording: Recording, nodes: list[Node]) -> dict[Node, Placement]:
        """Upload the nodes' meshes and instances; returns placements of the nodes that show anything."""
        self._number(nodes)
        visible = [node for node in nodes if _shows_something(node)]
        transforms, counts = all_instance_transforms(visible)
        firsts = self._instances.take_runs(counts)
        instances, rows = rows_of_runs(firsts, counts), self._instances.rows
        rows["to_world"][instances] = transforms[:, :3]
        rows["node"][instances] = np.repeat(np.array([self.numbers[node] for node in visible], np.int64), counts)
        masks = np.array([mask_and_channels(node) for node in visible], np.uint32)
        rows["mask_and_channels"][instances] = np.repeat(masks, counts)
        placements = {
            node: Placement(range(first, first + count), node.identities)
            for node, first, count in zip(visible, firsts.tolist(), counts.tolist(), strict=True)
        }
        self._show(recording, placements)
        return placements

    def place_objects(self, placements: Iterable[Placement]) -> None:
        """Add objects to the top-level structure once their bottom levels are recorded."""
        for mesh, alike in _by_mesh(placements):
            records = rows_of_ranges(placement.records for placement in alike)
            objects = rows_of_ranges(placement.objects for placement in alike)
            for placing in self._records.objects(mesh, records, objects):
                self._rt_scene.place(*placing)

    def _number(self, nodes: list[Node]) -> None:
        for node in nodes:
            if node not in self.numbers:
                self._count += 1
                self.numbers[node] = self._count

    def _show(self, recording: Recording, placements: dict[Node, Placement]) -> None:
        for node, placement in placements.items():
            if not node.follows_camera:
                assert node.mesh is not None
                previous = self._geometry.previous if node.deforms else None
                placement.mesh = self._geometry.acquire(recording.encoder, node.mesh, previous)
        for mesh, alike in _by_mesh(placements.values()):
            all_records = self._records.add(mesh, [placement.instances for placement in alike])
            counts = np.array([len(placement.instances) * len(mesh.parts) for placement in alike])
            firsts = self._rt_scene.slots.take_runs(counts)
            for placement, records, first, count in zip(
                alike, all_records, firsts.tolist(), counts.tolist(), strict=True
            ):
                placement.records, placement.objects = records, range(first, first + count)


def _shows_something(node: Node) -> bool:
    mesh, instances = node.mesh, node.instances
    return mesh is not None and bool(mesh.sections or mesh.primitives) and (instances is None or len(instances) > 0)


def _by_mesh(placements: Iterable[Placement]) -> Iterator[tuple[GpuMesh, list[Placement]]]:
    """Placements shared by all views, grouped by mesh."""
    groups: defaultdict[GpuMesh, list[Placement]] = defaultdict(list)
    for placement in placements:
        if placement.mesh is not None:
            groups[placement.mesh].append(placement)
    yield from groups.items()
