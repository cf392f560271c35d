"""What one call of `Renderer.render` gathers over its frames."""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

from numpy.typing import NDArray

from pica.frame.aovs import AovKind, at_size
from pica.frame.context import Size
from pica.gpu_scene.view import SceneView
from pica.graph.offers import Decoder
from pica.graph.plan import Capture, Plan
from pica.images.labels import NUMBERED, Labels
from pica.images.output import Frame, Lazy
from pica.rendering.arguments import checked_aovs
from pica.rendering.black_pictures import seem_black
from pica.rendering.tensors import (
    are_decoded_at_once,
    cuda_tensor_of_all,
    cuda_tensors,
    decoded_array,
    follow,
)
from pica.rhi.device import Device

Watch = Callable[[Mapping[str, Lazy]], tuple[Lazy, Lazy]]


class Gathered:
    """The G-buffer's AOVs of the first frame of a call, and all others of the last."""

    def __init__(self, frames: int, unshown: int, requested: frozenset[str] | None, debug: bool) -> None:
        """`unshown`: frames before the first of `frames`. `requested`: names of AOVs; None: all. `debug`: also debug
        AOVs."""
        self.numbers = range(1 - unshown, frames + 1)
        """Of the frames; those that are shown count from 1."""
        self._requested, self._debug = requested, debug
        self.captures: dict[str, Capture] = {}
        """By name."""
        self._labels: Labels | None = None

    def names(self, plan: Plan, number: int) -> frozenset[str]:
        """What to capture of a frame."""
        names = set(plan.names("gbuffer", self._requested) if self.is_first(number) else ())
        if self.is_last(number):
            names |= {"color", "display", *plan.names_but("gbuffer", self._requested, self._debug)}
        return frozenset(names)

    def is_first(self, number: int) -> bool:
        """Whether it is the first frame of the call."""
        return number == self.numbers[0]

    def is_last(self, number: int) -> bool:
        """Whether it is the last, whose picture is shown."""
        return number == self.numbers[-1]

    def add(self, number: int, captured: Mapping[str, Capture], names: "Names") -> None:
        """The captures of a frame that has been recorded. `names`: of its scene."""
        self.captures |= captured
        if self.is_first(number):
            self._labels = names.of(self.captures)

    def frame(self, device: Device, size: Size, timings: Mapping[str, float], watch: Watch) -> Frame:
        """All of it, as pictures of `size`. `watch`: as BlackPictures.watched, of AOVs by their names. Raises PicaError
        for requested AOVs that there are not: debug AOVs are known only now."""
        captures = dict(self.captures)
        tensors = cuda_tensors(device, size, captures)
        color: Lazy = captures.pop("color")
        display: Lazy = captures.pop("display")
        checked_aovs("render", self._requested, captures)
        pixels = _arrays(device, size, captures)
        color, display = watch({"color": color, "display": display, **pixels})
        return Frame(size, color, display, pixels, timings, self._labels, device.name, tensors)


def whole_array(
    device: Device, size: Size, captured: Sequence[Mapping[str, Capture]], name: str
) -> NDArray[Any] | None:
    """A buffer of several calls, (calls, height, width[, channels]), if they are in the same memory and, of "color" and
    "display", none is a black picture that should be reported; else None."""
    if not isinstance(name, str) or any(name not in captures for captures in captured):
        return None
    captures = [of_call[name] for of_call in captured]
    if name not in ("color", "display"):
        at_once = not device.is_software and are_decoded_at_once(captures)
        return decoded_array(device, size, captures[0], len(captures)) if at_once else None
    parts = [capture.parts[0] for capture in captures]
    if not follow(parts):
        return None
    captures[0]()  # fetches the memory
    first = parts[0]
    texels = first.memory.content().view(first.dtype).reshape(len(parts), *first.shape[1:])[..., :3]
    return None if "depth" in captured[0] and seem_black(name, texels).any() else texels


def whole_tensor(device: Device, size: Size, captured: Sequence[Mapping[str, Capture]], name: str) -> Any:
    """As Frame.torch of several calls, with these in front; None if there is no such tensor."""
    if not isinstance(name, str) or any(name not in captures for captures in captured):
        return None
    return cuda_tensor_of_all(device, size, [captures[name] for captures in captured])


class Names:
    """The names behind the numbers of a scene, as they are when they are first asked for."""

    def __init__(self, view: SceneView) -> None:
        self._view = view

    def of(self, captured: Collection[str]) -> Labels | None:
        """Those in these captures."""
        return None if NUMBERED.isdisjoint(captured) else self._names

    @cached_property
    def _names(self) -> Labels:
        return self._view.name_labels()


def names_of(views: Sequence[SceneView]) -> list[Names]:
    """Of each view's scene."""
    by_scene = {id(view.scene): Names(view) for view in views}
    return [by_scene[id(view.scene)] for view in views]


def labels_frame(
    device: Device, size: Size, timings: Mapping[str, float], captured: Mapping[str, Capture], labels: Labels | None
) -> Frame:
    """The captures of a G-buffer alone. `labels`: the names behind its numbers."""
    tensors = cuda_tensors(device, size, captured)
    return Frame(size, None, None, _arrays(device, size, captured), timings, labels, device.name, tensors)


def _arrays(device: Device, size: Size, captures: Mapping[str, Capture]) -> dict[str, Lazy]:
    """Functions that fetch AOVs as pictures of `size`; decoded by the device if that is a graphics card."""
    arrays: dict[str, Lazy] = at_size(size, captures)
    if not device.is_software:
        for name, capture in captures.items():
            if isinstance(capture.read, Decoder) and capture.read.kind != AovKind.TEXELS:
                arrays[name] = partial(decoded_array, device, size, capture)
    return arrays
