"""Shadows without rays: depth maps seen from the lights, filtered as wide as the penumbra should be."""

import slangpy as spy

from pica.effects.shadow_maps.light_maps import LightMaps
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect
from pica.frame.gbuffer import GBuffer
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.light_sampling.shadow_textures import ShadowTextures, visibility_aov
from pica.rhi.device import Device
from pica.settings import Settings


class ShadowMaps(Effect):
    """Which part of each mapped light reaches each pixel; all of every other light does."""

    name = "shadows"
    aov_names = ("shadows",)

    def __init__(self, device: Device, size: Size, settings: Settings) -> None:
        self._device, self._size, self._settings = device, size, settings
        self._slot_count = 0
        self._bits = device.texture("shadow visibility", spy.Format.rg32_uint, size)
        self.filtered = self._shares(1)
        """Share of each mapped light that reaches the pixel (width, height, slots, rgba16_float), of the last frame."""
        self._lookup = device.compute("effects/shadow_maps/map_lookup.slang", name="shadow map lookup")
        self._nearest = device.sampler(
            min_filter=spy.TextureFilteringMode.point, mag_filter=spy.TextureFilteringMode.point
        )
        self.maps = LightMaps(device, settings.shadow_maps, [])

    def resize(self, size: Size) -> None:
        """As Effect; the maps stay."""
        layers = self.filtered.array_length
        self._device.give_back(self._bits, self.filtered)
        self._size = size
        self._bits = self._device.texture("shadow visibility", spy.Format.rg32_uint, size)
        self.filtered = self._shares(layers)

    def aovs(self) -> dict[str, Aov]:
        """shadows: (height, width, slots) 1 where the light arrives, else 0."""
        return {"shadows": visibility_aov(self._bits, self._slot_count)}

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        reprojection: Reprojection,
    ) -> ShadowTextures:
        """The shadows of this frame, which need no history."""
        slots = light.slots
        self._slot_count = slots.count
        if slots.denoised is not self.maps.nodes:
            self.maps.give_back()
            self.maps = LightMaps(self._device, self._settings.shadow_maps, slots.denoised)
            self._device.give_back(self.filtered)
            self.filtered = self._shares(max(len(slots.denoised), 1))
        self.maps.update(frame, scene)
        # Groups of 64 threads for 8 x 8 pixels; one pixel more each way, by which squares of pixels are moved.
        columns, rows = frame.size[0] // 8 + 1, frame.size[1] // 8 + 1
        self._lookup(
            frame,
            (64 * columns, rows, 1),
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
