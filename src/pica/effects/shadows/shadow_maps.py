"""Shadows without rays: depth maps seen from the lights, filtered as wide as the penumbra should be."""

import slangpy as spy

from pica.effects.lighting.light_slots import LightSlots
from pica.effects.shadows.light_maps import LightMaps
from pica.effects.shadows.shadows import ShadowTextures
from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.scene import GpuScene
from pica.rhi.device import Device
from pica.settings import Settings


class ShadowMaps:
    """Which part of each mapped light reaches each pixel; all of every other light does."""

    def __init__(self, device: Device, size: Size, settings: Settings) -> None:
        self._device, self._size, self._settings = device, size, settings
        self._bits = device.texture("shadow visibility", spy.Format.rg32_uint, size)
        self.filtered = self._shares(1)
        """Share of each mapped light that reaches the pixel (width, height, slots, rgba16_float), of the last frame."""
        self._lookup = device.compute("effects/shadows/map_lookup.slang", name="shadow map lookup")
        self._nearest = device.sampler(
            min_filter=spy.TextureFilteringMode.point, mag_filter=spy.TextureFilteringMode.point
        )
        self.maps = LightMaps(device, settings.shadow_maps, [])

    def reset(self) -> None:
        """Nothing to drop: maps know no history."""

    def debug_views(self) -> dict[str, spy.Texture]:
        """Nothing lies between the maps and the shadows."""
        return {}

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, scene: GpuScene, slots: LightSlots, moved: bool
    ) -> ShadowTextures:
        """The shadows of this frame; `moved` makes no difference, as the maps know what they show."""
        if slots.denoised is not self.maps.nodes:
            self.maps.give_back()
            self.maps = LightMaps(self._device, self._settings.shadow_maps, slots.denoised)
            self._device.give_back(self.filtered)
            self.filtered = self._shares(max(len(slots.denoised), 1))
        self.maps.update(frame, scene)
        self._lookup(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightSlots=slots,
            nearest=self._nearest,
            soft=int(self._settings.shadows.mode == "soft"),
            taps=self._settings.shadow_maps.taps,
            visibility=self._bits,
            filtered=self.filtered,
            **self.maps.parameters,
        )
        return ShadowTextures(self._bits, self.filtered, samples=None)

    def _shares(self, layers: int) -> spy.Texture:
        return self._device.texture("map shadows", spy.Format.rgba16_float, self._size, layers=layers)
