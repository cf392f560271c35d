"""A compute pass that writes the vertices of one node's mesh: common code of skins, splines and particles."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.geometry import GeometryBuffers
from pica.gpu_scene.geometry_store import PlacedSection
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.scene.model import Section

# vertex_target.slang: Shape
SHAPE = np.dtype([("position", "f4", 3), ("normal", "f4", 3), ("tangent", "f4", 3)])


class VertexWriter(ABC):
    """Runs `shader` over the vertices of each section. Its input buffers are allocated once."""

    shader: ClassVar[str]

    def __init__(self, device: Device, sections: list[PlacedSection]) -> None:
        self._device = device
        self._pass = device.compute(f"gpu_scene/deformation/{self.shader}.slang")
        self._sections = [(placed, self._section_parameters(placed.section)) for placed in sections]
        self._shared: dict[str, Any] = {}

    def __call__(self, recording: Recording, geometry: GeometryBuffers) -> None:
        """Record the writing of all vertices."""
        self._upload(recording)
        for placed, parameters in self._sections:
            target = self._target(geometry, placed)
            self._pass(recording, (len(placed.section.positions), 1, 1), target=target, **self._shared, **parameters)

    def _target(self, geometry: GeometryBuffers, placed: PlacedSection) -> dict[str, Any]:
        """The fields of vertex_target.slang: VertexTarget."""
        return {
            "positions": geometry.positions,
            "vertices": geometry.vertices,
            "vertexCount": len(placed.section.positions),
            "firstVertex": placed.first_vertex,
        }

    @property
    def needs_rebuild(self) -> bool:
        """Whether the last positions differ so much that a refitted tree would be of no use."""
        return False

    def forget(self) -> None:
        """Book the buffers as released after the node's removal."""
        values = [*self._shared.values(), *(v for _, parameters in self._sections for v in parameters.values())]
        self._device.give_back(*(value for value in values if isinstance(value, spy.Buffer)))

    @abstractmethod
    def _upload(self, recording: Recording) -> None:
        """Record the upload of changes since the last call."""

    @abstractmethod
    def _section_parameters(self, section: Section) -> dict[str, Any]:
        """The shader's parameters that differ from section to section and never change."""


def rest_shapes(section: Section) -> NDArray[np.void]:
    """(vertices,) SHAPE rows of a section as it was made."""
    return shapes(section.positions, section.normals, section.tangents[:, :3])


def shapes(*parts: NDArray[np.float32]) -> NDArray[np.void]:
    """(n,) SHAPE rows from positions, normals and tangents, (n, 3) each."""
    rows = np.zeros(len(parts[0]), SHAPE)
    for name, values in zip(("position", "normal", "tangent"), parts, strict=True):
        rows[name] = values
    return rows
