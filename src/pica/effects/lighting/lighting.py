"""Direct lighting: every light with the one BRDF, times the visibility that the shadow rays found."""

import slangpy as spy

from pica.effects.lighting.ltc_tables import LtcTables
from pica.effects.lighting.prefiltered import PrefilteredEnvironment
from pica.frame.effect import Effect
from pica.frame.signals.light import BOTH_PARTS, NoisyLight, diffuse_of, specular_of
from pica.frame.signals.shadows import ShadowTextures
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import LightingSettings


class DirectLighting(Effect):
    """Direct light that surfaces reflect towards the camera, nits."""

    name = "lighting"
    aov_names = ("diffuse_direct", "glossy_direct")

    def __init__(self, device: Device, settings: LightingSettings) -> None:
        self._ltc_tables = LtcTables(device)
        self._prefiltered = PrefilteredEnvironment(device, enabled=settings.environment == "prefiltered")
        self._direct = programs(device).compute("effects/lighting/direct.slang", name="lighting")

    def __call__(
        self,
        graph: FrameGraph,
        scene: SceneView,
        light: LightSamples,
        shadows: ShadowTextures | None,
        occlusion: Texture | None,
        noisy: NoisyLight | None,
        mirrored: Texture | None,
    ) -> Texture:
        """The direct light of this frame, both parts as in frame/signals/light.py; `shadows` None: unshadowed.

        `noisy`: output for the light of noisy slots (StochasticLightDenoiser.light). None if there are none.
        `mirrored`: output for specular light of the prefiltered environment, likewise (Reflections.surroundings).
        `occlusion`: visibility of each pixel's surroundings, which dims the prefiltered environment, the only light
        here without shadows of its own.
        """
        with graph.scope(self.name):
            self._prefiltered.add_update(graph, scene)
            direct = graph.texture("direct", BOTH_PARTS)
            not_filtered = graph.nothing(spy.Format.rgba16_float, layers=1)
            sampled = shadows.samples if shadows else None
            graph.add(
                self._direct,
                graph.grid,
                lightSamples=light.samples,
                visibility=shadows.bits if shadows else graph.nothing(spy.Format.rg32_uint),
                shadowed=int(shadows is not None),
                filteredShadows=shadows.filtered if shadows else not_filtered,
                shadowSamples=sampled or not_filtered,
                sampledShadows=int(sampled is not None),
                ltcTables=self._ltc_tables,
                occlusion=occlusion or graph.nothing(spy.Format.r16_float),
                occluded=int(occlusion is not None),
                prefiltered=self._prefiltered,
                direct=write(direct),
                mirroredSurroundings=write(mirrored) if mirrored else graph.nothing(spy.Format.rgba32_float),
                keepsMirrored=int(mirrored is not None),
                noisyLight=write(noisy.samples) if noisy else graph.nothing(spy.Format.rgba32_float, layers=2),
                noisyAlbedo=write(noisy.albedo) if noisy else graph.nothing(BOTH_PARTS),
            )
        return direct

    def offer(self, graph: FrameGraph, *shares: Texture) -> None:
        """Offer direct light, the sum of these."""
        with graph.scope(self.name):
            graph.offer("diffuse_direct", shares, diffuse_of)
            graph.offer("glossy_direct", shares, specular_of)
