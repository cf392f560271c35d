"""Meshes whose vertices are written anew each frame, other than by skins and morph weights."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pica.scene.camera import Camera
from pica.scene.fixed import Fixed

if TYPE_CHECKING:
    from pica.scene.model import Node, Section

Floats = NDArray[np.float64]


class Deformer(Fixed, ABC):
    """Gives the vertices of one node's mesh their places. Assign it to `node.deformer` before the node is shown.

    What a section's rest positions mean is the deformer's own affair. A compute pass writes the vertices on the GPU
    (gpu_scene/deformation/vertex_writer.py); `deform` is its reference.
    """

    node: "Node | None" = None
    """Whose mesh it is; set by the node."""

    @abstractmethod
    def deform(self, section: "Section") -> tuple[Floats, Floats, Floats]:
        """Positions (vertices, 3), unit normals (vertices, 3) and tangents (vertices, 4) in the node's space."""

    def positions_of(self, section: "Section") -> Floats:
        """The positions alone."""
        return self.deform(section)[0]

    def changed(self) -> None:
        """Have the vertices written anew for the next picture."""
        if self.node is not None:
            self.node.tell_deformed()


@dataclass(frozen=True, eq=False)
class Eye:
    """Where a camera is, in some node's space."""

    place: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0, 0.0]))
    """(4,) the camera's place and 1, or the direction to an orthographic one and 0."""
    up: Floats = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    """(3,) the camera's."""

    def direction_from(self, points: Floats) -> Floats:
        """(n, 3) unit vectors from points towards the camera; +Z where they coincide."""
        return unit(self.place[:3] - points * self.place[3], np.array([0.0, 0.0, 1.0]))

    def same(self, other: "Eye") -> bool:
        """Whether both see the same."""
        return np.array_equal(self.place, other.place) and np.array_equal(self.up, other.up)


FROM_THE_FRONT = Eye()
"""An orthographic camera that looks along -Z."""


class CameraFacing(Deformer):
    """A deformer whose triangles turn towards the camera of each view: its raster and its rays meet the same ones.

    They face the camera's place, not its picture plane: so they hold still while a camera turns where it stands, and
    reflections and shadows see what the camera sees.
    """

    def eye(self, camera: Camera) -> Eye | None:
        """Where a camera is in the node's space; None where that is flat and nothing is to be seen."""
        assert self.node is not None
        world = self.node.world
        if not np.linalg.det(world):
            return None
        to_node = np.linalg.inv(world)
        axes = camera.transform
        place = axes[:, 3] if camera.orthographic_height is None else np.append(axes[:3, 2], 0.0)
        return Eye(to_node @ place, to_node[:3, :3] @ axes[:3, 1])

    @abstractmethod
    def deform(self, section: "Section", eye: Eye = FROM_THE_FRONT) -> tuple[Floats, Floats, Floats]:
        """As Deformer, for a camera."""


def unit(vectors: Floats, spare: Floats) -> Floats:
    """(n, 3) at unit length; the spare one, (3,) or (n, 3), where that is impossible."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > 1e-20, vectors / np.where(lengths > 1e-20, lengths, 1), spare)
