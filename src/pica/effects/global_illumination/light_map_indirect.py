"""Indirect light from a volumetric light map that was baked before (RTG 19, 19.3.3.2)."""

from collections.abc import Mapping

import slangpy as spy

from pica.effects.global_illumination.views import light_map_views
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.view import SceneView
from pica.light_map.gpu_light_map import GpuLightMap
from pica.light_map.light_map import LightMap
from pica.programs.library import programs
from pica.rhi.device import Device


class LightMapIndirect:
    """Indirect light that a light map has; without any rays or history."""

    bounces = 16
    """No limit, about."""
    is_smooth = True
    """The light in each pixel is the mean of many rays."""

    def __init__(self, device: Device, size: Size, light_map: LightMap) -> None:
        self._device = device
        self._light_map = GpuLightMap(device, light_map)
        self._apply = programs(device).compute("effects/global_illumination/light_map_apply.slang")
        self._no_occlusion = device.texture("no occlusion", spy.Format.r16_float, (1, 1))
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        self._arriving = self._device.texture("light of the light map", spy.Format.rgba32_float, size)

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._device.give_back(self._arriving)
        self._allocate(size)

    @property
    def arriving(self) -> spy.Texture:
        """(width, height, rgba32_float) light that arrives in each pixel, over albedo in nits; alpha 0: not known."""
        return self._arriving

    def reset(self) -> None:
        """There is no history."""

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py."""
        return light_map_views(self._arriving)

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
        """Write this frame's to the picture `indirect` and add it to `radiance`."""
        self._apply(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightMap=self._light_map,
            occlusion=occlusion or self._no_occlusion,
            occluded=int(occlusion is not None),
            arriving=self._arriving,
            **pictures,
        )
