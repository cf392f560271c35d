"""What one call of `Renderer.render` gathers over its frames."""

from collections.abc import Callable, Mapping

from pica.frame.aovs import at_size
from pica.frame.context import Size
from pica.gpu_scene.view import SceneView
from pica.graph.plan import Capture, Plan
from pica.images.labels import NUMBERED, Labels
from pica.images.output import Frame, Lazy
from pica.rendering.arguments import checked_aovs
from pica.rendering.tensors import cuda_tensors
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
        self._captures: dict[str, Capture] = {}
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

    def add(self, number: int, captured: Mapping[str, Capture], view: SceneView) -> None:
        """The captures of a frame that has been recorded."""
        self._captures |= captured
        if self.is_first(number) and self._captures.keys() & NUMBERED:
            self._labels = view.name_labels()

    def frame(self, device: Device, size: Size, timings: Mapping[str, float], watch: Watch) -> Frame:
        """All of it, as pictures of `size`. `watch`: as BlackPictures.watched, of AOVs by their names. Raises PicaError
        for requested AOVs that there are not: debug AOVs are known only now."""
        captures = self._captures
        tensors = cuda_tensors(device, size, captures)
        color: Lazy = captures.pop("color")
        display: Lazy = captures.pop("display")
        checked_aovs("render", self._requested, captures)
        pixels = at_size(size, captures)
        color, display = watch({"color": color, "display": display, **pixels})
        return Frame(size, color, display, pixels, timings, self._labels, device.name, tensors)


def labels_frame(
    device: Device, size: Size, timings: Mapping[str, float], captured: Mapping[str, Capture], view: SceneView
) -> Frame:
    """The captures of a G-buffer alone, which has just been recorded."""
    labels = view.name_labels() if captured.keys() & NUMBERED else None
    tensors = cuda_tensors(device, size, captured)
    return Frame(size, None, None, at_size(size, captured), timings, labels, device.name, tensors)
