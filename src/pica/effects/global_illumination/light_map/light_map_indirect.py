"""Indirect light from a volumetric light map that was baked before (RTG 19, 19.3.3.2)."""

import slangpy as spy

from pica.frame.signals.indirect import ENDLESS, IndirectPictures
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture
from pica.light_map.gpu_light_map import GpuLightMap, light_map_cache
from pica.light_map.light_map import LightMap
from pica.programs.library import programs
from pica.rhi.device import Device


class LightMapIndirect:
    """Indirect light that a light map has; without any rays or history."""

    bounces, is_smooth = ENDLESS, True

    def __init__(self, device: Device, light_map: LightMap) -> None:
        self._light_map = GpuLightMap(device, light_map)
        self.cache = light_map_cache(self._light_map)
        self._apply = programs(device).compute("effects/global_illumination/light_map/light_map_apply.slang")

    def reset(self) -> None:
        """There is no history."""

    def __call__(self, graph: FrameGraph, occlusion: Texture | None, pictures: IndirectPictures) -> None:
        """Fill the pictures."""
        graph.add(
            self._apply,
            graph.grid,
            lightMap=self._light_map,
            occlusion=occlusion or graph.nothing(spy.Format.r16_float),
            occluded=int(occlusion is not None),
            **pictures.arguments(),
        )
