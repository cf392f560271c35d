"""A scene at equal steps of time, as numbered pictures or as a film; a run that was cut short can be resumed."""

import math
import re
import shutil
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pica.cli import options
from pica.cli.report import progress
from pica.cli.subject import find_animation
from pica.errors import PicaError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pica import Camera, Frame, Scene
    from pica.scene.camera_path import CameraPath

FILM = ".mp4"
PICTURES = (".png", ".exr")
_NUMBER, _WIDE = re.compile(r"%(0\d+)?d"), re.compile(r"%0\d{3}")
_SLOWEST, _FASTEST = 0.001, 1000.0
"""Pictures a second."""
_LATEST = 1e9
"""Seconds before or after 0; beyond, double precision cannot separate pictures of fast films."""
_ROUND = 8.0
"""Default duration of a turntable in seconds."""
_WRITERS = 4
"""Threads that write the pictures of a film."""
_FRAMED = 16
"""Moments at which a scene without a camera is looked at, to find one that shows all of its movement."""


def is_sequence(output: Path) -> bool:
    """Whether a file name is a pattern for many pictures."""
    return output.suffix.lower() == FILM or _NUMBER.search(output.name) is not None


@dataclass(frozen=True)
class Sequence:
    """The pictures of a scene over time: their times, and their files.

    The pictures of a film are kept as .png files in a folder beside it until the film is whole.
    """

    output: Path
    """out.mp4, or numbered pictures such as frames/%04d.exr."""
    size: tuple[int, int]
    start: float
    """Seconds, the time of the first picture."""
    fps: float
    seconds: float | None
    """None: until the animation ends."""
    animation: str | None
    """Its name or its number; None: all together."""
    turntable: bool = False
    """Whether the camera is on a turntable."""
    path: "CameraPath | None" = None
    """The camera's path, if there is one."""

    def __post_init__(self) -> None:
        if not _SLOWEST <= self.fps <= _FASTEST:
            raise PicaError(f"--fps {self.fps:g}: must be {_SLOWEST:g} to {_FASTEST:g}")
        if self.seconds is not None and not 0 < self.seconds < math.inf:
            raise PicaError(f"--seconds {self.seconds:g}: must be above 0")
        if abs(self.start) > _LATEST:
            raise PicaError(f"--start {self.start:g}: must be {-_LATEST:g} to {_LATEST:g} seconds")
        if self.is_film:
            from pica.images.films import check_size

            options.check_output(self.output, (FILM,))
            check_size(self.output, *self.size)
        elif self.output.suffix.lower() not in PICTURES:
            raise PicaError(f"cannot write {self.output}: the name must end in .png, .exr or .mp4")
        elif str(self.output).count("%") != 1:
            raise PicaError(f"cannot write {self.output}: the name needs one %d, such as %04d, and no other %")
        elif _WIDE.search(self.output.name):
            raise PicaError(f"cannot write {self.output}: at most %099d")

    @property
    def is_film(self) -> bool:
        """Whether the pictures become one file."""
        return self.output.suffix.lower() == FILM

    @property
    def _folder(self) -> Path:
        return self.output.with_name(f"{self.output.name}.frames") if self.is_film else self.output.parent

    def file(self, number: int) -> Path:
        """The file of picture `number`, from 0."""
        return self._folder / (f"{number:06d}.png" if self.is_film else self.output.name % number)

    def times(self, scene: "Scene") -> list[float]:
        """The time of each picture in seconds. Raises PicaError if the duration is unknown, or there are too many."""
        seconds = self.seconds
        if not scene.animations and not self.turntable and self.path is None:
            warnings.warn(f"{self.output}: the scene has no animation, so nothing moves", stacklevel=2)
        if seconds is None:
            chosen = find_animation(scene, self.animation)
            durations = (clip.duration for n, clip in enumerate(scene.animations) if chosen in (None, n, clip.name))
            seconds = max([*durations, self.path.times[-1] if self.path else 0.0]) - self.start
            if seconds <= 0 and self.turntable:
                seconds = _ROUND
            if seconds <= 0:
                raise PicaError("--seconds is needed: nothing that moves goes on after the start")
        count = max(round(min(seconds * self.fps, 2 * options.MOST)), 1)
        if count > options.MOST:
            raise PicaError(f"--seconds {seconds:g} with --fps {self.fps:g}: over {options.MOST} pictures")
        return [self.start + number / self.fps for number in range(count)]

    def framing(self, scene: "Scene", times: list[float]) -> "Camera":
        """A camera that frames the subject at all times; leaves the scene at the first of them."""
        import numpy as np

        import pica
        from pica.scene.orbit import framing_all_round

        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for time in reversed(times[:: math.ceil(len(times) / _FRAMED)]):
            scene.animate(time, find_animation(scene, self.animation))
            corners = scene.subject_bounds()
            low, high = np.minimum(low, corners[0]), np.maximum(high, corners[1])
        frame = framing_all_round if self.turntable else pica.Camera.framing
        return frame(low, high, aspect=self.size[0] / self.size[1])

    def missing(self, count: int, files: Callable[[Path], list[Path]]) -> list[int]:
        """Which of `count` pictures are missing or incomplete after an earlier run.

        `files`: all files of a picture's file. Raises PicaError if some have another size.
        """
        if self.is_film:
            self._remove_empty_folder()  # of a run that was killed before its first picture
        if self.is_film and self.output.exists() and not self._folder.exists():
            from pica.images.films import describe

            with suppress(PicaError):  # it is broken
                if describe(self.output) == (count, *self.size):
                    return []
            return list(range(count))
        return self.unfinished(range(count), files)

    def unfinished(self, numbers: Iterable[int], files: Callable[[Path], list[Path]]) -> list[int]:
        """Which of these pictures are missing or incomplete; as `missing`."""
        return [number for number in numbers if not all(map(self._is_whole, files(self.file(number))))]

    def _is_whole(self, file: Path) -> bool:
        """Whether a picture is there and all of it can be read. Raises PicaError where it has another size."""
        from pica.errors import SceneError
        from pica.images.pictures import whole_size

        try:
            width, height = whole_size(file)
        except SceneError:
            return False
        if (width, height) != self.size:
            raise PicaError(f"--resume: {file} is {width}x{height}, not {self.size[0]}x{self.size[1]}")
        return True

    def render(
        self,
        scene: "Scene",
        times: list[float],
        missing: list[int],
        shoot: Callable[[int, bool], "Frame"],
        save: Callable[["Frame", Path], object],
        restart: Callable[[int], object],
        lead_in: int,
        progress: Callable[[str], AbstractContextManager[Callable[[int, int], None]]] = progress,
        share: bool = False,
    ) -> dict[str, float]:
        """Make the missing pictures and the film; returns the timings of the last.

        `shoot(number, True)` renders a picture of the current scene, `shoot(number, False)` for the history only.
        Histories need the pictures before a missing one: up to `lead_in` of them are rendered
        again, after `restart(number)` of their first. `progress` reports the progress.
        `share`: these are one worker's pictures, of which `finish` makes the film.
        """
        timings: dict[str, float] = {}
        if not missing and self.is_film and not self._folder.exists():
            return timings
        chosen = find_animation(scene, self.animation)
        before, done = -1, len(times) - len(missing)

        def make(number: int) -> "Frame":
            nonlocal before, done, timings
            first = max(before + 1, number - lead_in)
            if before < 0 or first > before + 1:
                restart(first)
            for earlier in range(first, number):
                scene.animate(times[earlier], chosen)
                shoot(earlier, False)
            advance(done, len(times))
            scene.animate(times[number], chosen)
            frame = shoot(number, True)
            if len(missing) == len(times) and number == 0:
                for stale in missing:  # of another run, which this one must not be resumed with
                    self.file(stale).unlink(missing_ok=True)
            before, done, timings = number, done + 1, frame.timings
            advance(done, len(times))
            return frame

        with self._pictures(), progress("Rendering") as advance:
            if self.is_film and not share:
                self._film(len(times), set(missing), make)
            for number in () if self.is_film and not share else missing:
                save(make(number), self.file(number))
        return timings

    def finish(self, count: int) -> None:
        """Make the film of `count` pictures that several workers have rendered, if they are to be one."""
        if self.is_film and self._folder.exists():
            self._film(count)

    @contextmanager
    def _pictures(self) -> Iterator[None]:
        """The folder of the pictures is there within the block; if it is new it stays only for pictures."""
        is_new = self.is_film or not self._folder.exists()
        self._folder.mkdir(parents=True, exist_ok=True)
        try:
            yield
        finally:
            if is_new:
                self._remove_empty_folder()

    def _remove_empty_folder(self) -> None:
        with suppress(OSError):  # not empty, or absent
            self._folder.rmdir()

    def _film(self, count: int, missing: Collection[int] = (), make: "Callable[[int], Frame] | None" = None) -> None:
        """Keep the film's pictures, and encode it, while the next one is made; then remove the pictures."""
        from pica.images.background import Background
        from pica.images.films import write_video
        from pica.images.pictures import read_image, write_png

        def pictures(background: Background) -> "Iterator[NDArray[np.uint8]]":
            for number in range(count):
                file = self.file(number)
                if make is None or number not in missing:
                    yield read_image(file, str(file))[..., :3]
                    continue
                picture = make(number).display
                background(write_png, file, picture, True)
                yield picture

        with Background(_WRITERS, _WRITERS) as background:
            write_video(self.output, pictures(background), self.fps)
        shutil.rmtree(self._folder)
