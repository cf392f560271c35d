"""The surface at one point of the picture, by a camera ray through it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.view import SceneView
from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_ROWS = 3
"""float4s of `found` in pick_ray.slang."""


class PickedPoint(NamedTuple):
    """What the ray has met."""

    record: int
    primitive: int
    """Its number in the record: a triangle, or another primitive."""
    distance: float
    """Metres from the ray's origin."""
    position: NDArray[np.float64]
    """(3,) metres."""
    normal: NDArray[np.float64]
    """(3,) geometric, unit length, towards the ray's origin."""


class PickRay:
    """Traces one ray at a time. Not a stage of the frame: it is compiled at first use."""

    def __init__(self, device: Device, tracer: Tracer | None) -> None:
        """Raises DeviceError if nothing traces rays on the device."""
        self._device = device
        self._trace = ray_effect(device, "renderer/pick_ray.slang", "PickRay", "hit", tracer)
        self._found = device.buffer("picked point", size=16 * _ROWS, struct_size=16)

    def __call__(
        self, frame: ParameterBlock, scene: SceneView, place: tuple[float, float], through_glass: bool
    ) -> PickedPoint | None:
        """The surface at `place`, (right, down) in output pixels from the upper left corner, in the frame of these
        constants; None for the background. Waits for the device.

        `through_glass`: pass transmissive surfaces, and points of blended ones that are not nearly opaque.
        """
        with self._device.record() as recording:
            values = {"place": place, "throughGlass": int(through_glass), "found": self._found}
            self._trace(recording, (1, 1), frame=frame, scene=scene, **values)
        rows = self._found.to_numpy().view(np.float32).reshape(_ROWS, 4)
        record, primitive = rows[0, :2].view(np.uint32).tolist()
        if record == 0:
            return None
        position, normal = rows[1:, :3].astype(np.float64)
        return PickedPoint(record - 1, primitive, float(rows[0, 2]), position, normal)
