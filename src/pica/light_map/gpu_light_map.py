"""A light map on a device."""

import numpy as np
import slangpy as spy

from pica.frame.signals.indirect import IndirectCache
from pica.light_map.light_map import HARMONICS, LightMap
from pica.rhi.device import Device

_WORDS = 14
"""light_map.slang: LightMapProbe."""


class GpuLightMap:
    """The light map for shaders, as the block `lightMap` of light_map.slang."""

    def __init__(self, device: Device, light_map: LightMap) -> None:
        bricks = light_map.bricks
        probes = np.zeros((len(light_map.harmonics), 2 * _WORDS), np.float16)
        probes[:, : 3 * HARMONICS] = light_map.harmonics.reshape(len(probes), -1)
        probes[:, 3 * HARMONICS] = light_map.in_the_open
        self.block = device.parameter_block("light_map/light_map.slang", "lightMap")
        self.block.bind(
            origin=spy.float3(*map(float, bricks.origin)),
            spacing=float(bricks.spacing),
            size=spy.uint3(*map(int, bricks.size)),
            scale=float(light_map.scale),
            finestAt=device.structured("light map bricks", bricks.finest_at.reshape(-1)),
            probeOf=device.structured("light map corners", bricks.probe_of.reshape(-1)),
            probes=device.structured("light map probes", probes),
            seen=device.structured(
                "light map visibility", np.ascontiguousarray(light_map.seen).view(np.uint32).reshape(-1)
            ),
        )


def light_map_cache(light_map: GpuLightMap) -> IndirectCache:
    """The map as a cache of indirect light for positions outside the picture."""
    return IndirectCache("light_map/light_map_cache.slang", {"lightMap": light_map})
