"""The scene's environment on the GPU: its picture and the tables that sample it."""

from typing import Any

import numpy as np
import slangpy as spy

from pica.gpu_scene.lights.environment_tables import build_tables
from pica.gpu_scene.lights.light_rows import LUMINANCE
from pica.rhi.device import Device
from pica.scene.environment import Environment


def environment_power(environment: Environment, radius: float) -> float:
    """Lumen that fall onto a sphere round the scene (Pharr, Jakob and Humphreys 2023, section 12.5.2)."""
    height = environment.radiance.shape[0]
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    rows = (environment.radiance.astype(np.float64) @ LUMINANCE).mean(axis=1)
    integral = float(rows @ (edges[:-1] - edges[1:])) * 2 * np.pi
    return integral * environment.strength * np.pi * radius**2


class EnvironmentMap:
    """A scene's environment on the device; black without one."""

    def __init__(self, device: Device, environment: Environment | None) -> None:
        self._device = device
        self.revision = 0
        """Counts how often it was replaced."""
        self.source = environment
        """The environment it was made of."""
        self.fields = self._made()
        """Fields of EnvironmentMap in shaders/environment.slang."""

    def replace(self, environment: Environment | None) -> None:
        """Show another one."""
        self._device.give_back(*(self.fields[name] for name in ("radiance", "marginal", "conditional")))
        self.source = environment
        self.fields = self._made()
        self.revision += 1

    def _made(self) -> dict[str, Any]:
        device, environment = self._device, self.source
        radiance = np.zeros((1, 1, 3), np.float32) if environment is None else environment.radiance
        height, width, _ = radiance.shape
        texture = device.texture("environment", spy.Format.rgba32_float, (width, height))
        texture.copy_from_numpy(np.dstack([radiance, np.ones((height, width), np.float32)]).astype(np.float32))
        marginal, conditional = build_tables(radiance)
        return {
            "radiance": texture,
            "sampler": device.sampler(
                address_u=spy.TextureAddressingMode.wrap, address_v=spy.TextureAddressingMode.clamp_to_edge
            ),
            "marginal": device.structured("environment rows", marginal),
            "conditional": device.structured("environment texels", conditional.reshape(-1)),
            "size": spy.uint2(width, height),
            "strength": 1.0 if environment is None else environment.strength,
            "rotation": 0.0 if environment is None else environment.rotation,
        }
