"""What global illumination tells other effects of a frame."""

from dataclasses import dataclass

import slangpy as spy

ENDLESS = 32
"""Surfaces on the way of light that is reflected without a limit, for references: more bring next to nothing."""


@dataclass(frozen=True)
class IndirectLight:
    """Diffuse indirect light of a frame."""

    arriving: spy.Texture
    """(width, height, rgba32_float) light that arrives in each pixel, over albedo in nits; alpha 0: not known."""
    known: bool
    """Whether `arriving` may be asked: without filters it holds single rays."""
    bounces: int
    """Surfaces that light meets on its way at most."""
