"""Views of local lights' shadow maps: one for a spot light, five or six for others."""

import math

import numpy as np

from pica.gpu_scene.lights.light_rows import Matrix, pack_light
from pica.scene.camera import Camera
from pica.scene.light import DiskLight, Light, RectangleLight, SpotLight

_WIDEST_SPOT = math.radians(60.0)
"""Half the angle from which on a single view would waste its middle: it gets the faces of a cube."""
_GUARD = 3.0
"""Texels beyond the edges of a face, for filters."""
_NEAREST = 1e-4
"""Near plane, as a fraction of the scene's radius: nearer objects cast no shadow."""


def face_count(light: Light) -> int:
    """How many views a light needs."""
    if isinstance(light, SpotLight) and light.outer_cone_angle < _WIDEST_SPOT:
        return 1
    return 5 if isinstance(light, RectangleLight | DiskLight) else 6


def light_faces(light: Light, world: Matrix, scene_radius: float, size: int) -> list[Camera]:
    """Perspective views from the centre of a light with a (4, 4) matrix; `size`: texels along an edge.

    Flat lights need no view of their back. Objects within a sphere light cast no shadow.
    """
    row = pack_light(light, world)
    place, forward = row["position"].astype(np.float64), row["direction"].astype(np.float64)
    near = max(float(row["radius"]), _NEAREST * scene_radius)
    count = face_count(light)
    slope = math.tan(light.outer_cone_angle) if isinstance(light, SpotLight) and count == 1 else 1.0
    fov = 2 * math.atan(slope * (1 + 2 * _GUARD / size))
    ahead = Camera.look_at(place, place + forward, vertical_fov=fov, near=near)
    right, up = ahead.transform[:3, 0], ahead.transform[:3, 1]
    directions = [forward, right, -right, up, -up, -forward][:count]
    return [
        ahead,
        *(Camera.look_at(place, place + way, vertical_fov=fov, up=forward, near=near) for way in directions[1:]),
    ]
