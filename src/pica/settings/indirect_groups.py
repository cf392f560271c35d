"""The settings of light that reaches surfaces over other surfaces; as groups.py."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from pica.settings.setting import Group, Level, choice, number, switch


@dataclass(frozen=True)
class ReflectionsSettings(Group):
    """Specular reflections of surfaces, light sources and surroundings."""

    mode: Literal["off", "screen_space", "ray_traced"] = choice(
        "ray_traced",
        "How it is found.",
        off="Not at all, but for what direct light's own samples find of emissive triangles and the environment.",
        screen_space="A quarter of a ray a pixel over the depth buffer: what the picture shows of others. Without"
        " rays.",
        ray_traced="A quarter of a ray a pixel along the lobe that the surface mirrors, and as many from there to a"
        " light.",
    )
    rays: Literal["quarter", "adaptive"] = choice(
        "adaptive",
        "Rays of ray_traced, a pixel and frame.",
        quarter="One for 2x2 pixels.",
        adaptive="One for each pixel that mirrors sharply, one for 2x2 of the others. Sharp mirrors then show area"
        " lights by these rays, too. mirror_rays are always a quarter.",
    )
    bounces: int = number(
        2,
        range=(1, 4),
        unit="surfaces",
        text="That a reflection shows lit: with 2, lit surfaces are seen in mirrors that are seen in mirrors. Only from"
        " what mirrors well rays go on, and one looks for what shines beyond the last. Up to 8 more where the radiance"
        " cache does not know the light yet, as after a cut.",
        higher="mirrors in mirrors, more rays",
        lower="less time",
    )
    reconstruction: Literal["ratio_estimator", "mirror_rays"] = choice(
        "ratio_estimator",
        "How filtered reflections are reconstructed from the rays of neighbouring pixels.",
        ratio_estimator="Rays sample the specular lobe; each pixel weighs those of its neighbours by its own BRDF over"
        " their density and divides by the sum of the weights (RTG 25, 25.2.2).",
        mirror_rays="Up to a squared roughness of 0.16 most rays go in the perfect mirror direction, and the lobe is"
        " applied as a filter to the radiance that they find (RTG 19, 19.3.2.2); wider lobes as ratio_estimator.",
    )
    area_lights: bool = switch(
        False,
        "Rays meet rectangle, disk, sphere and tube lights as shapes that shine, with all that hides them; false:"
        " direct light brings what surfaces mirror of them, without noise, and dims it as a whole where they are hidden"
        " in part.",
    )
    simplified_materials: bool = switch(
        False,
        "Surfaces that rays meet have no normal maps, and textures of at most 32x32 texels (RTG 19, 19.3.2.1). Mirrors"
        " then show them blurred and flat.",
    )


@dataclass(frozen=True)
class TransparencySettings(Group):
    """What is seen through transmissive materials, such as glass, and through blended ones, such as smoke."""

    levels: ClassVar = {
        "low": Level(
            "Paths bend at two surfaces, and a quarter of the texels: less time where much glass is in view.",
            {"surfaces": 2, "map_size": 256},
        ),
        "medium": Level("Four surfaces, which is a solid behind a solid."),
        "high": Level("Twelve surfaces: glass in glass, and inner reflections.", {"surfaces": 12, "map_size": 1024}),
    }

    mode: Literal["off", "screen_space", "ray_traced"] = choice(
        "ray_traced",
        "How it is found.",
        off="Not at all: such surfaces are opaque to the camera.",
        screen_space="Up to four transmissive or blended surfaces a pixel are rasterized; the former refract the"
        " picture of what lies behind, to where their bounding box says that the path leaves it. Without rays, and"
        " with shadows on them from shadow maps alone. Of blended surfaces behind these, one is met by chance.",
        ray_traced="Rays are refracted and absorbed. What they find on screen shows its finished light.",
    )
    surfaces: int = number(
        4,
        range=(1, 32),
        unit="surfaces",
        text="That bend a path; it goes straight on through further ones. A pane counts once, a solid twice, and again"
        " for each reflection inside of it.",
        higher="glass behind glass refracts right",
        lower="less time",
    )
    layers: int = number(
        16,
        range=(1, 64),
        unit="layers",
        text="Of blended surfaces, such as smoke, that are met one by one in a pixel, without noise; of those behind"
        " them one is met by chance.",
        higher="dense smoke has less noise",
        lower="less time",
    )

    texture_space: Literal["off", "rough", "all"] = choice(
        "rough",
        "Whether objects are unwrapped, so that paths behind their surface begin at its texels and add up over frames.",
        off="Not at all: paths begin at the pixels.",
        rough="Surfaces with a roughness of 0.2 and more, which blur what lies behind: less noise in motion.",
        all="Clear solids too, as PICA PICA has them: as sharp as their texels.",
    )
    map_size: int = number(
        512,
        range=(64, 4096),
        unit="texels along a side, rounded down to a power of two",
        text="Of the texture that all such objects share: at most a path a texel and frame.",
        higher="finer pictures behind objects that are large in the picture",
        lower="less time",
    )


@dataclass(frozen=True)
class TranslucencySettings(Group):
    """Light that passes surfaces diffusely, as those of leaves, wax and skin."""

    levels: ClassVar = {
        "low": Level("A quarter of the texels, in a quarter of the time: coarser.", {"map_size": 128}),
        "medium": Level("A texture of 256x256 texels for all solids."),
        "high": Level(
            "Four times the texels: finer shadows on solids that are large in the picture.", {"map_size": 512}
        ),
    }

    mode: Literal["off", "screen_space", "texture_space"] = choice(
        "texture_space",
        "How it is found.",
        off="Not at all: such surfaces reflect diffusely what others would let through.",
        screen_space="Paths through the solid or the sheet begin at the pixels: one a frame, and a filter.",
        texture_space="Solids are unwrapped; paths through them begin at the texels and add up over frames, however the"
        " camera moves. Sheets as with screen_space, and solids for which there is no room.",
    )
    map_size: int = number(
        256,
        range=(64, 2048),
        unit="texels along a side, rounded down to a power of two",
        text="Of the texture that all solids on screen share: at most a path a texel and frame.",
        higher="finer shadows and textures of light",
        lower="less time",
    )
    interval: int = number(
        0,
        range=(0, 64),
        unit="frames; 0: 1 on a graphics card, 2 on a processor",
        text="In which one path begins at each texel.",
        higher="less time",
        lower="less noise, faster after changes of light",
    )
    scatterings: int = number(
        16,
        range=(1, 1024),
        unit="scatterings",
        text="In a path, at most; it goes straight on to the surface after that.",
        higher="right for solids that are many free paths thick",
        lower="less time",
    )


@dataclass(frozen=True)
class GlobalIlluminationSettings(Group):
    """Light that surfaces reflect diffusely of other surfaces."""

    levels: ClassVar = {
        "low": Level(
            "At most two surfaces where neither the picture nor a cache has light: closed rooms start darker.",
            {"bounces": 2},
        ),
        "medium": Level("Up to 8 surfaces there, which is nearly all light."),
        "high": Level("Up to 16.", {"bounces": 16}),
    }

    mode: Literal["off", "path_traced", "restir", "surfels", "light_map"] = choice(
        "path_traced",
        "How it is found.",
        off="Not at all: what no light reaches directly is black.",
        path_traced="A quarter of a path a pixel, and a filter. Off the picture paths end in the radiance cache, or in"
        " the light map that the renderer was given.",
        restir="The same paths, each chosen from those of earlier frames and of neighbours (ReSTIR GI).",
        surfels="Discs on surfaces remember it, with a few rays from each in every frame.",
        light_map="From the light map that the renderer was given, without rays; not at all where it was given none.",
    )
    bounces: int = number(
        8,
        range=(1, 16),
        unit="surfaces",
        text="Maximum number of bounces of paths that neither the picture nor a cache ends; hits that are on screen, in"
        " the radiance cache or in a light map include all of them. 1 turns both off. Russian roulette ends paths"
        " before, the sooner the darker surfaces are. Surfels have no limit.",
        higher="brighter rooms in the first frames and after cuts, more rays",
        lower="less time",
    )
    surfels: int = number(
        250_000,
        range=(1_000, 4_000_000),
        unit="surfels",
        text="Room for so many.",
        higher="larger worlds without gaps",
        lower="less memory and time",
    )
