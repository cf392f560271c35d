"""The whole frame, top to bottom: what each stage is given, and what it gives to those after it."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from pica.denoising.denoiser import Denoiser
from pica.frame.gbuffer import GBuffer
from pica.frame.indirect import IndirectLight
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Texture
from pica.light_sampling.light_sampler import LightSamples
from pica.light_sampling.light_slots import LightSlots
from pica.light_sampling.shadow_textures import ShadowTextures
from pica.renderer.stages import Stages

STAGES = (
    "gbuffer",
    "shadows",
    "ambient_occlusion",
    "lighting",
    "global_illumination",
    "reflections",
    "antialiasing",
    "post",
)
"""What `declare` gives, in this order. A stage whose effect is off is passed all the same."""


@dataclass(repr=False)  # fields come one after the other
class Signals:
    """What stages hand on. A pass from outside finds here what is there already, and may put its own in the place of
    `radiance`, `picture` and `display`."""

    scene: SceneView
    """As a parameter `scene` of passes (gpu_scene/scene.slang)."""
    slots: LightSlots
    exposure: Buffer = field(init=False)
    """A float, the factor from nits to the display; that of the frame before until "post"."""
    gbuffer: GBuffer = field(init=False)
    """As a parameter `gbuffer` of passes (frame/gbuffer.slang)."""
    reprojection: Reprojection = field(init=False)
    """As a parameter `reprojection` of passes (frame/temporal.slang)."""
    light: LightSamples = field(init=False)
    shadows: ShadowTextures | None = None
    occlusion: Texture | None = None
    """Red: the open share of the surroundings. None where the effect is off."""
    radiance: Texture = field(init=False)
    """Light towards the camera so far, nits."""
    indirect: IndirectLight | None = None
    picture: Texture = field(init=False)
    """`radiance` antialiased, of the output's size."""
    alpha: Texture | None = None
    display: Texture = field(init=False)


def declare(
    stages: Stages, graph: FrameGraph, s: Signals, denoiser: Denoiser | None = None, last: bool = False
) -> Iterator[str]:
    """Declare a frame; gives the name of each as it is done. `last`: `denoiser` finishes the picture."""
    s.exposure = stages.post.exposure(graph)
    s.gbuffer = stages.gbuffer(graph, s.scene)
    if denoiser is not None:
        denoiser.gather(graph, s.gbuffer, s.scene)
    s.reprojection = stages.reprojection(graph, s.gbuffer)
    yield "gbuffer"
    s.light = stages.light_sampler(graph, s.gbuffer, s.scene, s.slots)
    if stages.shadows is not None:
        s.shadows = stages.shadows(graph, s.gbuffer, s.scene, s.light, s.reprojection)
    yield "shadows"
    if stages.ambient_occlusion is not None:
        s.occlusion = stages.ambient_occlusion(graph, s.gbuffer, s.scene, s.reprojection)
    yield "ambient_occlusion"
    noisy = stages.stochastic_light.samples(graph) if s.slots.noisy else None
    surroundings = stages.reflections.surroundings(graph) if stages.reflections else None
    s.radiance = stages.lighting(graph, s.gbuffer, s.scene, s.light, s.shadows, s.occlusion, noisy, surroundings)
    if noisy is not None:
        stages.stochastic_light(graph, s.gbuffer, s.scene, noisy, s.radiance, s.reprojection)
    yield "lighting"
    if stages.global_illumination is not None:
        s.indirect = stages.global_illumination(
            graph, s.gbuffer, s.scene, s.light, s.reprojection, s.occlusion, s.exposure, s.radiance
        )
    yield "global_illumination"
    if stages.reflections is not None:
        stages.reflections(graph, s.gbuffer, s.scene, s.light, s.reprojection, s.indirect, surroundings, s.radiance)
    yield "reflections"
    s.picture, s.alpha = stages.antialiasing(graph, s.gbuffer, s.radiance, s.exposure)
    if denoiser is not None and last:
        s.picture = denoiser.finish(graph, s.picture)
    yield "antialiasing"
    s.display = stages.post(graph, s.picture, s.exposure, s.alpha)
    yield "post"
