"""The scene's environment on the GPU: its picture and the tables that sample it."""

from typing import Any
from weakref import WeakValueDictionary

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.lights.environment_tables import build_tables
from pica.gpu_scene.lights.light_rows import LUMINANCE
from pica.rhi.device import Device
from pica.scene.environment import Environment

_BLACK = np.zeros((1, 1, 3), np.float32)


class _Tables:
    """Radiance as a texture, and the tables that sample it; freed with its last user."""

    def __init__(self, device: Device, radiance: NDArray[np.float32]) -> None:
        self.radiance = radiance
        height, width, _ = radiance.shape
        marginal, conditional = build_tables(radiance)
        device = device.memory_scope()
        texture = device.texture("environment", spy.Format.rgba32_float, (width, height))
        texture.copy_from_numpy(np.dstack([radiance, np.ones((height, width), np.float32)]).astype(np.float32))
        self.fields: dict[str, Any] = {
            "radiance": texture,
            "sampler": device.sampler(
                address_u=spy.TextureAddressingMode.wrap, address_v=spy.TextureAddressingMode.clamp_to_edge
            ),
            "marginal": device.structured("environment rows", marginal),
            "conditional": device.structured("environment texels", conditional.reshape(-1)),
            "size": spy.uint2(width, height),
        }
        self._device = device
        """Their memory's scope."""
        edges = np.cos(np.pi * np.arange(height + 1) / height)
        rows = (radiance.astype(np.float64) @ LUMINANCE).mean(axis=1)
        self.integral = float(rows @ (edges[:-1] - edges[1:])) * 2 * np.pi
        """Of the luminance over all directions."""


class _AllTables:
    """A device's tables in use: environments that differ in strength or rotation alone share them."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._made: WeakValueDictionary[int, _Tables] = WeakValueDictionary()
        """By the identity of the radiance, which they keep alive."""

    def of(self, radiance: NDArray[np.float32]) -> _Tables:
        tables = self._made.get(id(radiance))
        if tables is None:
            tables = self._made[id(radiance)] = _Tables(self._device, radiance)
        return tables


class EnvironmentMap:
    """A scene's environment on the device; black without one."""

    def __init__(self, device: Device, environment: Environment | None) -> None:
        self._tables = device.shared(_AllTables)
        self.revision = -1
        """Counts how often it was replaced."""
        self.replace(environment)

    def replace(self, environment: Environment | None) -> None:
        """Show another one."""
        self.source = environment
        """The environment it was made of."""
        self._shown = self._tables.of(_BLACK if environment is None else environment.radiance)
        self.fields = {
            **self._shown.fields,
            "strength": 1.0 if environment is None else environment.strength,
            "rotation": 0.0 if environment is None else environment.rotation,
        }
        """Fields of EnvironmentMap in shaders/environment.slang."""
        self.revision += 1

    @property
    def is_lit(self) -> bool:
        """Whether any light comes from it, at some strength."""
        return self._shown.integral > 0

    def power(self, radius: float) -> float:
        """Lumen that fall onto a sphere round the scene (Pharr, Jakob and Humphreys 2023, section 12.5.2)."""
        strength = 0.0 if self.source is None else self.source.strength
        return self._shown.integral * strength * np.pi * radius**2
