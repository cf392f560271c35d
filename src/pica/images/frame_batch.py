"""The frames of a renderer with several views: one array for all of them, or a Frame for each."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.images.aov_table import AovInfo
from pica.images.labels import NodeLabel, Semantic
from pica.images.output import Frame

if TYPE_CHECKING:
    from torch import Tensor

    from pica.scene.node import Node


Whole = Callable[[str], "NDArray[Any] | None"]
WholeTensor = Callable[[str], "Tensor | None"]


class FrameBatch(Sequence[Frame]):
    """Pictures of all views of a `Renderer(views=...)` with their AOVs, and a sequence of their Frames.

    Arrays and tensors are those of the frames (pica.Frame), with the view in front: (views, height, width) or
    (views, height, width, channels). They are made at each access; a single view's are fetched by `batch[i]` alone.
    """

    def __init__(
        self,
        frames: Sequence[Callable[[], Frame]],
        whole: Whole | None = None,
        whole_tensor: WholeTensor | None = None,
    ) -> None:
        """Functions that make the frames of the same renderer and call, at least one. `whole`: returns a
        buffer of all views at once, or None where only frames have it; `whole_tensor`: its tensor on a card,
        likewise."""
        self._makers, self._whole, self._whole_tensor = frames, whole, whole_tensor
        self._made: dict[int, Frame] = {}
        first = self[0]
        self.size = first.size
        """(width, height) in pixels of each view."""
        self.device = first.device
        """The name of the device."""
        self.timings = first.timings
        """GPU milliseconds of every pass, by name, summed over the views."""

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Frame, ...]: ...

    def __getitem__(self, index: int | slice) -> Frame | tuple[Frame, ...]:
        numbers = range(len(self))[index]
        if not isinstance(numbers, int):
            return tuple(self[number] for number in numbers)
        if numbers not in self._made:
            self._made[numbers] = self._makers[numbers]()
        return self._made[numbers]

    def __iter__(self) -> Iterator[Frame]:
        return (self[number] for number in range(len(self)))

    def __len__(self) -> int:
        return len(self._makers)

    def __reduce__(self) -> tuple[Any, ...]:
        return FrameBatch, ([partial(_same, frame) for frame in self],)

    @property
    def color(self) -> NDArray[np.float32]:
        """(views, height, width, 3) linear radiance, as Frame.color."""
        return self._at_once("color", lambda frame: frame.color)

    @property
    def display(self) -> NDArray[np.uint8]:
        """(views, height, width, 3) sRGB, as Frame.display."""
        return self._at_once("display", lambda frame: frame.display)

    @property
    def aov_names(self) -> tuple[str, ...]:
        """The names for `aov`."""
        return self[0].aov_names

    def aov(self, name: str) -> NDArray[Any]:
        """One buffer of all views; raises PicaError as Frame.aov."""
        return self._at_once(name, lambda frame: frame.aov(name))

    def aov_info(self, name: str) -> AovInfo:
        """As Frame.aov_info."""
        return self[0].aov_info(name)

    def mask(self, node: "str | Node | NodeLabel") -> NDArray[np.bool_]:
        """(views, height, width) where a node is visible, as Frame.mask."""
        return self._stacked(lambda frame: frame.mask(node))

    def semantic(
        self, classes: "str | Callable[[NodeLabel], str | None]", names: Sequence[str] | None = None
    ) -> Semantic:
        """The semantic class of each pixel, (views, height, width), as Frame.semantic."""
        found = [frame.semantic(classes, names) for frame in self]
        return Semantic(np.stack([each.labels for each in found]), found[0].names)

    def torch(self, name: str = "color") -> "Tensor":
        """A buffer of all views as a new PyTorch tensor, on the card where those of Frame.torch are."""
        whole = None if self._whole_tensor is None else self._whole_tensor(name)
        if whole is not None:
            return whole
        tensors = [frame.torch(name) for frame in self]
        from torch import stack  # there, as the frames have made tensors

        return stack(tensors)

    def save(self, pattern: str | Path) -> None:
        """Write each view as Frame.save does. `pattern`: a path with a number in its name, "views/%03d.png", from 0 on.
        Raises PicaError for one without."""
        path = Path(pattern)
        try:
            names = [path.name % number for number in range(len(self))]
        except (TypeError, ValueError):
            raise PicaError(f"cannot write {path}: the name needs one %d, such as %03d, and no other %") from None
        for frame, name in zip(self, names, strict=True):
            frame.save(path.with_name(name))

    def __repr__(self) -> str:
        return f"<pica.FrameBatch of {len(self)} views: {self[0]!r}, ...>"

    def _at_once(self, name: str, fetch: Callable[[Frame], NDArray[Any]]) -> NDArray[Any]:
        whole = None if self._whole is None else self._whole(name)
        return self._stacked(fetch) if whole is None else whole

    def _stacked(self, fetch: Callable[[Frame], NDArray[Any]]) -> NDArray[Any]:
        return np.stack([fetch(frame) for frame in self])


def _same(frame: Frame) -> Frame:
    return frame
