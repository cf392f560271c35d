"""All light sources in one table: the lights, all emissive triangles as one entry, the environment as one."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.lights.emissive_triangles import EmissiveTriangles, emissive_table
from pica.gpu_scene.lights.environment_map import EnvironmentMap
from pica.gpu_scene.lights.light_rows import LIGHT_DTYPE, LIGHT_TYPES, selection_probabilities
from pica.gpu_scene.lights.placed_lights import PlacedLights
from pica.rhi.device import Device
from pica.scene.channels import ALL_CHANNELS, channel_bits

_EVEN_SHARE = 0.5
"""Fraction of the selection that ignores power, so that no light far from the others is missed."""


class LightTable:
    """The rows of gpu_scene/lights/lights.slang, strongest light first, and their parameters.

    It is replaced when a light source is added or removed.
    """

    def __init__(
        self,
        device: Device,
        lights: PlacedLights,
        triangles: Sequence[EmissiveTriangles],
        environment: EnvironmentMap,
        radius: float,
    ) -> None:
        """`radius`: metres, of the scene (light_rows.scene_radius)."""
        self._slots, self.nodes, powers = lights.strongest_first(radius)
        """`nodes`: of the lights with a shape of their own, by place in the table."""
        self._radius = radius
        self.light_count = len(self.nodes)
        self.names = [node.light.name or node.name for node in self.nodes if node.light]
        """The lights' names, in the order of their rows."""
        markers, self._others = list[NDArray[np.void]](), list[float]()
        emissive, emissive_power = emissive_table(triangles)
        self.emissive_light = self.light_count if len(emissive) else None
        if len(emissive):
            markers.append(_marker("emissive_triangles"))
            self._others.append(emissive_power)
        lit = environment.is_lit
        self.environment_light = self.light_count + len(markers) if lit else None
        if lit:
            markers.append(_marker("environment"))
            self._others.append(environment.power(radius))

        table = np.append(lights.rows(self._slots), np.array(markers, LIGHT_DTYPE))
        self._table = table
        cumulative = self._select(powers)
        self._buffer = device.structured("lights", table)
        self._cumulative = device.structured("light cumulative", cumulative)
        self.parameters: dict[str, Any] = {
            "lights": self._buffer,
            "lightCumulative": self._cumulative,
            "emissiveTriangles": device.structured("emissive triangles", emissive),
            "lightCount": len(table),
            "emissiveCount": len(emissive),
            "environmentLight": len(table) if self.environment_light is None else self.environment_light,
            "emissiveLight": len(table) if self.emissive_light is None else self.emissive_light,
        }

    @property
    def masked(self) -> bool:
        """Whether some light does not reach every channel."""
        return bool((self._table["channels"][: self.light_count] != channel_bits(ALL_CHANNELS)).any())

    def buffers(self) -> list[spy.Buffer]:
        """Its buffers on the device."""
        return [value for value in self.parameters.values() if isinstance(value, spy.Buffer)]

    def update(self, encoder: spy.CommandEncoder, lights: PlacedLights) -> None:
        """Upload the rows after lights moved or were set. Their order stays."""
        if self.light_count == 0:
            return
        self._table[: self.light_count] = lights.rows(self._slots)
        cumulative = self._select(lights.powers(self._slots, self._radius))
        encoder.upload_buffer_data(self._buffer, 0, self._table.view(np.uint8))
        encoder.upload_buffer_data(self._cumulative, 0, cumulative)

    def _select(self, powers: NDArray[np.float64]) -> NDArray[np.float32]:
        """Set the rows' selection probabilities from the powers of the lights; returns their sums up to each row."""
        shares = selection_probabilities([*powers, *self._others])
        shares = shares * (1 - _EVEN_SHARE) + _EVEN_SHARE / max(len(shares), 1)
        self._table["selectionProbability"] = shares
        cumulative = np.cumsum(shares.astype(np.float64)).astype(np.float32)
        cumulative[-1:] = 1.0
        return cumulative


def _marker(kind: str) -> NDArray[np.void]:
    row = np.zeros((), LIGHT_DTYPE)
    row["type"] = LIGHT_TYPES[kind]
    return row
