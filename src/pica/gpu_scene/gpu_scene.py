"""A scene's copy on a device: made once, shared by all views, and updated incrementally."""

from collections.abc import Set
from typing import TYPE_CHECKING
from weakref import WeakSet, WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.arrivals import Arrivals
from pica.gpu_scene.deformation.deformation import Deformation, check_deforming, deform_all, deformation_of
from pica.gpu_scene.draws import is_mirrored
from pica.gpu_scene.edits import Edit, Edits
from pica.gpu_scene.geometry import GeometryBuffers
from pica.gpu_scene.lights.background_map import BackgroundMap
from pica.gpu_scene.lights.emissive_triangles import EmissiveTriangles
from pica.gpu_scene.lights.environment_map import EnvironmentMap
from pica.gpu_scene.lights.light_table import LightTable
from pica.gpu_scene.lights.placed_lights import PlacedLights
from pica.gpu_scene.masks import INSTANCE_MASK, is_masked, mask_and_channels
from pica.gpu_scene.materials import MaterialTable
from pica.gpu_scene.pending_nodes import PendingNodes
from pica.gpu_scene.placement import Placement
from pica.gpu_scene.record_set import RecordSet
from pica.gpu_scene.scene_bounds import grown
from pica.gpu_scene.table_rows import INSTANCE, RECORD
from pica.programs.scene_features import features_of_scene
from pica.rhi.acceleration import RtScene
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import HostTable, rows_of_runs
from pica.scene import scene_gc
from pica.scene.changes import Changes
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.illumination import average_emission
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scene.node import worth_checking

if TYPE_CHECKING:
    from pica.gpu_scene.view import SceneView

_NOTHING = np.zeros(0, np.int64)


