"""Cameras that move along given places."""

import math
from dataclasses import dataclass, replace

import numpy as np

from pica.scene.camera import Camera


@dataclass(frozen=True)
class CameraPath:
    """Positions and targets of a camera at some times; smooth in between."""

    times: tuple[float, ...]
    """Seconds, ascending."""
    places: tuple[tuple[float, ...], ...]
    """At each time: eye and target in metres, and the vertical field of view in degrees."""

    def at(self, time: float) -> Camera:
        """The camera at a time, in seconds; constant before the first and after the last."""
        times, places = np.array(self.times), np.array(self.places)
        place = places[0]
        if len(times) > 1:
            # Cubic Hermite interpolation with slopes from the neighbours; Catmull-Rom's where times are even.
            slopes = np.gradient(places, times, axis=0)
            time = min(max(time, times[0]), times[-1])
            after = min(max(int(np.searchsorted(times, time)), 1), len(times) - 1)
            length = times[after] - times[after - 1]
            t = (time - times[after - 1]) / length
            place = (
                (1 + 2 * t) * (1 - t) ** 2 * places[after - 1]
                + t * (1 - t) ** 2 * length * slopes[after - 1]
                + t * t * (3 - 2 * t) * places[after]
                + t * t * (t - 1) * length * slopes[after]
            )
        camera = Camera.look_at(place[:3], place[3:6])
        return replace(camera, vertical_fov=math.radians(min(max(place[6], 1e-3), 179.0)))
