"""A view of a scene: the scene's copy on the device, and the data that depends on the view."""

from collections.abc import Iterable
from dataclasses import dataclass
from weakref import finalize

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.bounds import Box
from pica.gpu_scene.draws import DrawList
from pica.gpu_scene.geometry import GeometryBuffers, GpuMesh
from pica.gpu_scene.geometry_store import PlacedSection
from pica.gpu_scene.gpu_scene import GpuScene
from pica.gpu_scene.label_snapshot import snapshot
from pica.gpu_scene.lights.light_table import LightTable
from pica.gpu_scene.placement import Placement
from pica.gpu_scene.previous_frame import PreviousPlaces, PreviousPositions
from pica.gpu_scene.view_geometry import ViewGeometry
from pica.images.labels import Labels
from pica.programs.material_types import MaterialTypeSet
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.rt_view import RtView
from pica.rhi.tables import rows_of_ranges
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.settings import Settings


@dataclass(frozen=True, eq=False)
class RecordSource:
    """What a record is made of."""

    node: Node
    instance: int
    """In `node.instances`; 0 without them."""
    mesh: Mesh
    index: int
    """In `mesh.sections`, or in `mesh.primitives`."""
    has_triangles: bool
    material: Material


class SceneView:
    """A renderer's or path tracer's data of a scene, in one parameter block.

    Most of it is the scene's copy on the device, which all views share. A view has its own previous transforms and its
    own camera-facing geometry, so views neither write into the user's scene nor affect each other.
    """

    def __init__(self, device: Device, scene: Scene, settings: Settings) -> None:
        self._device = device = device.memory_scope()
        self.scene = gpu = GpuScene.of(device, scene)
        self._transparent_shadows = settings.shadows.transparent
        self._leaves_glass = settings.transparency.mode != "off"
        self._meets_layers = settings.transparency.mode != "off"
        self._follows_diffuse = settings.translucency.mode != "off"
        self.own = ViewGeometry(device, gpu)
        self.places = PreviousPlaces(device)
        self.positions = PreviousPositions(device, gpu.geometry)
        self.revision = 0
        """Counts the view's frames in which anything but the camera changed."""
        self.lights_changed = True
        """Whether light sources differ from the view's previous frame, after `update`."""
        self._seen = (-1, -1)
        self._lights_seen = (-1, 0)
        self._own_lights: LightTable | None = None
        self._lights_for = (0, 0)
        self._lights_moved = 0
        every = np.arange(gpu.instance_table.count)
        self.places.note(every[:0], every)
        self.positions.on_meshes_added(deformation.mesh for deformation in gpu.deformations.values())
        self.block = device.parameter_block("gpu_scene/scene.slang", "scene")
        self._environment_revision = self._background_revision = -1
        self.bind()
        gpu.views.add(self)
        self._finalizer = finalize(self, device.lock.defer, self.own.close)
        self._finalizer.atexit = False

    def close(self) -> None:
        """Free the view's own data; the view cannot be used any more."""
        self.scene.views.discard(self)
        self._finalizer()

    @property
    def source(self) -> Scene:
        """The scene."""
        return self.scene.source

    @property
    def geometry(self) -> GeometryBuffers:
        """Vertices and indices of every mesh."""
        return self.scene.geometry

    @property
    def lights(self) -> LightTable:
        """All lights, emissive triangles and the environment."""
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
        """The top-level structure for its rays."""
        return self.own.rt

    def draws(self, recording: Recording) -> list[DrawList]:
        """Draws of the camera's raster pass, opaque sections first. Records the upload of changes."""
        return _opaque_first([*self.scene.records.draws(recording), *self.own.records.draws(recording)])

    def casters(self, recording: Recording) -> list[DrawList]:
        """Triangles that may cast shadows, whatever their masks; order and upload as `draws`."""
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
    def mirrors(self) -> bool:
        """Whether any material may mirror sharply."""
        return self.scene.materials.traits.any("mirror")

    @property
    def transparent(self) -> bool:
        """Whether shadow rays pass through some surfaces; otherwise they only test visibility."""
        return self._transparent_shadows and self.scene.materials.traits.any("transmissive")

    @property
    def glass_apart(self) -> bool:
        """Whether the G-buffer leaves transmissive surfaces and layers of blended ones out, and there are any."""
        return self.shows_glass or self.shows_layers

    @property
    def shows_glass(self) -> bool:
        """Whether there are transmissive surfaces, and the transparency pass shows them."""
        return self._leaves_glass and self.scene.materials.traits.any("transmissive")

    @property
    def shows_rough_glass(self) -> bool:
        """Whether what lies behind any of them is blurred."""
        return self.shows_glass and self.scene.materials.traits.any("rough_transmissive")

    @property
    def shows_layers(self) -> bool:
        """Whether there are blended surfaces, and the transparency pass shows their layers."""
        return self._meets_layers and self.scene.materials.traits.any("blended")

    @property
    def translucent(self) -> bool:
        """Whether there are surfaces with diffuse transmission, and the light that passes them is followed."""
        return self._follows_diffuse and self.scene.materials.traits.any("translucent")

    @property
    def sheets(self) -> bool:
        """Whether some of these are thin-walled."""
        return self._follows_diffuse and self.scene.materials.traits.any("sheet")

    def moving_emitters(self) -> NDArray[np.int64]:
        """Records of emissive meshes whose instances have moved since the view's previous frame."""
        records = self.scene.records.emissive.records()
        return records[np.isin(self.records["instance"][records], self.places.moved)]

    def labels(self) -> NDArray[np.uint32]:
        """(records, 2) the node and the material of each record as they are now, both counted from 1."""
        records = self.records
        return np.stack([self.instances["node"][records["instance"]], records["material"] + 1], axis=1)

    def name_labels(self) -> Labels:
        """The names behind the numbers of `labels`, as they are now."""
        return snapshot(self.source, self.scene.arrivals.numbers, self.scene.materials.numbered())

    def numbers_of(self, nodes: Iterable[Node]) -> list[int]:
        """The numbers of nodes in `labels`, of those that are on the device."""
        numbers = self.scene.arrivals.numbers
        return [numbers[node] for node in nodes if node in numbers]

    def source_of(self, record: int) -> RecordSource:
        """What a record is made of, as it is now on the device."""
        row = int(self.records["instance"][record])
        number = int(self.instances["node"][row])
        numbers = self.scene.arrivals.numbers
        node, placement = next(item for item in self.scene.placements.items() if numbers[item[0]] == number)
        mesh, records = self._shown(node)
        part = mesh.placed[(record - records.start) % len(mesh.placed)]
        return RecordSource(
            node=node,
            instance=row - placement.instances.start,
            mesh=mesh.mesh,
            index=part.index,
            has_triangles=isinstance(part, PlacedSection),
            material=part.section.material,
        )

    def records_of(self, node: Node) -> range:
        """The records of a node that is on the device."""
        return self._shown(node)[1]

    def _shown(self, node: Node) -> tuple[GpuMesh, range]:
        placement = self.scene.placements[node]
        return self.own.shown(node) if placement.mesh is None else (placement.mesh, placement.records)

    def configure(self, settings: Settings) -> None:
        """Follow other settings."""
        self._transparent_shadows = settings.shadows.transparent
        self._leaves_glass = settings.transparency.mode != "off"
        self._meets_layers = settings.transparency.mode != "off"
        self._follows_diffuse = settings.translucency.mode != "off"
        self.bind()

    def make_programs(self) -> None:
        """Compile missing programs before the first frame, once the view is up to date: MaterialTable.make_programs."""
        self.scene.materials.make_programs()

    def sync(self, wait: bool = True) -> None:
        """Collect the scene's changes before a frame begins; as GpuScene.sync."""
        self.scene.sync(wait)

    def update(self, recording: Recording, camera: Camera, follows: bool = False) -> bool:
        """Begin a frame: record the upload of changes since the last frame of any view, and of this view's own data.

        True if anything but the camera differs from this view's previous frame. Calls `sync` if that has not run yet.
        `follows`: another view of the scene has begun a frame just before, with which it is recorded.
        """
        if not follows:
            self.scene.update(recording)
        self.own.update(recording, camera)
        self.places.update(recording, self.instances["to_world"])
        self.positions.update(recording.encoder)
        self._update_lights(recording)
        if not follows:
            self.scene.flush(recording)
            self.bind()
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
        """The view has a light table of its own if it has emissive camera-facing geometry."""
        scene, own = self.scene, self.own.records
        made = scene.lights_made, own.emissive.revision
        if made != self._lights_for:
            self._lights_for = made
            if self._own_lights is not None:
                self._device.give_back(*self._own_lights.buffers())
            # Triangles of all views come first, so that their records' numbers are valid in every view.
            self._own_lights = scene.light_table(own.emissive) if own.emissive else None
            own.number_emissive(len(scene.records.emissive.rows))
        elif self._own_lights is not None and scene.lights_moved != self._lights_moved:
            self._own_lights.update(recording.encoder, scene.placed_lights)
        self._lights_moved = scene.lights_moved

    def bind(self) -> None:
        """Bind the current buffers to the parameter block. `update` does, before other views may replace them."""
        scene, geometry = self.scene, self.scene.geometry
        if self._environment_revision != scene.environment.revision:
            self._environment_revision = scene.environment.revision
            self.block.bind(environment=scene.environment.fields)
        if self._background_revision != scene.background.revision:
            self._background_revision = scene.background.revision
            self.block.bind(backgroundMap=scene.background.fields)
        self.block.bind(
            positions=geometry.positions,
            previousPositions=self.positions.buffer,
            ownPreviousPositions=self.own.previous.buffer,
            vertices=geometry.vertices,
            triangles=geometry.triangles,
            boxes=geometry.primitives.boxes,
            shapeNumbers=geometry.primitives.numbers,
            records=scene.record_table.buffer,
            instances=scene.instance_table.buffer,
            previousPlaces=self.places.buffer,
            materials=scene.materials.table.buffer,
            masked=int(scene.masked or self.lights.masked),
            transparent=int(self.transparent),
            glassApart=int(self.glass_apart) << int(self._meets_layers),
            diffuseApart=int(self._follows_diffuse),
            **self.lights.parameters,
        )


def _opaque_first(draws: list[DrawList]) -> list[DrawList]:
    """Opaque draws first: they occlude those that are costlier to shade."""
    return sorted(draws, key=lambda draw: not draw.kind.opaque)
