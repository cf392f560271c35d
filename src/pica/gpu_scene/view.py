"""A view of a scene: the scene's copy on the device, and what of it depends on who looks."""

from weakref import finalize

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.bounds import Box
from pica.gpu_scene.draws import DrawList
from pica.gpu_scene.geometry import GeometryBuffers
from pica.gpu_scene.label_snapshot import snapshot
from pica.gpu_scene.lights.light_table import LightTable
from pica.gpu_scene.placement import Placement
from pica.gpu_scene.previous_frame import PreviousPlaces, PreviousPositions
from pica.gpu_scene.scene import GpuScene
from pica.gpu_scene.view_geometry import ViewGeometry
from pica.images.labels import Labels
from pica.programs.material_types import MaterialTypeSet
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.rt_view import RtView
from pica.rhi.tables import rows_of_ranges
from pica.scene.camera import Camera
from pica.scene.model import Node, Scene
from pica.settings import Settings


class SceneView:
    """What a renderer or a path tracer has of a scene, in one parameter block.

    Most of it is the scene's one copy on the device, which all views share. A view's own is where things were in its
    frame before, and what follows its camera: so views neither write into the user's scene nor see of each other.
    """

    def __init__(self, device: Device, scene: Scene, settings: Settings) -> None:
        self._device = device = device.memory_scope()
        self.scene = gpu = GpuScene.of(device, scene)
        self._transparent_shadows = settings.shadows.transparent
        self.own = ViewGeometry(device, gpu)
        self.places = PreviousPlaces(device)
        self.positions = PreviousPositions(device, gpu.geometry)
        self.revision = 0
        """Counts the view's frames in which anything but the camera differed from the frame before."""
        self.lights_changed = True
        """Whether what shines differs from the view's frame before, after `update`."""
        self._seen = (-1, -1)
        self._lights_seen = (-1, 0)
        self._own_lights: LightTable | None = None
        self._lights_for = (0, 0)
        self._lights_moved = 0
        every = np.arange(gpu.instance_table.count)
        self.places.note(every[:0], every)
        self.positions.on_meshes_added(deformation.mesh for deformation in gpu.deformations.values())
        self.block = device.parameter_block("gpu_scene/scene.slang", "scene")
        self._environment_revision = -1
        self._bind()
        gpu.views.add(self)
        self._finalizer = finalize(self, device.lock.defer, self.own.close)
        self._finalizer.atexit = False

    def close(self) -> None:
        """Give back what the view has of the scene; it cannot be used any more."""
        self.scene.views.discard(self)
        self._finalizer()

    @property
    def source(self) -> Scene:
        """What it is a view of."""
        return self.scene.source

    @property
    def geometry(self) -> GeometryBuffers:
        """Vertices and indices of every mesh."""
        return self.scene.geometry

    @property
    def lights(self) -> LightTable:
        """Everything that shines."""
        return self._own_lights or self.scene.lights

    @property
    def environment_revision(self) -> int:
        """Counts how often the environment was replaced."""
        return self.scene.environment.revision

    @property
    def records(self) -> NDArray[np.void]:
        """RECORD rows; the G-buffer's ids count them."""
        return self.scene.record_table.rows

    @property
    def instances(self) -> NDArray[np.void]:
        """INSTANCE rows, by a record's `instance`."""
        return self.scene.instance_table.rows

    @property
    def bounds(self) -> Box:
        """As GpuScene.bounds."""
        return self.scene.bounds

    @property
    def rt_scene(self) -> RtView:
        """What its rays meet."""
        return self.own.rt

    def draws(self, recording: Recording) -> list[DrawList]:
        """What the camera's raster draws, opaque sections first. Records the upload of what changed."""
        return _opaque_first([*self.scene.records.draws(recording), *self.own.records.draws(recording)])

    def casters(self, recording: Recording) -> list[DrawList]:
        """Triangles that may throw a shadow, whatever their masks: likewise."""
        return _opaque_first([*self.scene.records.casters(recording), *self.own.records.casters(recording)])

    @property
    def material_types(self) -> MaterialTypeSet:
        """The material types in use; programs that evaluate materials are built for them."""
        return self.scene.materials.types

    @property
    def pending_programs(self) -> int:
        """How many programs are still to be made for material types on their way."""
        return self.scene.pending_programs

    @property
    def transparent(self) -> bool:
        """Whether shadow rays go on through some surfaces; otherwise they only ask whether something is there."""
        return self._transparent_shadows and bool(self.scene.materials.transparent)

    def labels(self) -> NDArray[np.uint32]:
        """(records, 2) the node and the material of each record as they are now, both counted from 1."""
        records = self.records
        return np.stack([self.instances["node"][records["instance"]], records["material"] + 1], axis=1)

    def name_labels(self) -> Labels:
        """Who bears the numbers that `labels` gives, as they are now."""
        return snapshot(self.source, self.scene.arrivals.numbers, self.scene.materials.numbered())

    def configure(self, settings: Settings) -> None:
        """Follow other settings."""
        self._transparent_shadows = settings.shadows.transparent
        self._bind()

    def make_programs(self) -> None:
        """Before its first frame, once it is up to date: see MaterialTable.make_programs."""
        self.scene.materials.make_programs()

    def sync(self, wait: bool = True) -> None:
        """Take in what changed, before a frame begins; as GpuScene.sync."""
        self.scene.sync(wait)

    def update(self, recording: Recording, camera: Camera) -> bool:
        """Begin a frame: record the upload of changes since the last frame of any view, and of this view's own data.

        True if anything but the camera differs from this view's previous frame. Calls `sync` if that has not run yet.
        """
        self.scene.update(recording)
        self.own.update(recording, camera)
        self.places.update(recording, self.instances["to_world"])
        self.positions.update(recording.encoder)
        self._update_lights(recording)
        self.scene.flush(recording)
        self._bind()
        seen = self.scene.revision, self.own.revision
        lights = self.scene.lights_revision, self.own.revision if self._own_lights is not None else 0
        self.lights_changed, self._lights_seen = lights != self._lights_seen, lights
        changed, self._seen = seen != self._seen, seen
        self.revision += changed
        return changed

    def on_nodes_added(self, placements: dict[Node, Placement]) -> None:
        """Nodes are shown from now on."""
        instances = rows_of_ranges(placement.instances for placement in placements.values())
        self.places.note(instances[:0], instances)
        self.own.touch([node for node, placement in placements.items() if placement.mesh is None])
        meshes = (placement.mesh for placement in placements.values())
        self.positions.on_meshes_added(mesh for mesh in meshes if mesh is not None and mesh.previous is not None)

    def on_node_removed(self, node: Node, placement: Placement) -> None:
        """A node is shown no more."""
        if placement.mesh is None:
            self.own.touch([node])
        else:
            self.positions.on_mesh_removed(placement.mesh)

    def _update_lights(self, recording: Recording) -> None:
        """A table of the view's own where something shines that only this view shows so."""
        scene, own = self.scene, self.own.records
        made = scene.lights_made, own.emissive.revision
        if made != self._lights_for:
            self._lights_for = made
            if self._own_lights is not None:
                self._device.give_back(*self._own_lights.buffers())
            # Those of all views come first, so that their records' numbers hold in every view.
            self._own_lights = scene.light_table(own.emissive) if own.emissive else None
            own.number_emissive(len(scene.records.emissive.rows))
        elif self._own_lights is not None and scene.lights_moved != self._lights_moved:
            self._own_lights.update(recording.encoder, scene.placed_lights)
        self._lights_moved = scene.lights_moved

    def _bind(self) -> None:
        """Let the block know where everything is now."""
        scene, geometry = self.scene, self.scene.geometry
        if self._environment_revision != scene.environment.revision:
            self._environment_revision = scene.environment.revision
            self.block.bind(environment=scene.environment.fields)
        self.block.bind(
            positions=geometry.positions,
            previousPositions=self.positions.buffer,
            ownPreviousPositions=self.own.previous.buffer,
            vertices=geometry.vertices,
            indices=geometry.indices,
            boxes=geometry.primitives.boxes,
            shapeNumbers=geometry.primitives.numbers,
            records=scene.record_table.buffer,
            instances=scene.instance_table.buffer,
            previousPlaces=self.places.buffer,
            materials=scene.materials.table.buffer,
            masked=int(scene.masked or self.lights.masked),
            transparent=int(self.transparent),
            **self.lights.parameters,
        )


def _opaque_first(draws: list[DrawList]) -> list[DrawList]:
    """So that they hide what is costlier to shade."""
    return sorted(draws, key=lambda drawn: not drawn.kind.opaque)
