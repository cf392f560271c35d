"""A scene's copy on the GPU: built once, then told what moved."""

from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.arrivals import Arrivals
from pica.gpu_scene.bounds import joined, world_box
from pica.gpu_scene.deformation import Deformation
from pica.gpu_scene.draws import DrawList, draw_lists, is_mirrored, section_draws
from pica.gpu_scene.environment import environment_map
from pica.gpu_scene.geometry import GeometryBuffers
from pica.gpu_scene.lights import EmissiveSection, LightTable
from pica.gpu_scene.masks import SEEN_BY_CAMERA, SEEN_BY_SURFACES, instance_mask, is_masked, mask_and_channels
from pica.gpu_scene.materials import MaterialTable, average_emission
from pica.gpu_scene.placement import INSTANCE, NOT_EMISSIVE, RECORD, Placement, rows_of_runs
from pica.rhi.acceleration import RtObject, RtScene
from pica.rhi.device import Device
from pica.rhi.material_types import MaterialTypeSet
from pica.rhi.passes import Recording
from pica.rhi.tables import HostTable
from pica.scene.camera import Camera
from pica.scene.changes import Changes
from pica.scene.model import Node, Scene, Section
from pica.scene.primitives import Primitives


class GpuScene:
    """Everything that shaders know of a scene, in one parameter block.

    Nodes that come, go, move or deform cost what they are; those that stand still cost nothing but the top level.
    """

    def __init__(self, device: Device, scene: Scene, rebuild_at: float, transparent_shadows: bool = True) -> None:
        """`rebuild_at`: GeometrySettings.rebuild_at; `transparent_shadows`: ShadowsSettings.transparent."""
        self.source = scene
        self._device, self._rebuild_at = device, rebuild_at
        self._transparent_shadows = transparent_shadows
        self._changes = scene.subscribe()
        self.geometry = GeometryBuffers(device)
        self.materials = MaterialTable(device)
        self._arrivals = Arrivals(device, self.materials)
        self._due: Changes | None = None
        self._instances = HostTable(device, "instances", INSTANCE)
        self._records = HostTable(device, "records", RECORD)
        self.rt_scene = RtScene(device)
        self._deformations: dict[Node, Deformation] = {}
        self._placements: dict[Node, Placement] = {}
        self._record_sections: dict[int, Section | Primitives] = {}
        self.bounds = scene.bounds()
        """Lowest and highest corner (3,) of a box round all that has been shown so far: it grows, and never shrinks."""
        self.revision = 0
        """Counts the updates that changed anything but the camera."""
        self._masked: set[Node] = set()
        self._numbers: WeakKeyDictionary[Node, int] = WeakKeyDictionary()
        self._node_count = 0
        self._facing: dict[Node, None] = {}
        self._just_moved: list[Node] = []
        self._just_deformed: list[Node] = []
        self.lights = LightTable(device, scene, [])
        self.block = device.parameter_block("shaders/scene.slang", "scene")
        self.block.bind(environment=environment_map(device, scene.environment))
        with device.record() as recording:
            for node in scene.nodes():
                self._add(recording, node)
        self.geometry.build_compact()
        with device.record() as recording:
            self._deform_all(recording, list(self._deformations))
            self._place_objects(list(self._placements))
            self._make_lights()
            self._flush(recording)

    @property
    def records(self) -> NDArray[np.void]:
        """RECORD rows; the G-buffer's ids count them."""
        return self._records.rows

    @property
    def instances(self) -> NDArray[np.void]:
        """INSTANCE rows, by a record's `instance`."""
        return self._instances.rows

    @property
    def material_types(self) -> MaterialTypeSet:
        """The material types in use; programs that evaluate materials are built for them."""
        return self.materials.types

    @property
    def pending_programs(self) -> int:
        """How many programs are still to be made for material types on their way."""
        return self._arrivals.pending

    @property
    def transparent(self) -> bool:
        """Whether shadow rays go on through some surfaces; otherwise they only ask whether something is there."""
        return self._transparent_shadows and bool(self.materials.transparent)

    def labels(self) -> NDArray[np.uint32]:
        """(records, 2) the node and the material of each record as they are now, both counted from 1."""
        records = self.records
        return np.stack([self.instances["node"][records["instance"]], records["material"] + 1], axis=1)

    @cached_property
    def draws(self) -> list[DrawList]:
        """What the camera's raster draws; made when first asked for after a change."""
        every = self._every_record()
        masks = self.instances["mask_and_channels"][self.records["instance"][every]]
        return self._drawn(every[masks & SEEN_BY_CAMERA != 0])

    @cached_property
    def casters(self) -> list[DrawList]:
        """Triangles that may throw a shadow, whatever their masks: likewise."""
        every = self._every_record()
        return self._drawn(every[self.records["shape"][every] == 0])

    def admit(self, wait: bool = True, camera: Camera | None = None) -> None:
        """Take in what changed, before a frame begins. Without `wait`, nodes of new material types stay out until
        their programs are made (arrivals.py). What faces the camera is told it first; None leaves it as it was.

        Raises MaterialTypeError for a type with a fault; frames can go on without what has it.
        """
        if camera is not None:
            for node in (*self._facing, *self._changes.added, *self._arrivals.waiting):
                if node.faces_camera is not None:
                    node.faces_camera.face(camera)
        changes = self._changes.take()
        self._arrivals.forget(changes.removed)
        self._arrivals.expect(changes.added)
        if self._due is not None:  # a fault has kept these from their frame
            changes = self._due.then(changes)
        self._due = changes
        if wait:
            self._arrivals.finish()
        else:
            self._arrivals.step()

    def update(self, recording: Recording, camera: Camera | None = None) -> bool:
        """Upload what changed since the last frame and rebuild the top level; True when anything did.

        Takes in what changed, with `camera`, unless `admit` did.
        What moved or deformed in the frame before is brought up to date once more, as it stands still now.
        """
        if self._due is None:
            self.admit(camera=camera)
        assert self._due is not None
        changes, self._due = self._due, None
        come, switched = self._arrivals.take()
        for node in changes.removed:
            self._remove(node)
        added = [node for node in come if self._add(recording, node)]
        self.geometry.build(recording.encoder)
        moved = [node for node in changes.moved if node in self._placements]
        self._move([node for node in dict.fromkeys((*self._just_moved, *moved)) if node in self._placements])
        deformed = [node for node in changes.deformed if node in self._deformations]
        deformed += [node for node in added if node in self._deformations]
        again = dict.fromkeys((*self._just_deformed, *deformed))
        self._deform_all(recording, [node for node in again if node in self._deformations])
        self._place_objects(added)
        masked = [node for node in changes.altered if self._mask(node)]
        come_or_gone = (*come, *changes.removed, *masked)
        lights_differ = any(node.light is not None or _shines(node) for node in come_or_gone)
        lights_differ |= any(self.lights.has(node) != (node.light is not None) for node in changes.altered)
        lights_moved = any(node.light is not None for node in (*changes.moved, *changes.altered))
        if lights_differ:
            self._make_lights()
        elif lights_moved:
            self.lights.update(recording.encoder)
        drawn = bool(changes.removed or added or moved or masked or lights_differ or lights_moved or switched)
        if drawn or self._just_moved or again:
            self._flush(recording)
        self._just_moved, self._just_deformed = moved, deformed
        changed = drawn or bool(deformed)
        self.revision += changed
        return changed

    def _add(self, recording: Recording, node: Node) -> bool:
        """Upload what a node shows; its objects follow once its structures are recorded. False: it shows nothing."""
        if node not in self._numbers:
            self._node_count += 1
            self._numbers[node] = self._node_count
        if node.faces_camera is not None:
            self._facing[node] = None
        if node.mesh is None or not (node.mesh.sections or node.mesh.primitives) or not len(node.instance_transforms()):
            return False
        mesh = self.geometry.acquire(recording.encoder, node)
        transforms = node.instance_transforms()[:, :3]
        count, sections = len(transforms), len(mesh.placed)
        first_instance = self._instances.take(count)
        first_record = self._records.take(count * sections)
        first_object = self.rt_scene.slots.take(count * len(mesh.parts))
        materials = [self.materials.acquire(placed.section.material) for placed in mesh.placed]
        shapes = [self.materials.shape_number(placed.hit_group) for placed in mesh.primitives]
        rows = self._instances.rows[first_instance : first_instance + count]
        rows["to_world"] = rows["previous_to_world"] = transforms
        rows["node"] = self._numbers[node]
        rows["first_record"] = first_record + sections * np.arange(count)
        rows["mask_and_channels"] = mask_and_channels(node)
        records = self._records.rows[first_record : first_record + count * sections].reshape(count, sections)
        records["instance"] = first_instance + np.arange(count)[:, None]
        records["material"] = materials
        records["first_emissive"] = NOT_EMISSIVE
        for name in ("first_index", "first_vertex", "first_previous"):
            records[name] = [getattr(placed, name) for placed in mesh.placed]
        records["shape"] = [0] * len(mesh.sections) + shapes
        boxes = np.array([placed.box for placed in mesh.placed], np.float32).reshape(sections, 2, 3)
        records["center"], records["extent"] = boxes[:, 0], -boxes[:, 1] if node.deforms else boxes[:, 1]
        placement = self._placements[node] = Placement(
            instances=range(first_instance, first_instance + count),
            records=range(first_record, first_record + count * sections),
            objects=range(first_object, first_object + count * len(mesh.parts)),
            sections=[placed.section for placed in mesh.placed],
            identities=node.identities,
        )
        self._note_masked(node)
        for index, record in enumerate(placement.records):
            self._record_sections[record] = placement.sections[index % sections]
        if node.deforms:
            self._deformations[node] = Deformation(self._device, node, self.geometry, self._rebuild_at)
        self._forget_draws()
        self._grow_bounds([placement])
        return True

    def _remove(self, node: Node) -> None:
        self._facing.pop(node, None)
        placement = self._placements.pop(node, None)
        if placement is None:
            return
        self._masked.discard(node)
        self.rt_scene.remove(placement.objects)
        self._instances.give_back(placement.instances.start, len(placement.instances))
        self._records.give_back(placement.records.start, len(placement.records))
        for record in placement.records:
            del self._record_sections[record]
        for section in placement.sections:
            self.materials.release(section.material)
        if node in self._deformations:
            self._deformations.pop(node).forget()
        self.geometry.release(node)
        self._forget_draws()

    def _mask(self, node: Node) -> bool:
        """Upload who sees a node and its lighting channels; False: they are as they were, or it shows nothing."""
        placement = self._placements.get(node)
        if placement is None:
            return False
        instances, now = np.array(placement.instances), mask_and_channels(node)
        before = int(self.instances["mask_and_channels"][instances[0]])
        if now == before:
            return False
        self.instances["mask_and_channels"][instances] = now
        self._instances.touch(instances)
        self.rt_scene.mask(placement.objects, instance_mask(node))
        if (now ^ before) & SEEN_BY_CAMERA:
            self._forget_draws()
        self._note_masked(node)
        return True

    def _note_masked(self, node: Node) -> None:
        (self._masked.add if is_masked(node) else self._masked.discard)(node)

    def _move(self, nodes: list[Node]) -> None:
        """All at once: a hundred small NumPy calls cost more than their arithmetic."""
        placements = [self._placements[node] for node in nodes]
        if not placements:
            return
        now = np.concatenate([node.instance_transforms()[:, :3] for node in nodes]).astype(np.float32)
        counts = np.array([len(p.instances) for p in placements])
        parts = np.array([len(p.objects) for p in placements]) // np.maximum(counts, 1)
        instances = rows_of_runs(np.array([p.instances.start for p in placements]), counts)
        objects = rows_of_runs(np.array([p.objects.start for p in placements]), counts * parts)
        before = self.instances["to_world"][instances]
        self.instances["previous_to_world"][instances] = before
        self.instances["to_world"][instances] = now
        for placement, node in zip(placements, nodes, strict=True):
            if placement.identities is not None or node.identities is not None:
                rows = placement.instances.start + np.flatnonzero(placement.have_come(node))
                self.instances["previous_to_world"][rows] = self.instances["to_world"][rows]
        self._instances.touch(instances)
        self._grow_bounds(placements)
        self.rt_scene.move(objects, np.repeat(now, np.repeat(parts, counts), axis=0))
        if (is_mirrored(before) != is_mirrored(now)).any():
            self._forget_draws()

    def _grow_bounds(self, placements: list[Placement]) -> None:
        """Take in where these are now."""
        starts, counts = np.array([(p.records.start, len(p.records)) for p in placements]).T
        records = self.records[rows_of_runs(starts, counts)]
        if not len(records):
            return
        box = world_box(self.instances["to_world"][records["instance"]], records["center"], abs(records["extent"]))
        self.bounds = joined(self.bounds, box)

    def _place_objects(self, nodes: list[Node]) -> None:
        for node in nodes:
            placement, parts = self._placements[node], self.geometry.mesh(node).parts
            for index, slot in enumerate(placement.objects):
                instance = self._instances.rows[placement.instances.start + index // len(parts)]
                part = parts[index % len(parts)]
                placed = RtObject(
                    part.geometry,
                    int(instance["first_record"]) + part.first_section,
                    self.materials.type_number(part.hit_group),
                    part.flags,
                )
                self.rt_scene.place(slot, placed, instance["to_world"], instance_mask(node))

    def _deform_all(self, recording: Recording, nodes: list[Node]) -> None:
        """All vertices first, then all structures: one wait between the two, not one a node."""
        for node in nodes:
            self._deformations[node](recording)
        if nodes:
            recording.profiler.begin(recording.encoder, "bottom level")
            for node in nodes:
                self._deformations[node].update_structures(recording)
            recording.profiler.end(recording.encoder)

    def _forget_draws(self) -> None:
        for lists in ("draws", "casters"):
            for draws in self.__dict__.pop(lists, ()):
                self._device.give_back(draws.arguments)

    def _make_lights(self) -> None:
        shining = [
            (
                EmissiveSection(record, section, instance["to_world"]),
                bool(instance["mask_and_channels"] & SEEN_BY_SURFACES),
            )
            for record, section in self._record_sections.items()
            if isinstance(section, Section) and average_emission(section.material) > 0
            for instance in [self.instances[self.records[record]["instance"]]]
        ]
        self._device.give_back(*self.lights.buffers())
        self.lights = LightTable(self._device, self.source, [emissive for emissive, seen in shining if seen])
        for emissive, _ in shining:
            first = self.lights.first_emissive.get(emissive.record, NOT_EMISSIVE)
            self._records.rows[emissive.record]["first_emissive"] = first
            self._records.touch(np.array([emissive.record]))

    def _flush(self, recording: Recording) -> None:
        """Upload the tables, build the top level, and let the block know where everything is now."""
        for table in (self._instances, self._records, self.materials.table):
            table.flush(recording)
        self.rt_scene.build(recording)
        self.block.bind(
            tlas=self.rt_scene.structure,
            previousTlas=self.rt_scene.previous,
            positions=self.geometry.positions,
            previousPositions=self.geometry.previous_positions,
            vertices=self.geometry.vertices,
            indices=self.geometry.indices,
            boxes=self.geometry.primitives.boxes,
            shapeNumbers=self.geometry.primitives.numbers,
            records=self._records.buffer,
            instances=self._instances.buffer,
            materials=self.materials.table.buffer,
            masked=int(bool(self._masked) or self.lights.masked),
            transparent=int(self.transparent),
            **self.lights.parameters,
        )

    def _every_record(self) -> NDArray[np.int64]:
        return np.fromiter(self._record_sections, np.int64, len(self._record_sections))

    def _drawn(self, records: NDArray[np.int64]) -> list[DrawList]:
        sections = [self._record_sections[record] for record in records.tolist()]
        rows = self.records[records]
        mirrored = is_mirrored(self.instances["to_world"])[rows["instance"]]
        return draw_lists(self._device, section_draws(records, rows, sections, mirrored, self.geometry.first_box_index))


def _shines(node: Node) -> bool:
    return node.mesh is not None and any(average_emission(section.material) > 0 for section in node.mesh.sections)
