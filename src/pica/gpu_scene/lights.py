"""Everything that shines in one table: the lights, all emissive triangles as one entry, the environment as one."""

from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.environment_tables import build_tables
from pica.gpu_scene.light_table import (
    LIGHT_DTYPE,
    LIGHT_TYPES,
    LUMINANCE,
    light_power,
    pack_light,
    scene_radius,
    selection_probabilities,
)
from pica.gpu_scene.materials import average_emission
from pica.rhi.device import Device
from pica.scene.environment import Environment
from pica.scene.model import Scene, Section

# shaders/scene_types.slang: EmissiveTriangle
EMISSIVE_TRIANGLE = np.dtype([("record", "u4"), ("primitive", "u4"), ("cumulative", "f4")])
_EVEN_SHARE = 0.5
"""Of the choice among lights that ignores their power: no light far from the others starves."""


class LightTable:
    """The rows of shaders/lights.slang, strongest light first, and what goes with them."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        records: NDArray[np.void],
        instances: NDArray[np.void],
        sections: list[Section],
    ) -> None:
        """`records`, `instances` and `sections` as in GpuScene; the records learn where their triangles shine."""
        radius = scene_radius(scene)
        lights = [(light_power(node.light, node.world, radius), node) for node in scene.nodes() if node.light]
        lights.sort(key=lambda pair: -pair[0])
        self._nodes = [node for _, node in lights]
        self.light_count = len(lights)
        powers = [power for power, _ in lights]
        rows = [pack_light(node.light, node.world) for node in self._nodes if node.light]

        emissive, emissive_power = _emissive_triangles(records, instances, sections)
        self.emissive_light = len(rows) if len(emissive) else None
        if len(emissive):
            rows.append(_marker("emissive_triangles"))
            powers.append(emissive_power)
        environment = scene.environment
        self.environment_light = len(rows) if environment is not None and environment.radiance.any() else None
        if environment is not None and self.environment_light is not None:
            rows.append(_marker("environment"))
            powers.append(_environment_power(environment, radius))

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
            "environment": _environment_map(device, environment),
            "lightCount": len(rows),
            "emissiveCount": len(emissive),
            "environmentLight": len(rows) if self.environment_light is None else self.environment_light,
            "emissiveLight": len(rows) if self.emissive_light is None else self.emissive_light,
        }

    def update(self, encoder: spy.CommandEncoder) -> None:
        """Upload the lights anew after some moved. How often each is chosen stays as it was."""
        for index, node in enumerate(self._nodes):
            if node.light is not None:
                share = self._table[index]["selectionProbability"]
                self._table[index] = pack_light(node.light, node.world)
                self._table[index]["selectionProbability"] = share
        encoder.upload_buffer_data(self._buffer, 0, self._table.view(np.uint8))


def _marker(kind: str) -> NDArray[np.void]:
    row = np.zeros((), LIGHT_DTYPE)
    row["type"] = LIGHT_TYPES[kind]
    return row


def _emissive_triangles(
    records: NDArray[np.void], instances: NDArray[np.void], sections: list[Section]
) -> tuple[NDArray[np.void], float]:
    tables, powers = [], []
    first = 0
    for index, section in enumerate(sections):
        radiance = average_emission(section.material)
        if radiance <= 0:
            continue
        transform = instances[records[index]["instance"]]["to_world"].astype(np.float64)
        corners = section.positions[section.indices].astype(np.float64) @ transform[:, :3].T
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        sides = 2 if section.material.double_sided else 1
        table = np.zeros(len(area), EMISSIVE_TRIANGLE)
        table["record"], table["primitive"] = index, np.arange(len(area))
        records[index]["first_emissive"] = first
        tables.append(table)
        powers.append(area * radiance * np.pi * sides)
        first += len(area)
    if not tables:
        return np.zeros(0, EMISSIVE_TRIANGLE), 0.0
    table, power = np.concatenate(tables), np.concatenate(powers)
    total = float(power.sum())
    table["cumulative"] = np.cumsum(power) / max(total, 1e-300)
    table["cumulative"][-1] = 1.0
    return table, total


def _environment_power(environment: Environment, radius: float) -> float:
    """Lumen that fall onto a sphere round the scene (Pharr, Jakob and Humphreys 2023, section 12.5.2)."""
    height = environment.radiance.shape[0]
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    rows = (environment.radiance.astype(np.float64) @ LUMINANCE).mean(axis=1)
    integral = float(rows @ (edges[:-1] - edges[1:])) * 2 * np.pi
    return integral * environment.strength * np.pi * radius**2


def _environment_map(device: Device, environment: Environment | None) -> dict[str, Any]:
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
