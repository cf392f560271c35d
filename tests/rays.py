"""Rays from NumPy through a scene on the GPU."""

import numpy as np

from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings
from pica.tracing.ray_buffers import RayQueue
from pica.tracing.tracers import PipelineTracer

CAMERA, SURFACE, SHADOW = range(3)
"""RayType of tracing/ray.slang."""
FRONT = Camera.look_at((0, 0, 10), (0, 0, 0))
MASKS = (1, 2, 0xFC)
"""What rays of each type meet unless they say more."""

RAY = np.dtype(
    [
        ("origin", "f4", 3),
        ("minimum", "f4"),
        ("direction", "f4", 3),
        ("maximum", "f4"),
        ("type_and_mask", "u4"),
        ("seed", "u4"),
        ("packedCone", "u4"),
    ]
)
HIT = np.dtype([("distance", "f4"), ("record", "u4"), ("primitive", "u4"), ("barycentrics", "f4", 2)])


def fields_of(layout) -> list[tuple[str, int, int]]:
    """(name, offset, size) of every field of a reflected struct, nested ones as one."""
    return [(field.name, field.offset, field.type_layout.size) for field in layout.fields]


def gpu_scene(device: Device, scene: Scene) -> SceneView:
    return SceneView(device, scene, Settings())


class RayCaster:
    """Casts rays at a scene and says what they meet."""

    def __init__(self, device: Device, scene: Scene, tracer=None) -> None:
        """`tracer`: makes another tracer for this caster."""
        self.device = device
        self.scene = gpu_scene(device, scene)
        self.tracer = tracer(self) if tracer else PipelineTracer(device, self.scene)
        self.update()

    def update(self) -> None:
        with self.device.record() as recording:
            self.scene.update(recording, FRONT)

    def __call__(self, origins, directions, kind: int = SURFACE, seeds=0, minimum=0.0, maximum=1e30, mask=None):
        """(n,) HIT for (n, 3) origins and directions; `mask`: what the rays meet, one or (n,)."""
        directions = np.atleast_2d(np.float32(directions))
        origins, directions = np.broadcast_arrays(np.float32(origins), directions)
        rays = np.zeros(len(origins), RAY)
        rays["origin"], rays["direction"] = origins, directions
        rays["minimum"], rays["maximum"], rays["seed"] = minimum, maximum, seeds
        rays["type_and_mask"] = kind | np.uint32(MASKS[kind] if mask is None else mask) << 8
        source = self.device.structured("rays", rays)
        target = self.device.structured("hits", np.zeros(len(rays), HIT))
        shadows = len(rays) if kind == SHADOW else 0
        places = self.device.structured("queue", np.arange(len(rays), dtype=np.uint32))
        self.device.handle.wait_for_idle()
        with self.device.record() as recording:
            self.tracer(recording, RayQueue(source, target, places, len(rays) - shadows, shadows))
        return target.to_numpy().view(np.uint8).reshape(-1).view(HIT)
