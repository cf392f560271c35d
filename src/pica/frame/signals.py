"""Light towards the camera, a picture for each kind."""

from dataclasses import dataclass

import slangpy as spy

from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture

SIGNAL = spy.Format.rg32_uint
"""Of such a picture (width, height): nits, three floats of 21 bits (packFloat21x3); 0 where nothing but the
surroundings is seen."""


@dataclass(frozen=True)
class DirectLight:
    """Light of emitters that surfaces reflect, by the two parts of their BRDF."""

    diffuse: Texture
    specular: Texture

    @classmethod
    def declared(cls, graph: FrameGraph) -> "DirectLight":
        """For a pass to fill."""
        return cls(graph.texture("diffuse", SIGNAL), graph.texture("specular", SIGNAL))

    @property
    def parts(self) -> list[Texture]:
        """Both."""
        return [self.diffuse, self.specular]
