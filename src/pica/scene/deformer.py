"""Meshes whose vertices are written anew each frame, other than by skins and morph weights."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from pica.scene.camera import Camera

if TYPE_CHECKING:
    from pica.scene.model import Node, Section

Floats = NDArray[np.float64]


class FacesCamera(Protocol):
    """What depends on the camera and is told before each picture where it is."""

    def face(self, camera: Camera) -> None:
        """Follow the camera; only what differs from the call before may be changed."""


class Deformer(ABC):
    """Gives the vertices of one node's mesh their places. Assign it to `node.deformer` before the node is shown.

    What a section's rest positions mean is the deformer's own affair. A compute pass writes the vertices on the GPU
    (gpu_scene/vertex_writer.py); `deform` is its reference.
    """

    node: "Node | None" = None
    """Whose mesh it is; set by the node."""

    @abstractmethod
    def deform(self, section: "Section") -> tuple[Floats, Floats, Floats]:
        """Positions (vertices, 3), unit normals (vertices, 3) and tangents (vertices, 4) in the node's space."""

    def changed(self) -> None:
        """Have the vertices written anew for the next picture."""
        if self.node is not None:
            self.node.tell_deformed()


class CameraFacing(Deformer):
    """A deformer whose triangles turn towards the camera: raster and rays meet the same ones.

    They face the camera's place, not its picture plane: so they hold still while a camera turns where it stands, and
    reflections and shadows see what the camera sees.
    """

    def __init__(self) -> None:
        self.eye: Floats = np.array([0.0, 0.0, 1.0, 0.0])
        """(4,) in the node's space: the camera's place and 1, or the direction to an orthographic one and 0."""
        self.up: Floats = np.array([0.0, 1.0, 0.0])
        """(3,) the camera's, in the node's space."""
        self.faced = False
        """Whether there was any camera yet; without one they face +Z."""

    def face(self, camera: Camera) -> None:
        """Turn towards a camera. Nothing happens where it is already faced."""
        assert self.node is not None
        world = self.node.world
        if not np.linalg.det(world):  # flat: there is nothing to see
            return
        to_node = np.linalg.inv(world)
        axes = camera.transform
        place = axes[:, 3] if camera.orthographic_height is None else np.append(axes[:3, 2], 0.0)
        eye, up = to_node @ place, to_node[:3, :3] @ axes[:3, 1]
        if self.faced and np.array_equal(eye, self.eye) and np.array_equal(up, self.up):
            return
        self.eye, self.up, self.faced = eye, up, True
        self.changed()

    def to_eye(self, points: Floats) -> Floats:
        """(n, 3) unit vectors from points towards the camera; the camera's own direction where they coincide."""
        return unit(self.eye[:3] - points * self.eye[3], np.array([0.0, 0.0, 1.0]))


def unit(vectors: Floats, spare: Floats) -> Floats:
    """(n, 3) at unit length; the spare one, (3,) or (n, 3), where that is impossible."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > 1e-20, vectors / np.where(lengths > 1e-20, lengths, 1), spare)
