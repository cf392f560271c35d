"""What a pixel shows: `Renderer.pick`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.frame.context import FrameSequence
from pica.gpu_scene.view import SceneView
from pica.renderer.pick_ray import PickedPoint, PickRay
from pica.rhi.device import Device
from pica.scene.material import Material
from pica.scene.mesh import Mesh
from pica.scene.model import Node
from pica.tracing.ray_buffers import Tracer


@dataclass(frozen=True, eq=False)
class Picked:
    """A point of a surface, as `Renderer.pick` finds it."""

    node: Node
    mesh: Mesh
    """The node's, as it was in the frame."""
    section: int | None
    """In `mesh.sections`; None: not triangles."""
    primitives: int | None
    """In `mesh.primitives`; None: triangles."""
    element: int
    """Number of the triangle in the section, or of the primitive in the primitives."""
    instance: int
    """In `node.instances`; 0 for a node without them."""
    material: Material
    position: NDArray[np.float64]
    """(3,) world space, metres."""
    normal: NDArray[np.float64]
    """(3,) world space, unit length, without normal maps or interpolation, on the side that is seen."""
    distance: float
    """Metres from the camera; for an orthographic camera from the plane through it."""

    def __repr__(self) -> str:
        x, y, z = self.position.tolist()
        what = f"{self.node.name!r}, material {self.material.name!r}"
        return f"<pica.Picked of node {what}, at ({x:.4g}, {y:.4g}, {z:.4g}), {self.distance:.4g} m away>"


def _picked(view: SceneView, point: PickedPoint) -> Picked:
    """The objects of the scene behind the ids of a point."""
    source = view.source_of(point.record)
    return Picked(
        node=source.node,
        mesh=source.mesh,
        section=source.index if source.has_triangles else None,
        primitives=None if source.has_triangles else source.index,
        element=point.primitive,
        instance=source.instance,
        material=source.material,
        position=point.position,
        normal=point.normal,
        distance=point.distance,
    )


class Picker:
    """Rays through points of a renderer's picture."""

    def __init__(self, device: Device, tracer: Tracer | None) -> None:
        self._device, self._tracer = device, tracer
        self._ray: PickRay | None = None

    def __call__(
        self, frames: FrameSequence, view: SceneView, pixel: tuple[int, int], through_glass: bool
    ) -> Picked | None:
        """What the pixel shows with the camera of the newest frame. Raises PicaError before there is one."""
        if not frames.has_camera:
            raise PicaError("pick: there is no frame yet; call render or advance")
        if self._ray is None:  # the first one compiles it
            self._ray = PickRay(self._device, self._tracer)
        x, y = pixel
        point = self._ray(frames.block, view, (x + 0.5, y + 0.5), through_glass)
        return None if point is None else _picked(view, point)
