"""The settings of what makes a picture of light: antialiasing and post processing; as groups.py."""

from dataclasses import dataclass
from typing import Literal

from pica.settings.setting import Group, choice, number, switch


@dataclass(frozen=True)
class AntialiasingSettings(Group):
    """How jittered frames make one picture."""

    mode: Literal["temporal", "accumulate"] = choice(
        "temporal",
        "What a picture has of the frames before. What is still is the plain mean of its frames with both.",
        temporal="What moves takes its history along.",
        accumulate="All frames since anything changed, so that a picture in motion is the samples of one frame.",
    )
    upscale: float = number(
        1.0,
        range=(1.0, 3.0),
        unit="pixels of the output to a rendered one, along each side",
        text="Renders fewer pixels than the output has, at 2 a quarter.",
        higher="less to render",
        lower="more detail while something moves, a still picture is smooth sooner",
    )
    first_samples: int = number(
        0,
        range=(0, 64),
        unit="frames; 0: 8 on a graphics card, 1 on a processor",
        text="How many frames make the first picture, and the first after `cut` or `reset`. Later ones are one each.",
        higher="no noise where a film or a new view begins, for the time of so many frames",
        lower="the first picture is as fast as the others",
    )
    sharpness: float = number(
        0.0,
        range=(0.0, 1.0),
        unit="share",
        text="How much contrast of fine detail is raised after antialiasing.",
        higher="crisper, and so is noise",
        lower="as the pixel filter has it",
    )


@dataclass(frozen=True)
class PostSettings(Group):
    """From scene radiance to the display."""

    exposure: float = number(
        0.0,
        range=(-30.0, 30.0),
        unit="stops",
        text="Added to the automatic exposure, or the exposure itself (2**-exposure nits is white) without it.",
        higher="brighter",
        lower="darker",
    )
    auto_exposure: bool = switch(
        True, "Choose the exposure from the picture's average luminance; false: post.exposure alone."
    )
    adaptation_up: float = number(
        0.0,
        range=(0.0, 100.0),
        unit="stops per second",
        text="How fast the automatic exposure rises when it gets darker, if pictures have times; 0: at once.",
        higher="faster",
        lower="slower, but for 0",
    )
    adaptation_down: float = number(
        0.0,
        range=(0.0, 100.0),
        unit="stops per second",
        text="How fast the automatic exposure falls when it gets brighter, likewise. Eyes are faster at that.",
        higher="faster",
        lower="slower, but for 0",
    )
    shutter: float = number(
        0.0,
        range=(0.0, 1.0),
        unit="of the frame interval",
        text="How long the shutter is open: motion blur. Film cameras have 0.5.",
        higher="longer blur",
        lower="sharper motion; 0 costs nothing",
    )
    bloom: float = number(
        0.0,
        range=(0.0, 1.0),
        unit="of the light",
        text="Fraction of the light that is scattered about bright parts; the sum stays. A lens scatters 0.02 to 0.1.",
        higher="more glow, less contrast",
        lower="less; 0 costs nothing",
    )
    glare: float = number(
        0.0,
        range=(0.0, 1.0),
        unit="of the light",
        text="Fraction of the light that an aperture's edges spread along six rays; the sum stays.",
        higher="longer stars about bright spots",
        lower="less; 0 costs nothing",
    )
    chromatic_aberration: float = number(
        0.0,
        range=(0.0, 0.1),
        unit="of the distance to the centre",
        text="By how much a lens magnifies red more than blue. 0.002 to 0.01 is seen in cheap lenses.",
        higher="wider coloured fringes",
        lower="sharper",
    )
    grain: float = number(
        0.0,
        range=(0.0, 1.0),
        unit="of the light",
        text="Standard deviation of middle grey by the grain of a film; brighter parts have less in proportion.",
        higher="more noise",
        lower="less",
    )
    white_balance: float = number(
        6500.0,
        range=(1667.0, 25000.0),
        unit="K",
        text="Temperature of the light that is shown as white; 6500 leaves colours as they are.",
        higher="warmer",
        lower="colder",
    )
    tone_map: Literal["neutral", "agx", "aces", "linear"] = choice(
        "neutral",
        "How light beyond what a display has is shown.",
        neutral="Khronos' PBR neutral: base colours as they are, highlights compressed.",
        agx="AgX: soft contrast, bright colours fade to white.",
        aces="Hill's fit of ACES: strong contrast, darker.",
        linear="Clipped.",
    )
    dither: bool = switch(False, "Add noise below one step of the 8-bit display, which hides bands in gradients.")
    vignette: float = number(
        0.0,
        range=(0.0, 0.95),
        unit="of the light",
        text="Fraction of the light that the picture's corners lose, by the fourth power of the cosine of a lens.",
        higher="darker corners",
        lower="even",
    )
