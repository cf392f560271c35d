"""Base class of effects, and their references."""

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pica.graph.resources import Size
from pica.tracing.many_samples import ManySamples

Array = NDArray[Any]


@dataclass(frozen=True)
class ReferenceLayer:
    """One buffer of an effect, (height, width) from 0 to 1 or light (height, width, 3), and the parameters of its
    reference."""

    offer: str
    """The name by which the graph offers it."""
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Reference:
    """The ground truth of an effect: visibility or radiance, averaged over many rays per pixel of the G-buffer."""

    estimate: ManySamples
    """Runs the reference shader of the effect, which is in the effect's folder."""
    inputs: tuple[str, ...]
    """Its inputs, from Renderer.effect_inputs."""
    layers: Mapping[str, ReferenceLayer]
    """By name."""

    @property
    def is_light(self) -> bool:
        """Whether the layers are light, in nits."""
        return self.estimate.is_light

    def __call__(self, size: Size, samples: int, inputs: Mapping[str, Any]) -> dict[str, NDArray[np.float32]]:
        """The layers from `samples` rays per pixel; NaN where undefined. `inputs`: all of Renderer.effect_inputs."""
        given = {name: inputs[name] for name in self.inputs}
        layers = self.layers.items()
        return {name: self.estimate(size, samples, **given, **layer.parameters) for name, layer in layers}


class Effect(ABC):
    """A stage of the frame: built once for its settings, then called whenever the frame is declared.

    Each has its own `__call__`, which takes the graph and results of other stages, adds passes and returns
    textures. It offers its outputs there (`FrameGraph.offer`): AOVs by their names, debug AOVs
    as "debug.EFFECT.NAME", numbers of rays as "rays.PASS".
    """

    name: ClassVar[str]
    """Its name in settings, AOVs and the command line."""
    aov_names: tuple[str, ...] = ()
    """AOVs that it offers."""

    def reset(self) -> None:  # noqa: B027 (most effects keep nothing on the host)
        """Discard state of earlier frames on the host. The graph discards histories."""

    def reference(self) -> Reference | None:
        """The ground truth of the newest frame's result; None: only whole pictures have one."""
        return None


def rgb(values: Array) -> Array:
    """(height, width, 3) of a picture with alpha."""
    return values[..., :3].astype(np.float32)
