"""Every setting, one class a group, and what the levels of a group change.

A new setting is one `number`, `choice` or `switch` here; a new effect's group is a class here and a field of
`Settings`. Checks, the command line, the schema and docs/guide/settings.md follow from that.
"""

from dataclasses import dataclass
from typing import ClassVar, Literal

from pica.errors import SettingsError
from pica.settings.setting import Group, Level, choice, number, switch


@dataclass(frozen=True)
class VisibilitySettings(Group):
    """Primary visibility: the surface that each pixel shows."""

    primary: Literal["auto", "raster", "rays"] = choice(
        "auto",
        "How triangles reach the pixels. All give the same G-buffer.",
        auto="What is faster on the device.",
        raster="Triangles are drawn.",
        rays="One ray a pixel.",
    )
    background: Literal["environment", "transparent"] = choice(
        "environment",
        "What pixels show in which the camera sees no surface.",
        environment="The environment, or Scene.background.",
        transparent="Nothing: pictures have alpha. The environment still lights the scene and is seen in reflections.",
    )


@dataclass(frozen=True)
class RaysSettings(Group):
    """How rays are traced."""

    scheduler: Literal["auto", "pipeline", "buffers"] = choice(
        "auto",
        "How ray effects are scheduled.",
        auto="buffers where the tracer is Embree, else pipeline.",
        pipeline="A ray tracing pipeline: ray generation shaders call TraceRay.",
        buffers="Wavefront: compute kernels write rays to buffers and read hits, as Embree needs.",
    )
    tracer: Literal["auto", "device", "embree"] = choice(
        "auto",
        "What traces ray buffers.",
        auto="Embree where it is installed and the device runs on the processor too or cannot trace, else the device.",
        device="The device's own ray tracing pipeline.",
        embree="Embree on the processor, if embreex and llvmlite are installed.",
    )


@dataclass(frozen=True)
class ShadowsSettings(Group):
    """Shadows of every light."""

    levels: ClassVar = {
        "low": Level("One ray a pixel, whatever gives light.", {"max_lights": 0}),
        "medium": Level("Two rays a pixel: one for the sun, or else the strongest light, and one for all others."),
        "high": Level(
            "4 lights with a ray and a filter of their own: less noise where many overlap.", {"max_lights": 4}
        ),
    }

    method: Literal["rays", "maps"] = choice(
        "rays",
        "How shadows are found.",
        rays="Traced from every pixel.",
        maps="Shadow maps, which need no rays and only approximate soft shadows.",
    )
    mode: Literal["soft", "hard", "off"] = choice(
        "soft",
        "Which shadows there are.",
        soft="One ray a frame to a random point of the light.",
        hard="One ray to the light's centre.",
        off="No shadows.",
    )
    transparent: bool = switch(
        True,
        "Shadow rays go on through materials that let light through and take their colour; false: those are opaque."
        " Costs nothing in scenes without any, else a ray for each surface on the way. The path tracer follows it too.",
    )
    max_lights: int = number(
        1,
        range=(0, 29),
        unit="lights",
        text="Lights with a shadow ray of their own, the strongest directional one first; the lights beyond, all"
        " emissive triangles and the sampled environment share one ray. Visibility has 32 bits a pixel.",
        higher="less noise with many lights",
        lower="fewer rays, less memory",
    )
    denoiser: Literal["anisotropic", "svgf", "off"] = choice(
        "anisotropic",
        "Filter of soft shadows, for lights that choose none themselves (docs/measurements/shadows.md compares them).",
        anisotropic="Along the penumbra that light and occluder make, for rays that also find the occluder's distance;"
        " follows the shadows of lights that move.",
        svgf="Spatiotemporal variance-guided filtering (Schied et al. 2017): an À-Trous wavelet filter, steered by the"
        " variance of temporally accumulated visibility.",
        off="None, for light that converges over many frames without any bias.",
    )
    denoised_lights: int = number(
        4,
        range=(0, 16),
        unit="lights",
        text="Soft lights, strongest first, whose shadows are filtered; each takes about 50 bytes a pixel.",
        higher="less noise with many lights",
        lower="less time and memory for filters",
    )
    history: int = number(
        8,
        range=(1, 64),
        unit="frames",
        text="What filtered shadows remember while something moves; 1: each frame stands alone. While nothing moves all"
        " frames count.",
        higher="less noise",
        lower="shadows that lag behind less",
    )


