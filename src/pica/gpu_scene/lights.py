"""Everything that shines in one table: the lights, all emissive triangles as one entry, the environment as one."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.environment import environment_power
from pica.gpu_scene.light_table import (
    LIGHT_DTYPE,
    LIGHT_TYPES,
    light_power,
    pack_light,
    scene_radius,
    selection_probabilities,
)
from pica.gpu_scene.materials import average_emission
from pica.rhi.device import Device
from pica.scene.channels import ALL_CHANNELS, channel_bits
from pica.scene.model import Node, Scene, Section

# shaders/scene_types.slang: EmissiveTriangle
EMISSIVE_TRIANGLE = np.dtype([("record", "u4"), ("primitive", "u4"), ("cumulative", "f4")])
_EVEN_SHARE = 0.5
"""Of the choice among lights that ignores their power: no light far from the others starves."""


@dataclass(frozen=True)
class EmissiveSection:
    """A placed section that shines."""

    record: int
    section: Section
    to_world: NDArray[np.float32]
    """(3, 4)"""


class LightTable:
    """The rows of shaders/lights.slang, strongest light first, and what goes with them.

    Made anew when something that shines comes or goes.
    """

    def __init__(self, device: Device, scene: Scene, emissive_sections: list[EmissiveSection]) -> None:
        radius = scene_radius(scene)
        lights = [(light_power(node.light, node.world, radius), node) for node in scene.nodes() if node.light]
        lights.sort(key=lambda pair: -pair[0])
        self.nodes = [node for _, node in lights]
        """Of the lights with a shape of their own, by place in the table."""
        self._lit = frozenset(self.nodes)
        self.light_count = len(lights)
        self.names = [node.light.name or node.name for node in self.nodes if node.light]
        """What the lights are called, in the order of their rows."""
        powers = [power for power, _ in lights]
        rows = [pack_light(node.light, node.world) for node in self.nodes if node.light]

        emissive, emissive_power, self.first_emissive = _emissive_triangles(emissive_sections)
        self.emissive_light = len(rows) if len(emissive) else None
        if len(emissive):
            rows.append(_marker("emissive_triangles"))
            powers.append(emissive_power)
        environment = scene.environment
        self.environment_light = len(rows) if environment is not None and environment.radiance.any() else None
        if environment is not None and self.environment_light is not None:
            rows.append(_marker("environment"))
            powers.append(environment_power(environment, radius))

        table = np.array(rows, LIGHT_DTYPE)
        shares = selection_probabilities(powers) * (1 - _EVEN_SHARE) + _EVEN_SHARE / max(len(rows), 1)
        table["selectionProbability"] = shares
        self._table = table
        self._buffer = device.structured("lights", table)
        cumulative = np.cumsum(shares.astype(np.float64)).astype(np.float32)
        if len(cumulative):
            cumulative[-1] = 1.0
        self.parameters: dict[str, Any] = {
            "lights": self._buffer,
            "lightCumulative": device.structured("light cumulative", cumulative),
            "emissiveTriangles": device.structured("emissive triangles", emissive),
            "lightCount": len(rows),
            "emissiveCount": len(emissive),
            "environmentLight": len(rows) if self.environment_light is None else self.environment_light,
            "emissiveLight": len(rows) if self.emissive_light is None else self.emissive_light,
        }

    @property
    def masked(self) -> bool:
        """Whether some light does not reach every channel."""
        return bool((self._table["channels"][: self.light_count] != channel_bits(ALL_CHANNELS)).any())

    def has(self, node: Node) -> bool:
        """Whether the node's light is in the table."""
        return node in self._lit

    def buffers(self) -> list[spy.Buffer]:
        """What the table takes on the device."""
        return [value for value in self.parameters.values() if isinstance(value, spy.Buffer)]

    def update(self, encoder: spy.CommandEncoder) -> None:
        """Upload the lights anew after some moved or were set. How often each is chosen stays as it was."""
        for index, node in enumerate(self.nodes):
            if node.light is not None:
                share = self._table[index]["selectionProbability"]
                self._table[index] = pack_light(node.light, node.world)
                self._table[index]["selectionProbability"] = share
        encoder.upload_buffer_data(self._buffer, 0, self._table.view(np.uint8))


def _marker(kind: str) -> NDArray[np.void]:
    row = np.zeros((), LIGHT_DTYPE)
    row["type"] = LIGHT_TYPES[kind]
    return row


def _emissive_triangles(sections: list[EmissiveSection]) -> tuple[NDArray[np.void], float, dict[int, int]]:
    """The table, the power of all in lumen, and where each record's triangles start."""
    tables, powers, starts = [], [], {}
    first = 0
    for shining in sections:
        section = shining.section
        transform = shining.to_world.astype(np.float64)
        corners = section.positions[section.indices].astype(np.float64) @ transform[:, :3].T
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        sides = 2 if section.material.double_sided else 1
        table = np.zeros(len(area), EMISSIVE_TRIANGLE)
        table["record"], table["primitive"] = shining.record, np.arange(len(area))
        starts[shining.record] = first
        tables.append(table)
        powers.append(area * average_emission(section.material) * np.pi * sides)
        first += len(area)
    if not tables:
        return np.zeros(0, EMISSIVE_TRIANGLE), 0.0, starts
    table, power = np.concatenate(tables), np.concatenate(powers)
    total = float(power.sum())
    table["cumulative"] = np.cumsum(power) / max(total, 1e-300)
    table["cumulative"][-1] = 1.0
    return table, total, starts
