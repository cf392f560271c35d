"""What every effect offers beside its call, so that all but the call itself goes over a list of effects."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.context import Size
from pica.frame.snapshot import Snapshot
from pica.rhi.device import Device
from pica.tracing.hit_groups import HitDetail

Array = NDArray[Any]


@dataclass(frozen=True)
class Aov:
    """A buffer to look at: (height, width) for scalars and ids, (height, width, channels) for vectors and colours."""

    textures: tuple[spy.Texture, ...] | Callable[[], tuple[spy.Texture, ...]]
    """What it is read from. A function makes them, by further passes of the frame, for who asks for the buffer by its
    name alone."""
    read: Callable[..., Array]
    """Takes an array for each texture, (height, width[, channels]), with the layers of texture arrays in front."""

    @property
    def on_request(self) -> bool:
        """Whether it is made only where somebody asks for it by its name."""
        return callable(self.textures)

    def sources(self) -> tuple[spy.Texture, ...]:
        """The textures, made now if need be."""
        return self.textures() if callable(self.textures) else self.textures

    def fetch(self) -> Array:
        """The buffer as it is now; waits for the device."""
        return self.read(*map(as_array, self.sources()))


@dataclass(frozen=True)
class ReferenceLayer:
    """One buffer of an effect, (height, width) from 0 to 1 or light (height, width, 3), and what tells its reference
    from the others'."""

    result: Aov
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Reference:
    """What an effect should give: the share of many rays that arrive, or the light that they bring, from a ray effect
    of the path tracer's."""

    module: str
    """Path below the package."""
    effect: str
    """The struct in it, which adds up what its rays find (path_tracer/references.py)."""
    detail: HitDetail
    inputs: tuple[str, ...]
    """What it is given of Renderer.effect_inputs."""
    layers: Mapping[str, ReferenceLayer]
    """By name."""
    is_light: bool = False
    """Whether the layers are light, in nits."""


class Effect(ABC):
    """A stage of the frame: built once, then called once a frame.

    Each has a `__call__` of its own, which takes the frame and results of other stages, records the work and returns
    textures. Nothing is allocated after the first frame of a size.
    """

    name: ClassVar[str]
    """What settings, AOVs and the command line call it."""
    aov_names: tuple[str, ...] = ()
    """What `aovs` gives once there was a frame."""
    at_output: ClassVar[bool] = False
    """Whether it works at the size of the output, as antialiasing makes it, not at the render size."""

    @abstractmethod
    def resize(self, size: Size) -> None:
        """Work at another size, (width, height) pixels, from the next frame on; drops the history."""

    def reset(self) -> None:  # noqa: B027 (most effects have no history)
        """Drop the history, where there is one."""

    def aovs(self) -> dict[str, Aov]:
        """Results of the newest frame that everybody may want to see, by name."""
        return {}

    def debug_aovs(self) -> dict[str, Aov]:
        """What lies in between in the newest frame, by names without "debug." and the effect's name in front."""
        return {}

    def ray_counts(self) -> dict[str, int]:
        """Rays traced in the newest frame, by pass. May wait for the device."""
        return {}

    def reference(self) -> Reference | None:
        """What the newest frame's result is to be compared with; None: only whole pictures tell."""
        return None


def as_array(texture: spy.Texture) -> Array:
    """(height, width[, channels]) of a texture; layers in front, always with channels, for an array of textures."""
    if texture.type != spy.TextureType.texture_2d_array:
        return np.asarray(texture.to_numpy())
    layers = np.stack([texture.to_numpy(layer=layer) for layer in range(texture.array_length)])
    return layers if layers.ndim == 4 else layers[..., None]


def picture_aov(texture: spy.Texture) -> Aov:
    """A picture without its alpha, (height, width, 3)."""
    return Aov((texture,), lambda values: values[..., :3])


def kept(device: Device, encoder: spy.CommandEncoder, aovs: Mapping[str, Aov]) -> dict[str, Callable[[], Array]]:
    """Functions that fetch each buffer as the recording leaves it here, whatever later frames do, once the device has
    finished the recording."""
    sources = {name: aov.sources() for name, aov in aovs.items()}
    textures = {id(texture): texture for each in sources.values() for texture in each}
    snapshots = {number: Snapshot(device, encoder, texture) for number, texture in textures.items()}

    def frozen(name: str) -> Callable[[], Array]:
        parts = [snapshots[id(texture)] for texture in sources[name]]
        read = aovs[name].read

        def fetch() -> Array:
            with device.turn:
                return read(*(part.array() for part in parts))

        return fetch

    return {name: frozen(name) for name in aovs}


def chosen(aovs: Mapping[str, Aov], names: Collection[str] | None) -> dict[str, Aov]:
    """Those with these names; None: all that are not on request."""
    return {name: aov for name, aov in aovs.items() if (not aov.on_request if names is None else name in names)}
