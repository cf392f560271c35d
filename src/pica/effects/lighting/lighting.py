"""Direct lighting: every light with the one BRDF, times the visibility that the shadow rays found."""

import slangpy as spy

from pica.effects.lighting.ltc_tables import LtcTables
from pica.effects.lighting.prefiltered import PrefilteredEnvironment
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Effect
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.light_sampling.shadow_textures import ShadowTextures
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import LightingSettings


class DirectLighting(Effect):
    """Radiance towards the camera from emission and direct light (width, height, rgba32_float), nits."""

    name = "lighting"

    def __init__(self, device: Device, size: Size, settings: LightingSettings) -> None:
        self._device = device
        self._radiance = device.texture("radiance", spy.Format.rgba32_float, size)
        self._no_shadows = device.texture("no shadows", spy.Format.rg32_uint, (1, 1))
        self._not_filtered = device.texture("no filtered shadows", spy.Format.rgba16_float, (1, 1), layers=1)
        self._ltc_tables = LtcTables(device)
        self._no_noisy = device.texture("no noisy light", spy.Format.rgba32_float, (1, 1), layers=2)
        self._nothing_mirrored = device.texture("no mirrored surroundings", spy.Format.rgba32_float, (1, 1))
        self._no_occlusion = device.texture("no occlusion", spy.Format.r16_float, (1, 1))
        self._prefiltered = PrefilteredEnvironment(device, wanted=settings.environment == "prefiltered")
        self._direct = programs(device).compute("effects/lighting/direct.slang", name="lighting")

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(self._radiance)
        self._radiance = self._device.texture("radiance", spy.Format.rgba32_float, size)

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        shadows: ShadowTextures | None,
        occlusion: spy.Texture | None,
        noisy: spy.Texture | None,
        mirrored: spy.Texture | None,
    ) -> spy.Texture:
        """The lit picture of this frame; without `shadows` nothing casts any.

        `noisy`: where the light of noisy slots goes (StochasticLightDenoiser.samples); it is not in the picture then.
        None where there are none.

        `mirrored`: where what surfaces mirror of the prefiltered environment goes, likewise (Reflections.surroundings).

        `occlusion`: the open share of each pixel's surroundings, which dims the prefiltered environment, the only light
        here that has no shadows of its own.
        """
        self._prefiltered.update(frame, scene)
        self._direct(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightSlots=light.slots,
            lightSamples=light.samples,
            visibility=shadows.bits if shadows else self._no_shadows,
            shadowed=int(shadows is not None),
            filteredShadows=shadows.filtered if shadows else self._not_filtered,
            shadowSamples=(shadows and shadows.samples) or self._not_filtered,
            sampledShadows=int(shadows is not None and shadows.samples is not None),
            ltcTables=self._ltc_tables,
            occlusion=occlusion or self._no_occlusion,
            occluded=int(occlusion is not None),
            prefiltered=self._prefiltered,
            radiance=self._radiance,
            mirroredSurroundings=mirrored or self._nothing_mirrored,
            keepsMirrored=int(mirrored is not None),
            noisyLight=noisy or self._no_noisy,
        )
        return self._radiance
