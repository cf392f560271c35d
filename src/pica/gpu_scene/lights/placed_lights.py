"""The lights of a scene's nodes, packed when they change."""

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.lights.light_rows import LIGHT_DTYPE, light_power, pack_light
from pica.gpu_scene.morton import morton_codes
from pica.rhi.tables import Runs
from pica.scene.light import DirectionalLight
from pica.scene.model import Node

_PLACED = np.dtype([("row", LIGHT_DTYPE), ("power", "f8"), ("power_by_area", "f8"), ("arrival", "i8")])
_RANKED = 32
"""Strongest lights: more than can have a slot of their own (settings shadows.max_lights, shadow_maps.max_lights)."""


class PlacedLights:
    """Rows by slot; a light keeps its slot until it is removed."""

    def __init__(self) -> None:
        self._slots: dict[Node, int] = {}
        self._nodes: list[Node | None] = []
        self._places = Runs()
        self._placed = np.zeros(0, _PLACED)
        self._arrivals = 0
        self.revision = 0
        """Counts how often lights came or went."""

    def follow(self, node: Node) -> None:
        """Update a node's light: added, removed, moved or set."""
        light = node.light
        if light is None:
            self.remove(node)
            return
        if node not in self._slots:
            self._take_slot(node)
        # The power of a directional light grows with the cross-section of the scene.
        far = isinstance(light, DirectionalLight)
        power = light_power(light, node.world, 1.0)
        placed = self._placed[self._slots[node]]
        placed["row"] = pack_light(light, node.world)
        placed["power"], placed["power_by_area"] = (0.0, power) if far else (power, 0.0)

    def has(self, node: Node) -> bool:
        """Whether the node's light is among them."""
        return node in self._slots

    def remove(self, node: Node) -> None:
        """Remove the node's light, if it has one."""
        slot = self._slots.pop(node, None)
        if slot is not None:
            self._nodes[slot] = None
            self._places.give_back(slot, 1)
            self.revision += 1

    def rows(self, slots: NDArray[np.int64]) -> NDArray[np.void]:
        """(n,) LIGHT_DTYPE rows as they are now, selection probability 0."""
        return self._placed["row"][slots]

    def powers(self, slots: NDArray[np.int64], radius: float) -> NDArray[np.float64]:
        """(n,) lumen, as they are now, in a scene of `radius` metres."""
        placed = self._placed[slots]
        return np.asarray(placed["power"] + placed["power_by_area"] * radius**2)

    def strongest_first(self, radius: float) -> tuple[NDArray[np.int64], list[Node], NDArray[np.float64]]:
        """Slots, nodes and powers in lumen, in a scene of `radius` metres; equal ones in order of addition.

        The strongest directional light comes first: its shadow covers the most pixels. Lights beyond the _RANKED
        strongest follow a curve through space, so that lights side by side in the table are neighbours, and clusters
        of them small (light_sampling/light_clusters.slang).
        """
        slots = np.fromiter(self._slots.values(), np.int64, len(self._slots))
        placed, powers = self._placed[slots], self.powers(slots, radius)
        order = np.lexsort((placed["arrival"], -powers))
        suns = np.flatnonzero(placed["power_by_area"][order] > 0)
        if len(suns):
            order = np.append(order[suns[0]], np.delete(order, suns[0]))
        weaker = order[_RANKED:]
        if len(weaker):
            order[_RANKED:] = weaker[np.argsort(morton_codes(placed["row"]["position"][weaker]), kind="stable")]
        slots = slots[order]
        nodes = [node for slot in slots.tolist() if (node := self._nodes[slot]) is not None]
        return slots, nodes, powers[order]

    def _take_slot(self, node: Node) -> None:
        slot = self._slots[node] = self._places.take(1)
        if slot >= len(self._placed):
            self._placed = np.append(self._placed, np.zeros(max(slot + 1 - len(self._placed), slot, 8), _PLACED))
            self._nodes += [None] * (len(self._placed) - len(self._nodes))
        self._nodes[slot] = node
        self._placed[slot]["arrival"] = self._arrivals = self._arrivals + 1
        self.revision += 1
