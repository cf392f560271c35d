"""A scene's meshes on the device. Copies of a scene share what is equal (geometry_store.py)."""

from collections.abc import Container
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from weakref import WeakValueDictionary, finalize

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.geometry_store import OF_VIEW, GeometryStore, MeshPart, PlacedSection, Upload
from pica.gpu_scene.primitive_buffers import PlacedPrimitives, PrimitiveBuffers
from pica.gpu_scene.table_rows import RECORD
from pica.rhi.device import Device
from pica.rhi.tables import Runs
from pica.scene.material import Material
from pica.scene.model import Mesh


@dataclass(eq=False)
class GpuMesh:
    """A mesh on the GPU: its sections and then its primitives in the order of their records, its parts, its users."""

    mesh: Mesh
    upload: Upload
    sections: list[PlacedSection]
    """Those of the upload, with the materials of this mesh."""
    users: int = 0
    """How many show it: nodes for all views, and nodes for one view each."""

    @property
    def previous(self) -> Runs | None:
        """Where its vertices have numbers for their previous positions; None: it does not deform."""
        return self.upload.previous

    @property
    def primitives(self) -> list[PlacedPrimitives]:
        """Its primitives."""
        return self.upload.primitives

    @property
    def parts(self) -> list[MeshPart]:
        """Bottom-level structures."""
        return self.upload.parts

    @property
    def placed(self) -> list[PlacedSection | PlacedPrimitives]:
        """The parts with one record each."""
        return [*self.sections, *self.primitives]

    @cached_property
    def records(self) -> NDArray[np.void]:
        """(placed,) RECORD rows, with the fields for geometry and bounds filled in."""
        records = np.zeros(len(self.placed), RECORD)
        for row, placed in zip(records, self.placed, strict=True):
            for name in ("first_index", "first_vertex", "first_previous"):
                row[name] = getattr(placed, name)
            row["center"], row["extent"] = placed.box
        if self.previous is not None:
            records["extent"] *= -1
        return records


class GeometryBuffers:
    """The meshes of a scene and the buffers that hold them.

    Nodes that show one mesh share it. Deforming meshes have vertices and structures of their own; their previous
    positions belong to each view (previous_frame.py).
    """

    def __init__(self, device: Device, origin: object) -> None:
        """`origin`: Scene.origin."""
        self._store = device.shared(_Stores).of(device, origin)
        self.previous = Runs()
        """Numbers of previous positions that mean the same in all views."""
        self._meshes: dict[int, GpuMesh] = {}
        """Rigid meshes, by their Mesh."""
        self._acquired: dict[GpuMesh, None] = {}
        finalize(self, device.lock.defer, partial(_release, self._store, self._acquired)).atexit = False

    @property
    def positions(self) -> spy.Buffer:
        """float32 (vertices, 3), object space."""
        return self._store.positions.buffer

    @property
    def vertices(self) -> spy.Buffer:
        """VERTEX rows."""
        return self._store.vertices.buffer

    @property
    def triangles(self) -> spy.Buffer:
        """uint32 (triangles, 3), indices of vertices from their section's first."""
        return self._store.triangles.buffer

    @property
    def primitives(self) -> PrimitiveBuffers:
        """Boxes and parameters of primitives other than triangles."""
        return self._store.primitives

    @property
    def first_box_index(self) -> int:
        """As GeometryStore."""
        return self._store.first_box_index

    def acquire(self, encoder: spy.CommandEncoder, mesh: Mesh, previous: Runs | None = None) -> GpuMesh:
        """The GPU copy of a mesh, with one more user; records the upload if it has none yet.

        `previous`: for a deforming mesh, the allocator of its previous positions: `self.previous`, or that of a view.
        """
        gpu_mesh = self._meshes.get(id(mesh)) if previous is None else None
        if gpu_mesh is None:
            of_view = 0 if previous is self.previous else OF_VIEW
            upload = self._store.acquire(encoder, mesh, previous, of_view)
            gpu_mesh = GpuMesh(mesh, upload, [_with_material(placed, mesh) for placed in upload.sections])
            self._acquired[gpu_mesh] = None
            if previous is None:
                self._meshes[id(mesh)] = gpu_mesh
        gpu_mesh.users += 1
        return gpu_mesh

    def release(self, mesh: GpuMesh) -> None:
        """Remove one user; the last one frees it."""
        mesh.users -= 1
        if mesh.users:
            return
        if self._meshes.get(id(mesh.mesh)) is mesh:
            del self._meshes[id(mesh.mesh)]
        del self._acquired[mesh]
        self._store.release(mesh.upload)

    def retire(self, meshes: Container[Mesh], materials: Container[Material]) -> None:
        """Forget meshes among `meshes` or with one of `materials`, so that the next user uploads them again."""
        for key, gpu_mesh in list(self._meshes.items()):
            if gpu_mesh.mesh in meshes or any(placed.section.material in materials for placed in gpu_mesh.placed):
                del self._meshes[key]
                self._store.retire(gpu_mesh.upload)

    def has(self, mesh: Mesh) -> bool:
        """Whether the mesh is uploaded as a rigid one."""
        return id(mesh) in self._meshes

    def build(self, encoder: spy.CommandEncoder) -> None:
        """Record the builds of the structures that are new and do not deform."""
        self._store.build(encoder)

    def build_compact(self) -> None:
        """As `build`, at once and into as little memory as may be; waits for the GPU."""
        self._store.build_compact()


class _Stores:
    """A device's stores that are in use, by the identity of their origin, which each keeps alive."""

    def __init__(self, device: Device) -> None:
        self._by_origin: WeakValueDictionary[int, GeometryStore] = WeakValueDictionary()

    def of(self, device: Device, origin: object) -> GeometryStore:
        store = self._by_origin.get(id(origin))
        if store is None:
            store = self._by_origin[id(origin)] = GeometryStore(device.memory_scope(), origin)
        return store


def _release(store: GeometryStore, meshes: dict[GpuMesh, None]) -> None:
    for mesh in meshes:
        store.release(mesh.upload)


def _with_material(placed: PlacedSection, mesh: Mesh) -> PlacedSection:
    """A copy, as the user's section may be written to while this one is shown."""
    section = copy(placed.section)
    vars(section)["material"] = mesh.sections[placed.index].material  # no edit, which would be noted
    return replace(placed, section=section)