@dataclass(frozen=True)
class AmbientOcclusionSettings(Group):
    """Visibility of the surroundings of each surface: dims ambient light that has no shadows of its own."""

    levels: ClassVar = {
        "medium": Level("One ray a pixel, left to the filter. There is no cheaper one but ground_truth."),
        "high": Level("Four rays: half the noise of each frame, which shows while something moves.", {"rays": 4}),
    }

    mode: Literal["off", "ray_traced", "ground_truth"] = choice(
        "off",
        "How it is found. A sampled environment has shadows of its own and is not dimmed.",
        off="Not at all.",
        ray_traced="Rays about the normal.",
        ground_truth="GTAO, from the depth buffer alone.",
    )
    rays: int = number(
        1,
        range=(1, 16),
        unit="rays a pixel and frame",
        text="Rays of ray_traced.",
        higher="less noise",
        lower="less time",
    )
    min_distance: float = number(
        0.0,
        range=(0.0, 1000.0),
        unit="metres",
        text="What is nearer hides nothing.",
        higher="fine detail, dimmed by its textures already, stays bright",
        lower="contacts are dark",
    )
    max_distance: float = number(
        2.0,
        range=(0.001, 10000.0),
        unit="metres",
        text="What is further hides nothing. Near field: about 0.5; far field: about 20.",
        higher="rooms are dim as a whole, slower rays",
        lower="only corners are dim, faster rays",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_distance >= self.max_distance:
            raise SettingsError(
                f"setting ambient_occlusion.min_distance: {self.min_distance} is not below max_distance"
                f" {self.max_distance}"
            )


@dataclass(frozen=True)
class ShadowMapsSettings(Group):
    """Shadow maps, where shadows.method is "maps"."""

    levels: ClassVar = {
        "low": Level(
            "A quarter of the texels, half of the taps and lights: coarse edges and penumbrae, fewer lights that throw"
            " shadows. 16 MB a directional light.",
            {"cascade_size": 1024, "face_size": 256, "taps": 8, "max_lights": 2},
        ),
        "medium": Level("64 MB a directional light, 6 MB a lamp."),
        "high": Level(
            "Four times the texels, twice the taps and lights: for large pictures. 256 MB a directional light.",
            {"cascade_size": 4096, "face_size": 1024, "taps": 32, "max_lights": 8},
        ),
    }

    max_lights: int = number(
        4,
        range=(0, 16),
        unit="lights",
        text="Lights with maps, the strongest first; the others throw no shadow.",
        higher="more lights with shadows",
        lower="less memory and time",
    )
    cascades: int = number(
        4,
        range=(1, 6),
        unit="maps",
        text="Maps of a directional light, one behind the other along the view.",
        higher="finer far away",
        lower="less to draw, less memory",
    )
    cascade_size: int = number(
        2048,
        range=(64, 8192),
        unit="texels",
        text="Edge of each cascade; 4 bytes a texel.",
        higher="sharper",
        lower="less memory and time",
    )
    cascade_split: float = number(
        0.75,
        range=(0.0, 1.0),
        unit="share",
        text="Between cascades of equal depth (0) and of equal depth ratio (1).",
        higher="finer near the camera",
        lower="finer far away",
    )
    face_size: int = number(
        512,
        range=(64, 4096),
        unit="texels",
        text="Edge of a spot light's map and of each of the six or five of other lights.",
        higher="sharper shadows of lamps",
        lower="less memory and time",
    )
    taps: int = number(
        16,
        range=(4, 64),
        unit="places",
        text="Where a soft shadow looks for what is in the way, and then how much.",
        higher="less noise",
        lower="less time",
    )


@dataclass(frozen=True)
class LightingSettings(Group):
    """Direct light."""

    levels: ClassVar = {
        "low": Level(
            "A third of the candidates: many lights, emissive triangles and the environment are noisier.",
            {"candidates": 4},
        ),
        "medium": Level("12 candidates, after which noise falls slowly."),
        "high": Level("Twice the candidates.", {"candidates": 24}),
    }

    environment: Literal["sampled", "prefiltered", "off"] = choice(
        "sampled",
        "Light of the environment.",
        sampled="By importance, with shadows; it shares the ray of the lights that have none of their own.",
        prefiltered="No rays, no shadows, no noise.",
        off="None.",
    )
    candidates: int = number(
        12,
        range=(1, 64),
        unit="samples",
        text="Among these the shared ray chooses, by the light that they would bring without shadows; no bias with any."
        " Without an environment no more than there are such lights, and four for each with an extent and each emissive"
        " triangle.",
        higher="less noise",
        lower="less time",
    )
    area_shadows: Literal["split_sum", "ratio_estimator"] = choice(
        "split_sum",
        "How filtered shadows of area lights are applied to their unshadowed light, which linearly transformed cosines"
        " give without noise.",
        split_sum="Visibility averaged over the irradiance: exact on diffuse surfaces; highlights of partly hidden"
        " lights only dim.",
        ratio_estimator="Shadowed over unshadowed light, both sampled with the BRDF and filtered (Heitz, Hill and"
        " McGuire 2018): partly hidden lights lose that part of the highlight. Noisier shadows on glossy surfaces; BRDF"
        " evaluation in the shadow rays costs time.",
    )


@dataclass(frozen=True)
class DebugSettings(Group):
    """For tests and measurements; presets and levels leave it alone."""

    filters: bool = switch(
        True,
        "Spatial and temporal filters of ambient occlusion, stochastic light (many lights, emissive triangles, the"
        " sampled environment), reflections and path traced global illumination; false: the unfiltered samples of each"
        " frame. Shadows have shadows.denoiser.",
    )
