"""Rotations as people enter them: Euler angles about X, then Y, then Z, as Blender's "XYZ Euler"."""

import math

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import Pose

_SHEAR = 1e-4
"""Cosine between two axes of a matrix, below which they are perpendicular."""


def euler_of(rotation: NDArray[np.float64]) -> tuple[float, float, float]:
    """Degrees of a (3, 3) rotation Rz Ry Rx; at the poles, where X and Z turn alike, X has all of it."""
    y = math.asin(min(max(-rotation[2, 0], -1.0), 1.0))
    if abs(rotation[2, 0]) < 1 - 1e-9:
        x, z = math.atan2(rotation[2, 1], rotation[2, 2]), math.atan2(rotation[1, 0], rotation[0, 0])
    else:
        x, z = math.copysign(1.0, y) * math.atan2(rotation[0, 1], rotation[1, 1]), 0.0
    return math.degrees(x), math.degrees(y), math.degrees(z)


def quaternion_of(degrees: tuple[float, float, float]) -> NDArray[np.float64]:
    """(4,) x, y, z, w: the product of the quaternions about Z, Y and X."""
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(math.radians(a) / 2), math.sin(math.radians(a) / 2)) for a in degrees)
    return np.array(
        [
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
            cx * cy * cz + sx * sy * sz,
        ]
    )


def pose_of(matrix: NDArray[np.float64]) -> Pose | None:
    """Translation, rotation and scale of a (4, 4) transform; None if it has shear, or an axis without length."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    if not scale.all():
        return None
    rotation = matrix[:3, :3] / scale
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > _SHEAR:
        return None
    if np.linalg.det(rotation) < 0:
        scale[0], rotation[:, 0] = -scale[0], -rotation[:, 0]
    return Pose(matrix[:3, 3], quaternion_of(euler_of(rotation)), scale)