class GpuScene:
    """The data that all views of a scene share on a device: geometry, materials, lights and transforms.

    Added, removed, moved and deformed nodes cost work; static ones cost nothing. Nodes that follow the camera have an
    instance here, and geometry in each view. It is freed with its last view.
    """

    def __init__(self, device: Device, scene: Scene) -> None:
        """Use GpuScene.of."""
        self.source = scene
        self._device = device
        self.views: WeakSet[SceneView] = WeakSet()
        self._changes = scene.subscribe()
        self._due: Changes | None = None
        self._moves: tuple[list[Node], NDArray[np.float32]] = [], np.zeros((0, 3, 4), np.float32)
        """Of the pending changes: moved nodes, and their instances' new transforms, node by node."""
        self.geometry = GeometryBuffers(device, scene.origin)
        self.materials = MaterialTable(device, self._changes)
        self.instance_table = HostTable(device, "instances", INSTANCE)
        self.record_table = HostTable(device, "records", RECORD)
        self.records = self.record_set()
        self.rt_scene = RtScene(device)
        self._pending_nodes = PendingNodes(device, self.materials)
        self.placements: dict[Node, Placement] = {}
        """Of all nodes that are shown."""
        self.deformations: dict[Node, Deformation] = {}
        """Of nodes whose meshes deform for all views alike."""
        nodes = list(scene.nodes())
        for node in nodes:
            check_deforming(node)
        scene.check()
        self._edits = Edits(self._changes, self.materials, self.geometry)
        self._edits.follow(nodes)
        self.bounds = scene.bounds()
        """Lowest and highest corner (3,) of the bounds of everything shown so far: they never shrink."""
        self.revision = 0
        """Counts updates that changed anything."""
        self.content_revision = 0
        """Counts updates in which records came, went, or got other materials."""
        self.lights_revision = 0
        """Counts updates that changed emitted or reflected light."""
        self.lights_made = self.lights_moved = 0
        """Count rebuilds of `lights`, and updates of its rows alone."""
        self.placed_lights = PlacedLights()
        self._lights_for = (0, 0, 0)
        self._masked: set[Node] = set()
        self.arrivals = Arrivals(self.instance_table, self.records, self.geometry, self.rt_scene)
        self.environment = EnvironmentMap(device, scene.environment)
        self.background = BackgroundMap(device, scene.background)
        self.lights = self.light_table()
        with device.record() as recording:
            self._grow_bounds(self._add(recording, nodes))
            for node in nodes:
                if node.light is not None:
                    self.placed_lights.follow(node)
            self.materials.know(features_of_scene(scene))
        self.geometry.build_compact()
        with device.record() as recording:
            deform_all(recording, list(self.deformations.values()))
            self.arrivals.place_objects(self.placements.values())
            self._make_lights()
            self.flush(recording)
            self.rt_scene.build(recording)

    @staticmethod
    def of(device: Device, scene: Scene) -> "GpuScene":
        """The device's copy of a scene; made if there is none."""
        copies = device.shared(_Copies).by_scene
        gpu_scene = copies.get(id(scene))
        if gpu_scene is None:
            scene_gc.collect()
            scene_gc.watch(scene)
            gpu_scene = copies[id(scene)] = GpuScene(device.memory_scope(), scene)
        return gpu_scene

    def record_set(self) -> RecordSet:
        """An empty set of records in the scene's table."""
        return RecordSet(self._device, self.record_table, self.instance_table, self.geometry, self.materials)

    @property
    def pending_programs(self) -> int:
        """How many programs are still to be made for material types on their way."""
        return self._pending_nodes.pending

    @property
    def masked(self) -> bool:
        """Whether some light does not reach some mesh, or shadow rays and surface rays differ about one."""
        return bool(self._masked)

    def sync(self, wait: bool = True) -> None:
        """Collect the scene's changes before a frame of some view begins. Without `wait`, nodes of new material types
        stay hidden until their programs are compiled (pending_nodes.py).

        Raises MaterialTypeError for a type with a fault; frames can continue without its nodes. Raises SceneError for
        invalid content before any of it is uploaded: each time, until it is fixed or removed.
        """
        changes = self._changes.take()
        self._pending_nodes.forget(changes.removed)
        self._pending_nodes.expect(changes.added)
        self._pending_nodes.expect_lights([node for node in changes.altered if node in self.source])
        self._edits.follow(changes.added)
        self._pending_nodes.expect_edits(self._edits.needed(changes, self.source))
        if self._due is not None:  # an error prevented their upload, or another view's frame has not begun
            changes = self._due.then(changes)
        self._due = changes
        self._check(changes)
        self._moves = self._moves_of(changes)
        if wait:
            self._pending_nodes.finish()
        else:
            self._pending_nodes.step()
        edits = self._pending_nodes.ready_edits
        self._edits.check(edits)
        for node in self._shown_by(edits):
            node.check()
            check_deforming(node)

    def update(self, recording: Recording) -> None:
        """Record the upload of changes since the last frame of any view. Calls `sync` if that has not run yet."""
        if self._due is None:
            self.sync()
        assert self._due is not None
        changes, self._due = self._due, None
        self._update(recording, changes)

    def _check(self, changes: Changes) -> None:
        """Raises SceneError for invalid content. Nodes may have been removed again since they changed."""
        for node in (*changes.moved, *changes.altered):
            if node.light is not None and node in self.source:
                node.check()
        new_meshes: dict[int, Mesh] = {}
        added = [node for node in changes.added if node in self.source]
        for node in worth_checking(added):
            node.check()
        for node in added:
            check_deforming(node)
            if node.mesh is not None and not self.geometry.has(node.mesh):
                new_meshes[id(node.mesh)] = node.mesh
        for mesh in new_meshes.values():
            mesh.check()

    def _shown_by(self, edits: list[Edit]) -> list[Node]:
        """The nodes that show one of the meshes among these."""
        meshes = {edit for edit in edits if isinstance(edit, Mesh)}
        return [node for node in self.source.nodes() if node.mesh in meshes] if meshes else []

    def _moves_of(self, changes: Changes) -> tuple[list[Node], NDArray[np.float32]]:
        """Raises SceneError for a place that 32-bit floats do not hold."""
        removed = set(changes.removed)
        moved = [node for node in changes.moved if node in self.placements and node not in removed]
        if not moved:
            return [], np.zeros((0, 3, 4), np.float32)
        places = [node.instance_transforms()[:, :3] for node in moved]
        with np.errstate(over="ignore"):
            now = np.concatenate(places).astype(np.float32)
        if not np.isfinite(now).all():
            for node in moved:
                node.check()
        return moved, now

    def _update(self, recording: Recording, changes: Changes) -> None:
        ready, relit, edits, switched = self._pending_nodes.take()
        self._relight(self._edits.take(edits))
        waiting = set(self._pending_nodes.waiting)
        again = [node for node in self._shown_by(edits) if node not in ready and node not in waiting]
        for node in (*changes.removed, *again):
            self._remove(node)
        added = self._add(recording, [*ready, *again])
        self._grow_bounds(added)
        self.geometry.build(recording.encoder)
        moved, now = self._moves
        self._move(moved, now)
        deformed = self._deform(recording, dict.fromkeys((*changes.deformed, *added)))
        self.arrivals.place_objects([self.placements[node] for node in added])
        masked = [node for node in changes.altered if self._mask(node)]
        lights_moved = self._follow_lights(ready, relit, changes)
        if self.source in edits and self.environment.source is not self.source.environment:
            self.environment.replace(self.source.environment)
        if self.source in edits and self.background.source is not self.source.background:
            self.background.replace(self.source.background)
        lights_differ = self._lights_for != self._lights_source()
        if lights_differ:
            self._make_lights()
        elif lights_moved:
            self.lights.update(recording.encoder, self.placed_lights)
            self.lights_moved += 1
        differs = changes.removed or added or moved or masked or switched or deformed
        if differs or lights_differ or lights_moved or edits:
            self.revision += 1
            self.flush(recording)
        self.content_revision += bool(changes.removed or added or edits or switched)
        shines = any(_shines(node) for node in (*moved, *deformed))
        # Reflected light counts too.
        self.lights_revision += lights_differ or lights_moved or shines or bool(edits)

    def _relight(self, materials: Set[Material]) -> None:
        """Update emissive triangles after a change of these materials' emission."""
        if materials:
            for placement in self.placements.values():
                if placement.mesh is not None:
                    self.records.relight(placement.mesh, placement.records, materials)
            for view in self.views:
                view.own.relight(materials)

    def flush(self, recording: Recording) -> None:
        """Record the upload of the tables."""
        for table in (self.instance_table, self.record_table, self.materials.table):
            table.flush(recording)

    def _add(self, recording: Recording, nodes: list[Node]) -> list[Node]:
        """Upload nodes; their objects follow once their structures are recorded. Returns those that show anything."""
        placements = self.arrivals.place(recording, nodes)
        if not placements:
            return []
        self.placements.update(placements)
        for node, placement in placements.items():
            mesh = placement.mesh
            if mesh is not None and mesh.previous is not None:
                self.deformations[node] = deformation_of(self._device, node, self.geometry, mesh)
        bits = self.instance_table.rows["mask_and_channels"][[p.instances.start for p in placements.values()]]
        masked = np.isin(bits, [mask for mask in np.unique(bits).tolist() if is_masked(mask)])
        self._masked.update(node for node, is_one in zip(placements, masked.tolist(), strict=True) if is_one)
        for view in self.views:
            view.on_nodes_added(placements)
        return list(placements)

    def _remove(self, node: Node) -> None:
        placement = self.placements.pop(node, None)
        if placement is None:
            return
        for view in self.views:
            view.on_node_removed(node, placement)
        self._masked.discard(node)
        self.instance_table.give_back(placement.instances.start, len(placement.instances))
        if placement.mesh is not None:
            self.rt_scene.remove(placement.objects)
            self.records.remove(placement.mesh, placement.records)
            if node in self.deformations:
                self.deformations.pop(node).forget()
            self.geometry.release(placement.mesh)

    def _mask(self, node: Node) -> bool:
        """Upload a node's mask and lighting channels; False if they are unchanged or the node shows nothing."""
        placement = self.placements.get(node)
        if placement is None:
            return False
        instances, now = np.array(placement.instances), mask_and_channels(node)
        rows = self.instance_table.rows["mask_and_channels"]
        before = int(rows[instances[0]])
        if now == before:
            return False
        rows[instances] = now
        self.instance_table.touch(instances)
        if placement.mesh is not None:
            self.rt_scene.mask(placement.objects, now & INSTANCE_MASK)
            self.records.renew(placement.mesh, placement.records)
        else:
            self._tell([node])
        (self._masked.add if is_masked(now) else self._masked.discard)(node)
        return True

    def _move(self, nodes: list[Node], now: NDArray[np.float32]) -> None:
        """All at once: a hundred small NumPy calls cost more than their arithmetic."""
        placements = [self.placements[node] for node in nodes]
        if not placements:
            return
        counts = np.array([len(p.instances) for p in placements])
        parts = np.array([len(p.objects) for p in placements]) // np.maximum(counts, 1)
        instances = rows_of_runs(np.array([p.instances.start for p in placements]), counts)
        objects = rows_of_runs(np.array([p.objects.start for p in placements]), counts * parts)
        to_world = self.instance_table.rows["to_world"]
        before = to_world[instances]
        to_world[instances] = now
        identified = [
            placement.instances.start + np.flatnonzero(placement.take_replaced(node))
            for placement, node in zip(placements, nodes, strict=True)
            if placement.identities is not None or node.identities is not None
        ]
        come = np.concatenate(identified) if identified else _NOTHING
        for view in self.views:
            view.places.note(instances, come)
        self.instance_table.touch(instances)
        self._grow_bounds(nodes)
        if len(objects):
            self.rt_scene.move(objects, np.repeat(now, np.repeat(parts, counts), axis=0))
        turned = is_mirrored(before) != is_mirrored(now)
        for index in np.unique(np.repeat(np.arange(len(placements)), counts)[turned]).tolist():
            placement = placements[index]
            if placement.mesh is not None:
                self.records.renew(placement.mesh, placement.records)
        self._tell(nodes)

    def _tell(self, nodes: list[Node]) -> None:
        """Mark nodes that follow the camera as changed in all views."""
        followers = [node for node in nodes if self.placements[node].mesh is None]
        if followers:
            for view in self.views:
                view.own.touch(followers)

    def _grow_bounds(self, nodes: list[Node]) -> None:
        if nodes:
            placements = {node: self.placements[node] for node in nodes}
            self.bounds = grown(self.bounds, placements, self.instance_table.rows, self.record_table.rows)

    def _deform(self, recording: Recording, nodes: dict[Node, None]) -> list[Node]:
        """Write the vertices of the deforming nodes; returns these and the nodes that views deform."""
        deformations = [self.deformations[node] for node in nodes if node in self.deformations]
        for view in self.views:
            view.positions.before_deforming(recording.encoder, [d.mesh for d in deformations])
        deform_all(recording, deformations)
        if deformations:
            self.rt_scene.changed()
        set_anew = [n for n in nodes if n in self.placements and isinstance(n.deformer, DynamicVertices)]
        if set_anew:
            self._grow_bounds(set_anew)
        followers = [node for node in nodes if node in self.placements and self.placements[node].mesh is None]
        self._tell(followers)
        return [*(node for node in nodes if node in self.deformations), *followers]

    def _follow_lights(self, ready: list[Node], relit: list[Node], changes: Changes) -> bool:
        """Update the nodes' lights; False if no remaining light has moved or was set."""
        for node in changes.removed:
            if node not in self.source:
                self.placed_lights.remove(node)
        changed = *relit, *changes.moved, *changes.altered
        stay = [node for node in changed if self.placed_lights.has(node) or node.light]
        shining = [node for node in ready if node.light is not None]
        awaits_programs = self._pending_nodes.awaits_programs
        for node in dict.fromkeys(node for node in (*shining, *stay) if not awaits_programs(node)):
            self.placed_lights.follow(node)
        return bool(stay)

    def light_table(self, own: EmissiveTriangles | None = None) -> LightTable:
        """A table of all lights; emissive triangles of one view come after those of all views."""
        triangles = [self.records.emissive] if own is None else [self.records.emissive, own]
        low, high = self.bounds
        # In steps: what moves a little leaves the selection of lights as it is.
        radius = 2 ** (round(4 * np.log2(max(float(np.linalg.norm(high - low)), 1e-30))) / 4) / 2
        return LightTable(self._device, self.placed_lights, triangles, self.environment, radius)

    def _lights_source(self) -> tuple[int, int, int]:
        """Revisions of the light table's inputs."""
        return self.placed_lights.revision, self.records.emissive.revision, self.environment.revision

    def _make_lights(self) -> None:
        self._device.give_back(*self.lights.buffers())
        self._lights_for = self._lights_source()
        self.lights = self.light_table()
        self.lights_made += 1


class _Copies:
    """A device's copies of scenes, by the scene's id: a copy keeps its scene alive."""

    def __init__(self, device: Device) -> None:
        self.by_scene: WeakValueDictionary[int, GpuScene] = WeakValueDictionary()


def _shines(node: Node) -> bool:
    return node.mesh is not None and any(average_emission(section.material) > 0 for section in node.mesh.sections)
