"""How far lights move between frames, on the device."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pica.frame.context import FrameContext
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight
from pica.scene.model import Node

FOLLOWED_LIGHTS = 32
"""light_motions.slang: FOLLOWED_LIGHTS."""


class LightMotions:
    """Metres that the first lights of the table have moved since the frame before.

    Of directional ones the change of the direction to them. float32 (FOLLOWED_LIGHTS, 4) in `buffer`, w unused.
    """

    def __init__(self, device: Device) -> None:
        self._places: dict[Node, NDArray[np.float64]] = {}
        self._motions = np.zeros((FOLLOWED_LIGHTS, 4), np.float32)
        self.buffer = device.structured("light motions", self._motions)
        self.moved = False
        """Whether any light has moved."""

    def follow(self, frame: FrameContext, lights: Sequence[Node]) -> None:
        """Measure the motion of `lights`, in the order of the buffer's rows; new ones have not moved."""
        if not (frame.changed_lights or self.moved):
            return
        places = {light: _place(light) for light in lights[:FOLLOWED_LIGHTS]}
        had_moved = self.moved
        self._motions[:] = 0
        for row, (light, place) in zip(self._motions, places.items(), strict=False):
            row[:3] = place - self._places.get(light, place)
        self._places = places
        self.moved = bool(self._motions.any())
        if self.moved or had_moved:
            frame.encoder.upload_buffer_data(self.buffer, 0, self._motions.view(np.uint8))

    def have_moved(self, frame: FrameContext) -> int:
        """1 if any light has, as a parameter of passes."""
        return int(self.moved)


def _place(light: Node) -> NDArray[np.float64]:
    """Where it is; of a directional light the direction to it."""
    return light.world[:3, 2 if isinstance(light.light, DirectionalLight) else 3]
