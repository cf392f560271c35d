"""What antialiasing knows of images in flat mirrors."""

from dataclasses import dataclass

from pica.graph.resources import Texture


@dataclass(frozen=True)
class MirrorImages:
    """The motion of what flat mirrors show, which differs from theirs."""

    followed: Texture
    """(width, height, r8_uint) above 0 where they show something that moves, or did a few frames ago."""
    shift: Texture
    """(width, height, rg32_float) pixels from where the surface was in the previous frame to where its image was; 0
    elsewhere."""
