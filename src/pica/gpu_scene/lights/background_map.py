"""What pixels without a surface show in place of the environment, on the GPU."""

from typing import Any

import numpy as np
import slangpy as spy

from pica.rhi.device import Device
from pica.scene.environment import Environment
from pica.scene.light import Color


class BackgroundMap:
    """A scene's background on the device, as a picture: a colour is one texel, and so is none."""

    def __init__(self, device: Device, background: Color | Environment | None) -> None:
        self._device = device
        self.revision = 0
        """Counts how often it was replaced."""
        self.source = background
        """The background it was made of."""
        self.fields = self._made()
        """Fields of BackgroundMap in shaders/environment.slang."""

    def replace(self, background: Color | Environment | None) -> None:
        """Show another one."""
        self._device.give_back(self.fields["radiance"])
        self.source = background
        self.fields = self._made()
        self.revision += 1

    def _made(self) -> dict[str, Any]:
        shown = self.source
        if not isinstance(shown, Environment):
            shown = Environment(np.full((1, 1, 3), shown or (0.0, 0.0, 0.0), np.float32))
        height, width, _ = shown.radiance.shape
        texture = self._device.texture("background", spy.Format.rgba32_float, (width, height))
        texture.copy_from_numpy(np.dstack([shown.radiance, np.ones((height, width), np.float32)]))
        return {
            "radiance": texture,
            "sampler": self._device.sampler(
                address_u=spy.TextureAddressingMode.wrap, address_v=spy.TextureAddressingMode.clamp_to_edge
            ),
            "strength": shown.strength,
            "rotation": shown.rotation,
            "isShown": int(self.source is not None),
        }
