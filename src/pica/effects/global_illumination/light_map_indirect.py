"""Indirect light from a volumetric light map that was baked before (RTG 19, 19.3.3.2)."""

from collections.abc import Mapping

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov
from pica.frame.gbuffer import GBuffer
from pica.frame.indirect import ENDLESS
from pica.gpu_scene.view import SceneView
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
        self._apply = programs(device).compute("effects/global_illumination/light_map_apply.slang")
        self._no_occlusion = device.texture("no occlusion", spy.Format.r16_float, (1, 1))

    def resize(self, size: Size) -> None:
        """Nothing depends on it."""

    def reset(self) -> None:
        """There is no history."""

    def debug_aovs(self) -> dict[str, Aov]:
        """None but what each pixel gets."""
        return {}

    def ray_counts(self) -> dict[str, int]:
        """None."""
        return {}

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        occlusion: spy.Texture | None,
        pictures: Mapping[str, spy.Texture],
    ) -> None:
        """Write this frame's to the pictures `arriving` and `indirect` and add it to `radiance`."""
        self._apply(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightMap=self._light_map,
            occlusion=occlusion or self._no_occlusion,
            occluded=int(occlusion is not None),
            **pictures,
        )
