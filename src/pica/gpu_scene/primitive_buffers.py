"""Primitives that are not triangles on the GPU: their boxes and their parameters."""

import warnings
from dataclasses import dataclass

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.bounds import object_box
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.rhi.rt_geometry import RtBoxes, RtGeometry
from pica.rhi.tables import DeviceTable
from pica.scene.primitives import Primitives
from pica.scene.shape_registry import shape_source

BOX = np.dtype([("low", "f4", 3), ("high", "f4", 3)])
# Corners of a box by number, whose bits say low or high along x, y and z; counter-clockwise seen from outside.
_FACES = np.array([(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)], np.uint32)
BOX_INDICES = _FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
"""(12, 3) triangles of every box."""


@dataclass(frozen=True)
class PlacedPrimitives:
    """Primitives and where they lie in the shared buffers; fields as PlacedSection has them for triangles."""

    section: Primitives
    index: int
    """In `Mesh.primitives`."""
    first_vertex: int
    """Of the boxes."""
    first_index: int
    """Of the parameters' numbers."""
    numbers: int
    """Number of primitives."""
    first_previous: int = 0

    @property
    def box(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """As PlacedSection.box."""
        return object_box(self.section.bounds.reshape(-1, 3))

    @property
    def hit_group(self) -> str:
        """Its entry in a MaterialTypeSet."""
        return f"{self.section.shape}/{self.section.material.type}"


class PrimitiveBuffers:
    """Boxes and parameters of all primitives."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._boxes = DeviceTable(device, "boxes", BOX.itemsize, device.built_from)
        self._numbers = DeviceTable(device, "shape numbers", 4)

    @property
    def boxes(self) -> spy.Buffer:
        """BOX rows, object space."""
        return self._boxes.buffer

    @property
    def numbers(self) -> spy.Buffer:
        """32-bit numbers: the parameters, primitive by primitive."""
        return self._numbers.buffer

    def upload(self, encoder: spy.CommandEncoder, primitives: Primitives, index: int) -> PlacedPrimitives:
        """Record the upload. `index`: in `Mesh.primitives`. Raises ShapeError if parameters do not match the shape."""
        if max(primitives.material.emission) > 0:
            warnings.warn(
                f"primitives of shape {primitives.shape!r} shine, but light is not sampled from them: "
                "in the hybrid they light nothing; use a light, or triangles",
                stacklevel=2,
            )
        numbers = programs(self._device).shape_types[shape_source(primitives.shape)].packed(primitives)
        first_box = self._boxes.take(encoder, primitives.bounds)
        return PlacedPrimitives(primitives, index, first_box, self._numbers.take(encoder, numbers), numbers.size)

    def give_back(self, placed: PlacedPrimitives) -> None:
        """Free their memory."""
        self._boxes.give_back(placed.first_vertex, len(placed.section))
        self._numbers.give_back(placed.first_index, placed.numbers)

    def structure(self, run: list[PlacedPrimitives]) -> RtGeometry:
        """A bottom-level structure over primitives of one hit group, yet to be built."""
        boxes = [RtBoxes(p.first_vertex, len(p.section), p.section.material.stops_rays()) for p in run]
        return RtGeometry(self._device, boxes)
