"""Outputs of global illumination for other effects of a frame."""

from dataclasses import dataclass
from typing import Any

from pica.graph.resources import Texture, write

ENDLESS = 32
"""Path length of light without a bounce limit, for references: longer paths contribute next to nothing."""


@dataclass(frozen=True)
class IndirectCache:
    """A cache of indirect light for positions outside the picture."""

    module: str
    """Path below the package of the Slang module that implements frame/signals/indirect_cache.slang."""
    values: dict[str, Any]
    """Its parameters, for all passes that are linked with it."""


@dataclass(frozen=True)
class IndirectResult:
    """Diffuse indirect light of a frame."""

    arriving: Texture
    """(width, height, rgba32_float) irradiance of each pixel, as nits over albedo; alpha 0: invalid."""
    reflected: Texture
    """(width, height) diffuse reflection of it by the surfaces, as in frame/signals/light.py."""
    known: bool
    """Whether `arriving` may be read: without filters it holds single rays."""
    bounces: int
    """Maximum number of bounces of paths that neither the picture nor a cache ends."""
    paths: Texture | None
    """(width, height, rgba32_float) of half size, as indirect_rays.slang has it: what single paths bring, before any
    reuse. None: there are none, or they are chosen from several."""
    cache: IndirectCache | None
    """The cache for positions that `arriving` does not have."""


@dataclass(frozen=True)
class IndirectPictures:
    """The textures that each method of global illumination fills."""

    arriving: Texture
    """As IndirectResult's."""
    reflected: Texture
    """As IndirectResult.reflected."""

    def arguments(self) -> dict[str, Any]:
        """For the pass that fills them."""
        return {"arriving": write(self.arriving), "reflected": write(self.reflected)}
