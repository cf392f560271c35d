"""Shots of films: what a camera does between two cuts."""

from dataclasses import dataclass

import numpy as np

from pica.scene.camera_path import CameraPath


@dataclass(frozen=True)
class Shot:
    """A camera's path, and what the scene does meanwhile."""

    start: float
    """The scene's time at the beginning, in seconds."""
    path: CameraPath
    """From time 0 on."""

    @property
    def seconds(self) -> float:
        """Duration."""
        return self.path.times[-1]


def shot(start: float, seconds: float, *places: tuple[float, ...]) -> Shot:
    """A shot from the scene's time `start` on, through places at equal steps of time: eye and target in metres, and the
    vertical field of view in degrees, 7 numbers each."""
    times = np.linspace(0, seconds, len(places))
    return Shot(start, CameraPath(tuple(float(time) for time in times), places))
