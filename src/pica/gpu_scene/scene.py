"""A scene's copy on the GPU: built once, then told what moved."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.deformation import Deformation
from pica.gpu_scene.draws import DrawList, SectionDraws, draw_lists
from pica.gpu_scene.geometry import GeometryBuffers
from pica.gpu_scene.lights import LightTable
from pica.gpu_scene.materials import MaterialTable
from pica.rhi.acceleration import RtObject, RtScene
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.scene.material import AlphaMode, Material
from pica.scene.model import Node, Scene, Section

# shaders/scene_types.slang: SectionRecord and Instance
RECORD = np.dtype(
    [
        (name, "u4")
        for name in ("first_index", "first_vertex", "material", "instance", "first_emissive", "first_previous")
    ]
)
INSTANCE = np.dtype(
    [("to_world", "f4", (3, 4)), ("previous_to_world", "f4", (3, 4)), ("node", "u4"), ("first_record", "u4")]
)
NOT_EMISSIVE = 0xFFFFFFFF


@dataclass
class _Placement:
    """Which of the scene's instances and objects belong to a node."""

    first_instance: int
    count: int
    first_object: int
    parts: int


class GpuScene:
    """Everything that shaders know of a scene, in one parameter block."""

    def __init__(self, device: Device, scene: Scene, rebuild_at: float) -> None:
        """`rebuild_at`: GeometrySettings.rebuild_at."""
        self.source = scene
        self._device = device
        self._changes = scene.subscribe()
        self.nodes = [node for node in scene.nodes() if node.mesh is not None]
        materials = _materials(self.nodes)
        self.geometry = GeometryBuffers(device, self.nodes)
        self._deformations = {
            node: Deformation(device, node, self.geometry, rebuild_at) for node in self.nodes if node.deforms
        }
        self.materials = MaterialTable(device, list(materials.values()) or [Material()])
        self._placements: dict[Node, _Placement] = {}
        self._place(materials)
        self.lights = LightTable(device, scene, self.records, self.instances, self._sections)
        self._instance_buffer = device.structured("instances", self.instances)
        self.rt_scene = RtScene(device, self._objects, self.instances["to_world"][self._object_instances])
        self.draws: list[DrawList] = draw_lists(device, self._section_draws())
        self.block = device.parameter_block("shaders/scene.slang", "scene")
        self.block.bind(
            tlas=self.rt_scene.structure,
            positions=self.geometry.positions,
            previousPositions=self.geometry.previous_positions,
            vertices=self.geometry.vertices,
            indices=self.geometry.indices,
            records=device.structured("records", self.records),
            instances=self._instance_buffer,
            materials=self.materials.buffer,
            **self.lights.parameters,
        )
        self._just_moved: list[Node] = []
        self._just_deformed: list[Node] = list(self._deformations)
        self._built = False

    def update(self, recording: Recording) -> bool:
        """Upload what moved since the last frame and rebuild the top level; True when anything did.

        What moved in the frame before is uploaded once more, as it stands still now.
        """
        moved = [node for node in self._changes.take() if node in self._placements or node.light is not None]
        for node in dict.fromkeys((*self._just_moved, *moved)):
            if node in self._placements:
                self._move(recording, node)
        if any(node.light is not None for node in moved):
            self.lights.update(recording.encoder)
        deformed = [node for node in self._changes.take_deformed() if node in self._deformations]
        self._deform(recording, list(dict.fromkeys((*self._just_deformed, *deformed))))
        meshes_moved = [node for node in moved if node in self._placements]
        if meshes_moved or deformed or self._just_deformed or not self._built:
            recording.profiler.begin(recording.encoder, "top level")
            self.rt_scene.build(recording.encoder)
            recording.profiler.end(recording.encoder)
            self._built = True
        self._just_moved, self._just_deformed = meshes_moved, deformed
        return bool(moved or deformed)

    def _deform(self, recording: Recording, nodes: list[Node]) -> None:
        """All vertices first, then all structures: one wait between the two, not one a node."""
        for node in nodes:
            self._deformations[node](recording)
        if nodes:
            recording.profiler.begin(recording.encoder, "bottom level")
            for node in nodes:
                self._deformations[node].update_structures(recording)
            recording.profiler.end(recording.encoder)

    def _move(self, recording: Recording, node: Node) -> None:
        placement = self._placements[node]
        rows = self.instances[placement.first_instance : placement.first_instance + placement.count]
        mirrored = _mirrored(rows["to_world"])
        rows["previous_to_world"] = rows["to_world"]
        rows["to_world"] = node.instance_transforms()[:, :3]
        recording.encoder.upload_buffer_data(
            self._instance_buffer, placement.first_instance * INSTANCE.itemsize, rows.view(np.uint8)
        )
        for index in range(placement.count * placement.parts):
            transform = rows["to_world"][index // placement.parts]
            self.rt_scene.move(recording.encoder, placement.first_object + index, transform)
        if (mirrored != _mirrored(rows["to_world"])).any():
            self.draws = draw_lists(self._device, self._section_draws())

    def _place(self, materials: dict[int, Material]) -> None:
        """Number the instances, their records and their ray tracing objects."""
        material_index = {key: index for index, key in enumerate(materials)}
        instances: list[tuple[NDArray[np.float64], NDArray[np.float64], int, int]] = []
        objects: list[RtObject] = []
        object_instances: list[int] = []
        records: list[tuple[int, int, int, int, int, int]] = []
        self._sections: list[Section] = []
        for number, node in enumerate(self.source.nodes(), start=1):
            if node.mesh is None:
                continue
            mesh = self.geometry.mesh(node)
            transforms = node.instance_transforms()[:, :3]
            self._placements[node] = _Placement(len(instances), len(transforms), len(objects), len(mesh.parts))
            for transform in transforms:
                for part in mesh.parts:
                    objects.append(RtObject(part.geometry, len(records) + part.first_section, part.flags))
                    object_instances.append(len(instances))
                first_record = len(records)
                for placed in mesh.sections:
                    material = material_index[id(placed.section.material)]
                    places = placed.first_index, placed.first_vertex
                    records.append((*places, material, len(instances), NOT_EMISSIVE, placed.first_previous))
                    self._sections.append(placed.section)
                instances.append((transform, transform, number, first_record))
        self.instances: NDArray[np.void] = np.array(instances, INSTANCE)
        self.records: NDArray[np.void] = np.array(records, RECORD)
        self._objects, self._object_instances = objects, np.array(object_instances, np.int64)

    def _section_draws(self) -> SectionDraws:
        materials = [section.material for section in self._sections]
        return SectionDraws(
            first_index=self.records["first_index"],
            index_count=np.array([section.indices.size for section in self._sections], np.uint32),
            opaque=np.array([m.alpha_mode is AlphaMode.OPAQUE for m in materials], bool),
            double_sided=np.array([m.double_sided for m in materials], bool),
            mirrored=_mirrored(self.instances["to_world"])[self.records["instance"]],
        )


def _mirrored(transforms: NDArray[np.float32]) -> NDArray[np.bool_]:
    return np.asarray(np.linalg.det(transforms[:, :, :3].astype(np.float64)) < 0)


def _materials(nodes: list[Node]) -> dict[int, Material]:
    sections = (section for node in nodes if node.mesh for section in node.mesh.sections)
    return {id(section.material): section.material for section in sections}
