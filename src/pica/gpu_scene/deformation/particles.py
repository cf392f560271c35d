"""Sprites and ribbons on the GPU (sprites.slang, ribbons.slang)."""

from abc import abstractmethod
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.deformation.vertex_writer import VertexWriter
from pica.gpu_scene.geometry import GeometryBuffers
from pica.gpu_scene.geometry_store import OF_VIEW, PlacedSection
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import GrowingBuffer
from pica.scene.deformer import FROM_THE_FRONT
from pica.scene.model import Section
from pica.scene.particles import Particles, Ribbons, Sprites

# sprites.slang: Particle
PARTICLE = np.dtype(
    [
        ("position", "f4", 3),
        ("rotation", "f4"),
        ("color", "f4", 4),
        ("size", "f4", 2),
        ("age", "f4"),
        ("is_new", "u4"),
    ]
)
# ribbons.slang: StrandPoint
STRAND_POINT = np.dtype([("position", "f4", 3), ("width", "f4"), ("color", "f4", 4)])


class FacingWriter(VertexWriter):
    """Writes geometry that faces the camera of one view, and its positions in the view's previous frame.

    Uploads arrays when they are set, and the camera's position in every frame.
    """

    def __init__(
        self, device: Device, deformer: Sprites | Ribbons, sections: list[PlacedSection], previous: GrowingBuffer
    ) -> None:
        """`previous`: the view's own previous positions."""
        super().__init__(device, sections)
        self._deformer, self._previous = deformer, previous
        self._version = 0
        self._had_new = False
        self._needs_rebuild = True
        self._identities: NDArray[np.int64] | None = None
        self.eye = FROM_THE_FRONT
        """Where the camera is, in the node's space; set before the writing."""

    @property
    def needs_rebuild(self) -> bool:
        """True if arrays were set; if only the camera moved, triangles rotate in place and a refit suffices."""
        return self._needs_rebuild

    def _target(self, geometry: GeometryBuffers, placed: PlacedSection) -> dict[str, Any]:
        return {
            "vertices": super()._target(geometry, placed),
            "previousPositions": self._previous.buffer,
            "firstPrevious": placed.first_previous & ~OF_VIEW,
        }

    def _upload(self, recording: Recording) -> None:
        deformer = self._deformer
        self._needs_rebuild = self._version != deformer.version
        if self._needs_rebuild or self._had_new:
            is_new = self._new_particles()
            self._upload_arrays(recording.encoder, is_new)
            self._version, self._had_new = deformer.version, bool(is_new.any())
        self._shared["eye"] = spy.float4(*self.eye.place)

    def _new_particles(self) -> NDArray[np.bool_]:
        """(n,) which particles were not there in the previous frame."""
        before, self._identities = self._identities, self._present()
        is_new = np.ones(len(self._identities), bool)
        if before is not None:
            both = min(len(before), len(self._identities))
            is_new[:both] = before[:both] != self._identities[:both]
        return is_new

    def _section_parameters(self, section: Section) -> dict[str, Any]:
        return {"base": self._device.structured("places in particles", section.positions)}

    @abstractmethod
    def _present(self) -> NDArray[np.int64]:
        """(n,) identities of the particles."""

    @abstractmethod
    def _upload_arrays(self, encoder: spy.CommandEncoder, is_new: NDArray[np.bool_]) -> None:
        """Record the upload; `is_new` (n,): which were not there in the previous frame."""


class SpriteWriter(FacingWriter):
    """Writes the quads of sprites."""

    shader = "sprites"

    def __init__(
        self, device: Device, sprites: Sprites, sections: list[PlacedSection], previous: GrowingBuffer
    ) -> None:
        super().__init__(device, sprites, sections, previous)
        self._sprites = sprites
        self._shared = {"particles": device.structured("particles", np.zeros(sprites.capacity, PARTICLE))}

    def _upload(self, recording: Recording) -> None:
        super()._upload(recording)
        self._shared["eyeUp"] = spy.float3(*self.eye.up)

    def _present(self) -> NDArray[np.int64]:
        particles = self._sprites.particles
        return np.arange(len(particles.positions)) if particles.identities is None else particles.identities

    def _upload_arrays(self, encoder: spy.CommandEncoder, is_new: NDArray[np.bool_]) -> None:
        rows = packed(self._sprites.particles)
        rows["is_new"] = is_new
        self._shared["particleCount"] = len(rows)
        if len(rows):
            encoder.upload_buffer_data(self._shared["particles"], 0, rows.view(np.uint8))


class RibbonWriter(FacingWriter):
    """Writes the strips of ribbons."""

    shader = "ribbons"

    def __init__(
        self, device: Device, ribbons: Ribbons, sections: list[PlacedSection], previous: GrowingBuffer
    ) -> None:
        super().__init__(device, ribbons, sections, previous)
        self._ribbons = ribbons
        self._shared = {
            "points": device.structured("ribbons", np.zeros(ribbons.strands * ribbons.points, STRAND_POINT)),
            "isNew": device.structured("new strands", np.zeros(ribbons.strands, np.uint32)),
            "pointCount": ribbons.points,
        }

    def _present(self) -> NDArray[np.int64]:
        return self._ribbons.identities

    def _upload_arrays(self, encoder: spy.CommandEncoder, is_new: NDArray[np.bool_]) -> None:
        rows = np.zeros((self._ribbons.strands, self._ribbons.points), STRAND_POINT)
        rows["position"], rows["width"] = self._ribbons.positions, self._ribbons.widths
        rows["color"] = self._ribbons.colors
        encoder.upload_buffer_data(self._shared["points"], 0, rows.reshape(-1).view(np.uint8))
        encoder.upload_buffer_data(self._shared["isNew"], 0, is_new.astype(np.uint32))


def packed(particles: Particles) -> NDArray[np.void]:
    """(n,) PARTICLE rows."""
    count = len(particles.positions)
    rows = np.zeros(count, PARTICLE)
    rows["position"], rows["rotation"], rows["age"] = particles.positions, particles.rotations, particles.ages
    rows["color"] = particles.colors
    rows["size"] = particles.sizes.reshape(count, -1) if count else 0
    return rows
