"""Vertices that the user sets, on the GPU (dynamic.slang)."""

from typing import Any

import numpy as np

from pica.gpu_scene.deformation.vertex_writer import VertexWriter
from pica.gpu_scene.geometry_store import PlacedSection
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.model import Section

# dynamic.slang: Corner
CORNER = np.dtype([("at", "u4"), ("others", "u4", 2), ("tangent", "f4", 2)])


class DynamicWriter(VertexWriter):
    """Uploads arrays that were set; normals and tangents are computed on the device."""

    shader = "dynamic"

    def __init__(self, device: Device, dynamic: DynamicVertices, sections: list[PlacedSection]) -> None:
        super().__init__(device, sections)
        self._dynamic = dynamic
        self._version = 0
        at = dynamic.corners
        corners = np.zeros(len(at.at), CORNER)
        corners["at"], corners["others"], corners["tangent"] = at.at, at.others, at.tangents
        self._shared = {
            "positions": device.structured("positions as set", dynamic.positions),
            "normals": device.structured("normals as set", np.zeros_like(dynamic.positions)),
            "firstCorner": device.structured("first corners", at.first),
            "corners": device.structured("corners", corners),
            "hasNormals": 0,
        }

    def _upload(self, recording: Recording) -> None:
        dynamic = self._dynamic
        if self._version == dynamic.version:
            return
        self._version = dynamic.version
        recording.encoder.upload_buffer_data(
            self._shared["positions"], 0, dynamic.positions.copy()
        )  # SlangPy takes no read-only arrays
        self._shared["hasNormals"] = int(dynamic.normals is not None)
        if dynamic.normals is not None:
            recording.encoder.upload_buffer_data(self._shared["normals"], 0, dynamic.normals.copy())

    def _section_parameters(self, section: Section) -> dict[str, Any]:
        assert section.rows is not None
        return {
            "rows": self._device.structured("rows as set", section.rows),
            "restNormals": self._device.structured("normals at rest", section.normals),
        }
