"""What global illumination gives to other effects of a frame."""

from dataclasses import dataclass
from typing import Any

from pica.graph.resources import Texture, write

ENDLESS = 32
"""Surfaces on the way of light that is reflected without a limit, for references: more bring next to nothing."""


@dataclass(frozen=True)
class IndirectCache:
    """What knows the indirect light of places that the picture does not show."""

    module: str
    """Path below the package of the Slang module that stands for frame/signals/indirect_cache.slang's."""
    values: dict[str, Any]
    """Its parameters, for all passes that are linked with it."""


@dataclass(frozen=True)
class IndirectResult:
    """Diffuse indirect light of a frame."""

    arriving: Texture
    """(width, height, rgba32_float) light that arrives in each pixel, over albedo in nits; alpha 0: not known."""
    reflected: Texture
    """(width, height) of that what surfaces reflect diffusely, as frame/signals/light.py has it."""
    known: bool
    """Whether `arriving` may be asked: without filters it holds single rays."""
    bounces: int
    """Surfaces that light may meet on its way where neither picture nor cache have it."""
    cache: IndirectCache | None
    """What may be asked beside `arriving`."""


@dataclass(frozen=True)
class IndirectPictures:
    """What each way to indirect light fills."""

    arriving: Texture
    """As IndirectResult's."""
    reflected: Texture
    """Likewise."""

    def arguments(self) -> dict[str, Any]:
        """For the pass that fills them."""
        return {"arriving": write(self.arriving), "reflected": write(self.reflected)}
