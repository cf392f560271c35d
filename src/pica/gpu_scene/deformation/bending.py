"""Meshes bent along splines on the GPU (bend.slang)."""

from typing import Any

import numpy as np
import slangpy as spy

from pica.gpu_scene.deformation.vertex_writer import VertexWriter, rest_shapes
from pica.gpu_scene.geometry_store import PlacedSection
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.scene.model import Section
from pica.scene.spline import Spline


class Bending(VertexWriter):
    """Writes vertices as a spline has them; only its control points are uploaded."""

    shader = "bend"

    def __init__(self, device: Device, spline: Spline, sections: list[PlacedSection]) -> None:
        super().__init__(device, sections)
        self._spline = spline
        self._version = 0
        points = len(spline.rows)
        self._shared = {
            "controls": device.structured("spline controls", np.zeros((2 * points, 4), np.float32)),
            "places": device.structured("spline places", np.zeros(len(spline.places), np.float32)),
            "controlCount": points - 2,
            "placeCount": len(spline.places),
            "extent": spy.float2(*spline.extent),
        }

    def _upload(self, recording: Recording) -> None:
        spline = self._spline
        if self._version == spline.version:
            return
        self._version = spline.version
        encoder = recording.encoder
        encoder.upload_buffer_data(self._shared["controls"], 0, spline.rows.astype(np.float32).reshape(-1, 4))
        encoder.upload_buffer_data(self._shared["places"], 0, spline.places.astype(np.float32))
        self._shared["curveLength"] = spline.length

    def _section_parameters(self, section: Section) -> dict[str, Any]:
        return {"base": self._device.structured("shape to bend", rest_shapes(section))}
