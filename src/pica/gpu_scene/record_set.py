"""The records shown in all views, or in one view. All are in one table."""

from collections.abc import Iterator, Sequence, Set
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.draws import (
    DRAWN_SECTION,
    NOT_DRAWN,
    DrawList,
    DrawLists,
    draw_arguments,
    drawn_section,
    is_mirrored,
    kinds_of,
)
from pica.gpu_scene.geometry import GeometryBuffers, GpuMesh
from pica.gpu_scene.lights.emissive_triangles import EmissiveTriangles
from pica.gpu_scene.masks import INSTANCE_MASK, SEEN_BY_CAMERA, SEEN_BY_SURFACES
from pica.gpu_scene.materials import MaterialTable
from pica.gpu_scene.table_rows import NOT_EMISSIVE
from pica.rhi.acceleration import RtObject, rows_of
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import HostTable, rows_of_ranges, rows_of_runs
from pica.scene.illumination import average_emission
from pica.scene.material import Material


class RecordSet:
    """Some of the records, and the draws of their sections."""

    def __init__(
        self,
        device: Device,
        records: HostTable,
        instances: HostTable,
        geometry: GeometryBuffers,
        materials: MaterialTable,
    ) -> None:
        """The tables that hold the records, their instances, meshes and materials; shared by all sets of a scene."""
        self._device = device
        self._records, self._instances = records, instances
        self._geometry, self._materials = geometry, materials
        self._sections = np.zeros(1, DRAWN_SECTION)
        """By record; records of other sets have no indices."""
        self.emissive = EmissiveTriangles()
        """Triangles of the emissive records that reflection rays can hit."""

    @property
    def count(self) -> int:
        """Number of records."""
        return int(np.count_nonzero(self._sections["index_count"]))

    def add(self, mesh: GpuMesh, instances: Sequence[range]) -> list[range]:
        """Add records of a mesh for each of its nodes, given their instances; contiguous for each node."""
        copies, sections = np.array([len(copy) for copy in instances]), len(mesh.placed)
        counts = copies * sections
        firsts = self._records.take_runs(counts)
        rows = np.tile(mesh.records, (copies.sum(), 1))
        rows["material"] = [self._materials.acquire(placed.section.material, len(copies)) for placed in mesh.placed]
        rows["instance"] = rows_of_ranges(instances)[:, None]
        rows["first_emissive"] = NOT_EMISSIVE
        for index, primitives in enumerate(mesh.primitives, len(mesh.sections)):
            rows["shape"][:, index] = self._materials.shape_number(primitives.hit_group)
        added = rows_of_runs(firsts, counts)
        self._records.rows[added] = rows.ravel()
        end = int(added.max(initial=-1)) + 1
        if end > len(self._sections):
            more = max(end, 2 * len(self._sections)) - len(self._sections)
            self._sections = np.append(self._sections, np.zeros(more, DRAWN_SECTION))
        sections_drawn = np.array([drawn_section(placed.section) for placed in mesh.placed], DRAWN_SECTION)
        self._sections[added] = np.tile(sections_drawn, copies.sum())
        self._touch(added)
        runs = [range(first, first + count) for first, count in zip(firsts.tolist(), counts.tolist(), strict=True)]
        if any(average_emission(placed.section.material) > 0 for placed in mesh.sections):
            for records in runs:
                self._shine(mesh, records)
        return runs

    def remove(self, mesh: GpuMesh, records: range) -> None:
        """Free records from `add`."""
        self.emissive.remove(records.start)
        self._records.give_back(records.start, len(records))
        self._sections[records.start : records.stop] = 0
        for placed in mesh.placed:
            self._materials.release(placed.section.material)
        self._touch(np.array(records, np.int64))

    def objects(
        self, mesh: GpuMesh, records: NDArray[np.int64], objects: NDArray[np.int64]
    ) -> Iterator[tuple[NDArray[np.int64], RtObject, NDArray[np.void]]]:
        """Arguments of RtScene.place for each part of a mesh: slots, content, and record rows.

        All records of the mesh's instances, and their slots, instance by instance.
        """
        if not mesh.parts:
            return
        first_records = records[:: len(mesh.placed)]
        instances = self._instances.rows[self._records.rows["instance"][first_records]]
        masks = instances["mask_and_channels"] & INSTANCE_MASK
        for slots, part in zip(objects.reshape(-1, len(mesh.parts)).T, mesh.parts, strict=True):
            placed = RtObject(part.geometry, self._materials.type_number(part.hit_group), part.flags)
            yield slots, placed, rows_of(placed, first_records + part.first_section, instances["to_world"], masks)

    def renew(self, mesh: GpuMesh, records: range) -> None:
        """Update records after a change of masks or mirroring."""
        self._touch(np.array(records, np.int64))
        if self.emissive.has(records.start) != self._seen_by_surfaces(records):
            self._shine(mesh, records)

    def relight(self, mesh: GpuMesh, records: range, materials: Set[Material]) -> None:
        """Update emissive triangles after a change of these materials' emission."""
        if any(placed.section.material in materials for placed in mesh.sections):
            self._shine(mesh, records)

    def number_emissive(self, offset: int) -> None:
        """Write the triangles' offsets into the emissive records; triangles of other sets come first in the table."""
        for records, first in self.emissive.starts():
            self._records.rows["first_emissive"][records] = first + offset
            self._records.touch(records)

    def draws(self, recording: Recording) -> list[DrawList]:
        """The draws of the camera's raster pass. Records the upload of changes."""
        return self._listed(recording, self._camera_draws, casters=False)

    def casters(self, recording: Recording) -> list[DrawList]:
        """Triangles that may cast shadows, whatever their masks; uploads as `draws`."""
        return self._listed(recording, self._shadow_draws, casters=True)

    @cached_property
    def _camera_draws(self) -> DrawLists:
        return self._every_draw()

    @cached_property
    def _shadow_draws(self) -> DrawLists:
        return self._every_draw()

    def _every_draw(self) -> DrawLists:
        lists = DrawLists(self._device)
        lists.touch(np.flatnonzero(self._sections["index_count"]))
        return lists

    def _touch(self, records: NDArray[np.int64]) -> None:
        for name in ("_camera_draws", "_shadow_draws"):
            if name in self.__dict__:  # only if in use
                getattr(self, name).touch(records)

    def _listed(self, recording: Recording, lists: DrawLists, casters: bool) -> list[DrawList]:
        touched = lists.take_touched()
        if len(touched):
            sections, rows = self._sections[touched], self._records.rows[touched]
            instances = self._instances.rows[rows["instance"]]
            visible = rows["shape"] == 0 if casters else instances["mask_and_channels"] & SEEN_BY_CAMERA != 0
            kinds = kinds_of(sections, is_mirrored(instances["to_world"]))
            kinds[~visible | (sections["index_count"] == 0)] = NOT_DRAWN
            lists.put(touched, kinds, draw_arguments(touched, rows, sections, self._geometry.first_box_index))
        return lists.lists(recording)

    def _seen_by_surfaces(self, records: range) -> bool:
        instance = self._instances.rows[self._records.rows[records.start]["instance"]]
        return bool(instance["mask_and_channels"] & SEEN_BY_SURFACES)

    def _shine(self, mesh: GpuMesh, records: range) -> None:
        """Add the emissive triangles to the table if reflection rays can hit them, else remove them."""
        self.emissive.remove(records.start)
        rows = self._records.rows[records.start : records.stop].reshape(-1, len(mesh.placed))
        rows["first_emissive"] = NOT_EMISSIVE
        if self._seen_by_surfaces(records):
            to_world = self._instances.rows["to_world"][rows["instance"][:, 0]]
            for index, placed in enumerate(mesh.sections):
                if average_emission(placed.section.material) > 0:
                    numbers = np.arange(records.start + index, records.stop, len(mesh.placed))
                    first = self.emissive.add(records.start, numbers, placed.section, to_world)
                    rows["first_emissive"][:, index] = first
        self._records.touch(np.array(records, np.int64))
