"""A scene at equal steps of time, as numbered pictures or as a film; a killed run can be gone on with."""

import math
import re
import shutil
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pica.cli import options
from pica.cli.report import progress
from pica.errors import PicaError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pica import Camera, Frame, Scene

FILM = ".mp4"
PICTURES = (".png", ".exr")
MOST_PICTURES = 1_000_000
_NUMBER = re.compile(r"%(0\d+)?d")


def is_sequence(output: Path) -> bool:
    """Whether a file name stands for many pictures."""
    return output.suffix.lower() == FILM or _NUMBER.search(output.name) is not None


@dataclass(frozen=True)
class Sequence:
    """The pictures of a sequence: when they are and where they go."""

    output: Path
    """out.mp4, or numbered pictures such as frames/%04d.exr."""
    start: float
    """Seconds, the time of the first picture."""
    fps: float
    seconds: float | None
    """None: as long as the animation goes on after `start`."""
    animation: int | str | None
    """As Scene.animate takes it."""

    def check(self, size: tuple[int, int], aovs: list[str] | None) -> None:
        """Raise PicaError for what can be known to be wrong before the scene is read."""
        if not 0 < self.fps <= 1000:
            raise PicaError(f"--fps {self.fps:g}: must be above 0 and at most 1000")
        if self.seconds is not None and not 0 < self.seconds < math.inf:
            raise PicaError(f"--seconds {self.seconds:g}: must be above 0")
        if self.output.suffix.lower() == FILM:
            from pica.video import check_size

            options.check_output(self.output, (FILM,))
            check_size(self.output, *size)
            if aovs:
                raise PicaError(f"{self.output}: a film has no buffers; --aov needs pictures, such as frames/%04d.exr")
            return
        if self.output.suffix.lower() not in PICTURES:
            raise PicaError(f"cannot write {self.output}: the name must end in .png, .exr or .mp4")
        if str(self.output).count("%") != 1:
            raise PicaError(f"cannot write {self.output}: the name must hold one %d, such as %04d, and no other %")

    def times(self, scene: "Scene") -> list[float]:
        """When each picture is, in seconds. Raises PicaError for a length that cannot be told or is too long."""
        seconds = self.seconds
        if seconds is None:
            scene.animate(self.start, self.animation)  # names the animations there are when this one is not
            seconds = scene.animation_duration(self.animation) - self.start
            if seconds <= 0:
                raise PicaError("--seconds is needed: no animation goes on after --start")
        count = max(round(seconds * self.fps), 1)
        if count > MOST_PICTURES:
            raise PicaError(f"{seconds:g} seconds at {self.fps:g} a second are over {MOST_PICTURES} pictures")
        return [self.start + number / self.fps for number in range(count)]
