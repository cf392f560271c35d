"""Transforms and positions of a view's own previous frame, however often other views have rendered since."""

from collections.abc import Iterable

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.geometry import GeometryBuffers, GpuMesh
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import GrowingBuffer, HostTable

# gpu_scene/table_rows.slang: Place
PLACE = np.dtype([("rows", "f4", (3, 4))])


class PreviousPlaces:
    """The instances' transforms in the view's previous frame. Costs only instances that moved in it or since."""

    def __init__(self, device: Device) -> None:
        self._table = HostTable(device, "previous places", PLACE)
        self._moved = np.zeros(1, bool)
        self._added = np.zeros(1, bool)
        self._shown: tuple[NDArray[np.int64], NDArray[np.float32]] | None = None
        """The instances that moved in the frame before, and where it showed them."""
        self._quiet = True
        """Nothing was noted since the frame before."""

    @property
    def buffer(self) -> spy.Buffer:
        """PLACE rows, as the instances'."""
        return self._table.buffer

    @property
    def moved(self) -> NDArray[np.int64]:
        """The instances that moved in the newest frame."""
        return np.zeros(0, np.int64) if self._shown is None else self._shown[0]

    def note(self, moved: NDArray[np.int64], added: NDArray[np.int64]) -> None:
        """Mark instances with a new transform since the view's last frame, and added ones, which were not in it."""
        highest = int(max(moved.max(initial=0), added.max(initial=0)))
        if highest >= len(self._moved):
            more = np.zeros(max(highest + 1, 2 * len(self._moved)) - len(self._moved), bool)
            self._moved, self._added = (np.concatenate([marks, more]) for marks in (self._moved, self._added))
        self._moved[moved] = True
        self._added[added] = True
        self._quiet = False

    def update(self, recording: Recording, to_world: NDArray[np.float32]) -> None:
        """Begin a frame of the view; `to_world`: (instances, 3, 4)."""
        if self._quiet and self._shown is None:
            return
        self._quiet = True
        self._table.reserve(len(to_world))
        rows = self._table.rows["rows"]
        if self._shown is not None:
            places, transforms = self._shown
            rows[places] = transforms
            self._table.touch(places)
        moved, added = np.flatnonzero(self._moved), np.flatnonzero(self._added)
        rows[added] = to_world[added]
        self._table.touch(added)
        self._shown = (moved, to_world[moved]) if len(moved) else None
        self._moved[moved] = self._added[added] = False
        self._table.flush(recording)


class PreviousPositions:
    """The vertices, in the view's previous frame, of meshes that deform for all views.

    They are copied from the current ones just before those are overwritten, unless both are the same already.
    """

    def __init__(self, device: Device, geometry: GeometryBuffers) -> None:
        self._geometry = geometry
        self._rows = GrowingBuffer(device, "previous positions", 12)
        self._behind: dict[GpuMesh, None] = {}
        """Meshes deformed in the view's last frame, or added: the copy is older than that frame."""
        self._new: set[GpuMesh] = set()
        """Of `_behind`, those that no frame of the view has shown yet."""
        self._deformed: dict[GpuMesh, None] = {}
        """Meshes deformed since the view's last frame; the copy is of that frame."""

    @property
    def buffer(self) -> spy.Buffer:
        """float32 (vertices, 3), by the numbers of GeometryBuffers.previous."""
        return self._rows.buffer

    def on_meshes_added(self, meshes: Iterable[GpuMesh]) -> None:
        """Meshes are shown from the view's next frame on."""
        for mesh in meshes:
            self._behind[mesh] = None
            self._new.add(mesh)

    def on_mesh_removed(self, mesh: GpuMesh) -> None:
        """A mesh is shown no more."""
        self._behind.pop(mesh, None)
        self._deformed.pop(mesh, None)
        self._new.discard(mesh)

    def before_deforming(self, encoder: spy.CommandEncoder, meshes: Iterable[GpuMesh]) -> None:
        """Copy the vertices of these meshes before they are overwritten, unless that has been done."""
        overwritten = [mesh for mesh in meshes if mesh not in self._new]
        self._copy(encoder, [mesh for mesh in overwritten if self._behind.pop(mesh, self) is None])
        self._deformed.update(dict.fromkeys(overwritten))

    def update(self, encoder: spy.CommandEncoder) -> None:
        """Begin a frame of the view, after the writing."""
        self._copy(encoder, list(self._behind))
        self._behind, self._deformed = self._deformed, {}
        self._new.clear()

    def _copy(self, encoder: spy.CommandEncoder, meshes: list[GpuMesh]) -> None:
        self._rows.reserve(encoder, self._geometry.previous.end)
        if not meshes:
            return
        runs = sorted(
            (placed.first_vertex, placed.first_previous, len(placed.section.positions))
            for mesh in meshes
            for placed in mesh.sections
        )
        joined: list[tuple[int, int, int]] = []
        for source, target, count in runs:
            if joined and (joined[-1][0] + joined[-1][2], joined[-1][1] + joined[-1][2]) == (source, target):
                joined[-1] = (*joined[-1][:2], joined[-1][2] + count)
            else:
                joined.append((source, target, count))
        for source, target, count in joined:
            encoder.copy_buffer(self.buffer, 12 * target, self._geometry.positions, 12 * source, 12 * count)
