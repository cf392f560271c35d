"""How `pica render` makes pictures: what each worker needs for its share of a sequence."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pica.cli.sequence import Sequence
from pica.cli.subject import View

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from pica import Camera, Frame, LightMap, Lut, PathTracer, Renderer, Scene, Settings

_LEAD_IN = 160
"""Frames after which the histories of a sequence that begins in its middle differ little from those of a whole one."""
_SHORTEST = 16
"""Pictures of a worker's share at least."""


@dataclass(frozen=True)
class RenderJob:
    """The checked arguments of `pica render`. As Work, a chunk is a run of a sequence's pictures."""

    view: View
    size: tuple[int, int]
    settings: "Settings"
    path_traced: bool
    count: int
    """Frames, or samples if path traced, of a picture."""
    denoise: Literal[True, False, "fast"]
    aov: list[str] | None
    device: str | None
    light_map: "LightMap | None"
    lut: "Lut | None"
    devices: list[str] | None = None
    """In place of `device`."""
    sequence: Sequence | None = None
    chunks: tuple[tuple[int, ...], ...] = ()

    def renderer(self, scene: "Scene", device: str | None = None) -> "Renderer | PathTracer":
        """A renderer for the scene. `device`: in place of none."""
        import pica

        more: Any = {"size": self.size, "settings": self.settings, "lut": self.lut}
        if self.devices is not None:
            more["devices"] = self.devices
        else:
            more["device"] = self.device or device
        if self.path_traced:
            return pica.PathTracer(scene, **more)
        renderer = pica.Renderer(scene, light_map=self.light_map, **more)
        renderer.debug = any(name.startswith("debug.") for name in self.aov or [])
        return renderer

    def moving_camera(self, scene: "Scene", times: list[float]) -> Callable[[int], "Camera"]:
        """The camera of each picture of the sequence; called while the scene is in the picture's state."""
        assert self.sequence is not None
        return _moving_camera(self.view, scene, self.sequence, times)

    def render_sequence(
        self,
        scene: "Scene",
        renderer: "Renderer | PathTracer",
        camera_of: Callable[[int], "Camera"],
        times: list[float],
        missing: list[int],
        progress: Callable[[str], "AbstractContextManager[Callable[[int, int], None]]"],
    ) -> dict[str, float]:
        """Render the missing pictures; returns the timings of the last."""
        assert self.sequence is not None
        seconds: dict[str, Any] = {} if self.path_traced else {"seconds": 1 / self.sequence.fps}

        def shoot(number: int, whole: bool) -> "Frame":
            return renderer.render(
                1 if self.path_traced and not whole else self.count,
                camera=camera_of(number),
                denoise=self.denoise if whole else False,
                aovs=self.aov or None,
                **seconds,
            )

        def restart(number: int) -> None:
            if not self.path_traced:  # each of its pictures begins anew
                renderer.reset(frame=number * self.count)  # type: ignore[union-attr]

        def save_picture(frame: "Frame", file: Path) -> None:
            save(frame, file, self.aov)

        return self.sequence.render(
            scene,
            times,
            missing,
            shoot,
            save_picture,
            restart,
            lead_in=self.lead_in,
            progress=progress,
            share=bool(self.chunks),
        )

    @property
    def lead_in(self) -> int:
        """Pictures before one that its histories need."""
        return 1 if self.path_traced else math.ceil(_LEAD_IN / self.count)

    def files(self, picture: Path) -> list[Path]:
        """All files of a picture's file."""
        return list(files_of(picture, self.aov).values())

    def split(self, missing: list[int]) -> tuple[tuple[int, ...], ...]:
        """Runs of pictures, several times as long as what is rendered before each for its histories."""
        length = max(_SHORTEST, 4 * self.lead_in)
        return tuple(tuple(missing[first : first + length]) for first in range(0, len(missing), length))

    def weight(self, chunk: int) -> int:
        """See Work: pictures."""
        return len(self.chunks[chunk])

    def open(self, worker: int) -> Callable[[int], None]:
        """See Work: loads the scene and makes a renderer for all runs of this worker."""
        from contextlib import nullcontext

        from pica.rhi.adapters import for_worker

        assert self.sequence is not None
        sequence, scene = self.sequence, self.view.load(moving=True)
        times = sequence.times(scene)
        camera_of = self.moving_camera(scene, times)
        renderer = self.renderer(scene, for_worker(worker))

        def render(chunk: int) -> None:
            missing = sequence.unfinished(self.chunks[chunk], self.files)  # a worker that was lost has made some
            silent = nullcontext(lambda done, total: None)
            self.render_sequence(scene, renderer, camera_of, times, missing, lambda title: silent)

        return render


def _moving_camera(view: View, scene: "Scene", sequence: Sequence, times: list[float]) -> Callable[[int], "Camera"]:
    """The camera of each picture of a sequence; called while the scene is in the picture's state."""
    from pica.scene.orbit import orbited

    path, framed = sequence.path, None
    if path is not None:
        return lambda number: view.focused(scene, path.at(times[number]))
    if not view.has_camera and not scene.cameras():
        framed = sequence.framing(scene, times)

    def now() -> "Camera":
        return view.focused(scene, view.camera_in(scene) or framed or scene.cameras()[0])

    if not sequence.turntable:
        return lambda _: now()
    center = view.looked_at(scene, now())
    return lambda number: orbited(now(), center, 2 * math.pi * number / len(times))


def save(frame: "Frame", output: Path, aovs: list[str] | None) -> list[Path]:
    """Write the picture and, with a .png, one picture for each AOV; the files written. Raises PicaError."""
    for name in aovs or []:
        frame.aov(name)  # raises for an unknown name before anything is written
    files = files_of(output, aovs)
    for name, path in files.items():
        if name:
            frame.save_aov(name, path)
    frame.save(output, aovs=aovs)  # last: where it lies, all that belongs to it does
    return list(files.values())


def files_of(output: Path, aovs: list[str] | None) -> dict[str, Path]:
    """The files that `save` writes, by the name of the AOV; the picture's is empty."""
    beside = [] if output.suffix.lower() == ".exr" else aovs or []
    return {"": output, **{name: output.with_name(f"{output.stem}.{name}{output.suffix}") for name in beside}}
