"""The whole frame, top to bottom: the inputs of each stage, and its outputs for later stages."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from pica.denoising.denoiser import Denoiser
from pica.filtering.reprojection import Reprojection
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import IndirectResult
from pica.frame.signals.mirrors import MirrorImages
from pica.frame.signals.shadows import ShadowTextures
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, History, Texture
from pica.light_sampling.light_sampler import LightSamples
from pica.light_sampling.light_slots import LightSlots
from pica.renderer.stages import Stages

STAGES = (
    "gbuffer",
    "shadows",
    "ambient_occlusion",
    "lighting",
    "global_illumination",
    "translucency",
    "reflections",
    "composite",
    "transparency",
    "antialiasing",
    "post",
)
"""The names that `declare` yields, in this order. A stage is listed even if its effect is off."""


@dataclass(repr=False)  # fields are grouped
class Signals:
    """The signals between stages. A pass from outside finds existing textures here, and may replace
    `radiance`, `picture` and `display`, or append light to `parts`."""

    scene: SceneView
    """As a parameter `scene` of passes (gpu_scene/scene.slang)."""
    slots: LightSlots
    exposure: Buffer = field(init=False)
    """Its first float is the factor from nits to the display; that of the frame before until "post"."""
    past: History = field(init=False)
    """`picture` of the frame before, and how many samples are in it (TemporalResolve.history)."""
    gbuffer: GBuffer = field(init=False)
    """As a parameter `gbuffer` of passes (frame/gbuffer.slang)."""
    reprojection: Reprojection = field(init=False)
    """As a parameter `reprojection` of passes (filtering/temporal.slang)."""
    light: LightSamples = field(init=False)
    shadows: ShadowTextures | None = None
    occlusion: Texture | None = None
    """Red: visibility of the surroundings. None if the effect is off."""
    indirect: IndirectResult | None = None
    mirrored: MirrorImages | None = None
    """Motion of what flat mirrors show (Reflections)."""
    parts: list[Texture] = field(default_factory=list)
    """Light towards the camera so far, a picture for each kind (frame/signals/light.py), without emission and
    surroundings."""
    radiance: Texture = field(init=False)
    """From "composite" on all light towards the camera, nits."""
    glass: History | None = None
    """Motion of transmissive surfaces (Transparency)."""
    picture: Texture = field(init=False)
    """`radiance` antialiased, of the output's size."""
    alpha: Texture | None = None
    display: Texture = field(init=False)


def declare(
    stages: Stages,
    graph: FrameGraph,
    s: Signals,
    denoiser: Denoiser | None = None,
    last: bool = False,
    aperture: bool = False,
) -> Iterator[str]:
    """Declare a frame; yields the name of each stage once it is declared. `last`: `denoiser` finishes the picture.
    `aperture`: the camera has one, so not all is in focus."""
    s.exposure = stages.post.exposure(graph)
    s.past = stages.antialiasing.history(graph)
    s.gbuffer = stages.gbuffer(graph, s.scene)
    graph.provide(scene=s.scene, lightSlots=s.slots, gbuffer=s.gbuffer)
    if denoiser is not None:
        denoiser.gather(graph)
    s.reprojection = stages.reprojection(graph)
    graph.provide(reprojection=s.reprojection)
    yield "gbuffer"
    s.light = stages.light_sampler(graph, s.slots, stages.lights_hits)
    if stages.shadows is not None:
        s.shadows = stages.shadows(graph, s.scene, s.light)
        if s.shadows.maps is None:
            stages.light_sampler.count_visibility(graph, s.light, s.shadows.bits)
    rates = s.shadows.rates if s.shadows else None
    graph.provide(historyLimits=stages.history_limits(graph, s.scene, s.light.motions, s.past, rates))
    yield "shadows"
    if stages.ambient_occlusion is not None:
        s.occlusion = stages.ambient_occlusion(graph, s.gbuffer)
    yield "ambient_occlusion"
    noisy = stages.stochastic_light.light(graph) if s.slots.noisy else None
    surroundings = stages.reflections.surroundings(graph) if stages.reflections else None
    direct = [stages.lighting(graph, s.scene, s.light, s.shadows, s.occlusion, noisy, surroundings)]
    if noisy is not None:
        direct.append(stages.stochastic_light(graph, noisy, s.reprojection, s.past))
    stages.lighting.offer(graph, *direct)
    s.parts += direct
    yield "lighting"
    if stages.global_illumination is not None:
        s.indirect = stages.global_illumination(graph, s.gbuffer, s.scene, s.light, s.occlusion, s.exposure)
        s.parts.append(s.indirect.reflected)
    yield "global_illumination"
    if stages.translucency is not None:
        passed = stages.translucency(graph, s.gbuffer, s.scene, s.light, s.indirect, s.exposure)
        s.parts += [] if passed is None else [passed]
    yield "translucency"
    if stages.reflections is not None:
        # Screen-space reflections read the picture before reflections are added.
        picture = stages.composite.so_far(graph, s.parts) if surroundings else None
        inputs = s.light, s.reprojection, s.indirect, surroundings, picture
        reflected, s.mirrored = stages.reflections(graph, s.gbuffer, *inputs, mirrors=s.scene.mirrors)
        s.parts.append(reflected)
    yield "reflections"
    s.radiance = stages.composite(graph, s.gbuffer, s.parts)
    yield "composite"
    if stages.transparency is not None:
        lit = s.light, s.indirect, s.shadows, s.radiance, s.exposure
        s.radiance, s.glass = stages.transparency(graph, s.scene, s.gbuffer, *lit)
    stages.composite.offer(graph, s.radiance)
    yield "transparency"
    shadows = s.shadows.followed if s.shadows else None
    s.picture, s.alpha = stages.antialiasing(graph, s.past, s.radiance, s.exposure, s.glass, shadows, s.mirrored)
    if denoiser is not None and last:
        s.picture = denoiser.finish(graph, s.picture)
    yield "antialiasing"
    if aperture:
        s.picture, s.alpha = stages.depth_of_field(graph, s.picture, s.alpha)
    if stages.motion_blur is not None:
        s.picture, s.alpha = stages.motion_blur(graph, s.picture, s.alpha)
    stages.antialiasing.offer(graph, s.alpha)
    s.display = stages.post(graph, s.picture, s.exposure, s.alpha, cut=s.reprojection.cut)
    yield "post"
