"""Films of built-in scenes, with cameras that are directed and cut."""

from collections.abc import Callable
from dataclasses import dataclass

from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scenes.corridor import SHOTS as CORRIDOR
from pica.scenes.corridor import corridor
from pica.scenes.machine_world import SHOTS as MACHINE_WORLD
from pica.scenes.machine_world import machine_world
from pica.scenes.shots import Shot
from pica.scenes.showroom import SHOTS as SHOWROOM
from pica.scenes.showroom import showroom


@dataclass(frozen=True)
class Picture:
    """One picture of a film."""

    time: float
    """Of the scene, in seconds."""
    camera: Camera
    is_cut: bool
    """Whether a shot begins with it."""


@dataclass(frozen=True)
class Demo:
    """A scene and the shots of its film."""

    make: Callable[[], Scene]
    shots: tuple[Shot, ...]
    about: str

    @property
    def seconds(self) -> float:
        """Duration of all shots."""
        return sum(shot.seconds for shot in self.shots)

    def pictures(self, fps: float, seconds: float) -> list[Picture]:
        """The pictures of a film of `seconds`. If it is shorter than all shots, it has the first part of each."""
        share = min(seconds / self.seconds, 1.0)
        return [
            Picture(shot.start + number / fps, shot.path.at(number / fps), number == 0)
            for shot in self.shots
            for number in range(max(round(shot.seconds * share * fps), 1))
        ]


DEMOS = {
    "machine_world": Demo(machine_world, MACHINE_WORLD, "a toy factory: many lights, glass, hundreds of moving parts"),
    "showroom": Demo(showroom, SHOWROOM, "a car of coated flake paint under giant area lights"),
    "corridor": Demo(corridor, CORRIDOR, "a lift lobby of gloss and mirrors"),
}
