"""Meshes whose vertices are rewritten each frame, other than by skins and morph weights."""

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
    """Computes the vertices of one node's mesh. Assign it to `node.deformer` before the node is shown.

    The deformer defines the meaning of a section's rest positions. A compute pass writes the vertices on the GPU
    (gpu_scene/deformation/vertex_writer.py); `deform` is its reference.
    """

    node: "Node | None" = None
    """The node of the mesh; set by the node."""

    @abstractmethod
    def deform(self, section: "Section") -> tuple[Floats, Floats, Floats]:
        """Positions (vertices, 3), unit normals (vertices, 3) and tangents (vertices, 4) in the node's space."""

    def positions_of(self, section: "Section") -> Floats:
        """The positions alone."""
        return self.deform(section)[0]

    def changed(self) -> None:
        """Have the vertices rewritten for the next picture."""
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
        """Whether both views are equal."""
        return np.array_equal(self.place, other.place) and np.array_equal(self.up, other.up)


FROM_THE_FRONT = Eye()
"""An orthographic camera that looks along -Z."""


class CameraFacing(Deformer):
    """A deformer whose triangles face the camera of each view: its raster and rays use the same geometry.

    They face the camera's position, not its image plane: so they are static while a camera only rotates, and
    reflections and shadows have the same geometry as the camera.
    """

    def eye(self, camera: Camera) -> Eye | None:
        """The camera's position in the node's space; None if that is singular and the node invisible."""
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
