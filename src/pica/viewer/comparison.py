"""A second picture of the same view, beside the first: by the path tracer, or with another preset."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError, shown
from pica.path_tracer.path_tracer import PathTracer
from pica.rhi.device import Device
from pica.scene.model import Scene
from pica.settings import Settings
from pica.tracing.fallbacks import check_traces
from pica.viewer.outline import outlined
from pica.viewer.setting_controls import presets
from pica.viewer.view import View
from pica.viewer.view_renderer import ViewRenderer

PATH_TRACED = "path_traced"
_LINE = 255
"""Grey of the line between the pictures."""


class Comparison(Protocol):
    """What the right part of a picture shows."""

    name: str

    def picture(self, view: View, settings: Settings, interrupted: Callable[[], bool]) -> NDArray[np.uint8] | None:
        """(height, width, 3) sRGB of a view, after a frame of it with `settings`; None: there is none of this size."""

    def is_complete(self, view: View) -> bool:
        """Whether the picture of a view, which has all of its frames, is the final one."""

    def close(self) -> None:
        """Release its device memory."""


@dataclass(eq=False)
class SplitPicture:
    """Two pictures of one size, of which one is on the left of a line."""

    left: NDArray[np.uint8] = field(repr=False)
    right: NDArray[np.uint8] = field(repr=False)
    selected: NDArray[np.bool_] | None = field(repr=False)
    """(height, width) of what has an outline."""
    split: float = -1.0
    """Where they were split last, as a fraction of the width."""

    def at(self, split: float) -> NDArray[np.uint8]:
        """(height, width, 3) sRGB, split there."""
        self.split = split
        column = round(min(max(split, 0.0), 1.0) * self.left.shape[1])
        result = self.left.copy()
        result[:, column:] = self.right[:, column:]
        result[:, column : column + 1] = _LINE
        return result if self.selected is None else outlined(result, self.selected)


def compared(name: str, scene: Scene, device: Device, frames: int) -> Comparison:
    """The comparison of this name, "path_traced" or a preset's, with pictures of `frames` samples or frames. Raises
    PicaError for another name, DeviceError where nothing traces paths."""
    if name == PATH_TRACED:
        check_traces(device, "path tracing")
        return _Reference(scene, device, frames)
    if name not in presets():
        raise PicaError(f"compare: {shown(name)} is not one of {', '.join((PATH_TRACED, *presets()))}")
    return _Preset(name, scene, device)


class _Preset:
    """Frame by frame, as the picture on the left."""

    def __init__(self, name: str, scene: Scene, device: Device) -> None:
        self.name = name
        self._renderer = ViewRenderer(scene, Settings.preset(name), device)

    def picture(self, view: View, settings: Settings, interrupted: Callable[[], bool]) -> NDArray[np.uint8] | None:
        return self._renderer.advance(view, True, lambda: ("display",))["display"]()

    def is_complete(self, view: View) -> bool:
        return True

    def close(self) -> None:
        self._renderer.close()


class _InterruptedError(Exception):
    """A picture of the path tracer is given up."""


class _Reference:
    """Path traced pictures of whole size, each from the first sample on: with 1, 2, 4… samples as the frames of the
    picture on the left are as many. All of them together cost twice the last."""

    name = PATH_TRACED

    def __init__(self, scene: Scene, device: Device, frames: int) -> None:
        self._scene, self._device, self._frames = scene, device, frames
        self._tracer: PathTracer | None = None
        self._made_for: object = None
        """Size and settings of the path tracer."""
        self._shows: Any = None
        """View and state of its newest picture."""
        self._pixels: NDArray[np.uint8] | None = None
        self._samples = 0

    def picture(self, view: View, settings: Settings, interrupted: Callable[[], bool]) -> NDArray[np.uint8] | None:
        if not view.resolution.is_full:
            return None
        if self._shows != (view, view.state):
            self._shows, self._pixels, self._samples = (view, view.state), None, 0
        wanted = self._frames if view.frames >= self._frames else 1 << (view.frames.bit_length() - 1)
        if wanted > self._samples:
            try:
                frame = self._prepared(view, settings).render(
                    wanted, camera=view.control.camera, progress=_giving_up(interrupted), aovs=()
                )
                self._pixels, self._samples = frame.display, wanted
            except _InterruptedError:
                pass
        return self._pixels

    def is_complete(self, view: View) -> bool:
        return self._shows == (view, view.state) and self._samples == self._frames

    def close(self) -> None:
        if self._tracer is not None:
            self._tracer.close()

    def _prepared(self, view: View, settings: Settings) -> PathTracer:
        made_for = view.resolution.size, settings
        if self._tracer is None or made_for != self._made_for:
            self.close()
            self._made_for = made_for
            self._tracer = PathTracer(self._scene, size=view.resolution.size, settings=settings, device=self._device)
        return self._tracer


def _giving_up(interrupted: Callable[[], bool]) -> Callable[[int, int], None]:
    def progress(done: int, total: int) -> None:
        if done < total and interrupted():
            raise _InterruptedError

    return progress
