"""Where the shadow maps of a directional light lie: spheres along the view, in a grid that does not move."""

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.bounds import Box
from pica.scene.camera import Camera
from pica.settings import ShadowMapsSettings

Vector = NDArray[np.float64]
_STEP = math.sqrt(2.0)
"""Ratio between the distances at which the shadowed part of the view may begin and end."""
_LEAST_RATIO = 1e-3
"""Fraction of the distance between nearest and farthest."""
_MARGIN = 0.25
"""Margin of a cascade, as a fraction of its radius, so that it need not be drawn in every frame."""
_PROACTIVE = 0.75
"""Fraction of its margin after which a cascade is redrawn, if no other one must be."""


@dataclass(frozen=True)
class Sphere:
    """A part of the world."""

    center: Vector
    radius: float


def split_distances(near: float, far: float, count: int, blend: float) -> list[float]:
    """count + 1 distances from `near` to `far`, metres: between equal steps (blend 0) and equal ratios (1).

    Zhang et al. 2006, "Parallel-Split Shadow Maps for Large-Scale Virtual Environments", section 3.3, equation 7
    (the practical split scheme).
    """
    shares = [i / count for i in range(count + 1)]
    return [blend * near * (far / near) ** s + (1 - blend) * (near + s * (far - near)) for s in shares]


def view_range(camera: Camera, box: Box) -> tuple[float, float]:
    """Distances along the view axis between which the box lies, rounded outwards so that they seldom change."""
    corners = np.array(np.meshgrid(*np.transpose(box))).reshape(3, -1).T
    along = (corners - camera.transform[:3, 3]) @ -camera.transform[:3, 2]
    far = _STEP ** math.ceil(math.log(max(float(along.max()), 2 * camera.near), _STEP))
    near = max(float(along.min()), camera.near, far * _LEAST_RATIO)
    return _STEP ** math.floor(math.log(near, _STEP)), far


def slice_sphere(camera: Camera, aspect: float, near: float, far: float) -> Sphere:
    """The smallest sphere about a point of the view axis that contains the frustum between two distances.

    Its size is independent of the view direction, so its texels need not change.
    """
    eye, forward = camera.transform[:3, 3], -camera.transform[:3, 2]
    if camera.orthographic_height is not None:
        half = np.array([*camera.reach(aspect), (far - near) / 2])
        return Sphere(eye + forward * (near + far) / 2, float(np.linalg.norm(half)))
    # Squared slope of the picture's farthest corner. The sphere goes through the corners of both ends, unless the far
    # ones are so wide apart that the one about their middle holds everything.
    slope = sum(reach**2 for reach in camera.reach(aspect))
    distance = min((near + far) / 2 * (1 + slope), far)
    return Sphere(eye + forward * distance, math.sqrt((far - distance) ** 2 + far**2 * slope))


def spheres(camera: Camera, aspect: float, box: Box, settings: ShadowMapsSettings) -> list[Sphere]:
    """The bounds of each cascade. Fewer than settings.cascades if one of them contains the whole scene."""
    center = (box[0] + box[1]) / 2
    whole = Sphere(center, max(float(np.linalg.norm(box[1] - box[0])) / 2, 1e-6))
    near, far = view_range(camera, box)
    ends = split_distances(near, far, settings.cascades, settings.cascade_split)
    result = []
    for begin, end in itertools.pairwise(ends):
        result.append(slice_sphere(camera, aspect, begin, end))
        if result[-1].radius >= whole.radius:
            return [*result[:-1], whole]
    return result


class Cascades:
    """The views of one directional light. A view stays as long as it contains its bounds."""

    def __init__(self, settings: ShadowMapsSettings) -> None:
        self._settings = settings
        self._drawn: list[Sphere | None] = [None] * settings.cascades

    def forget(self) -> None:
        """Invalidate every view, after a change of light or scene."""
        self._drawn = [None] * self._settings.cascades

    def update(self, targets: list[Sphere], light: Camera, box: Box) -> list[tuple[int, Camera]]:
        """The cascades that must be drawn to contain these spheres, each with its orthographic view from the light.

        `light`: its matrix; the position does not matter. If no view must be drawn, the one with the
        least margin left is, so that seldom two must be at once.
        """
        axes = light.transform[:3, :3]
        needs = [self._need(previous, sphere, axes) for previous, sphere in zip(self._drawn, targets, strict=False)]
        stale = [cascade for cascade, need in enumerate(needs) if need > 1]
        if not stale and max(needs) > _PROACTIVE:
            stale = [int(np.argmax(needs))]
        self._drawn[len(targets) :] = [None] * (self._settings.cascades - len(targets))
        return [(cascade, self._fit(cascade, targets[cascade], light, box)) for cascade in stale]

    def _need(self, previous: Sphere | None, target: Sphere, axes: Vector) -> float:
        """How much of its margin a view has used; infinite if it is invalid."""
        largest = target.radius * (1 + _MARGIN)
        if previous is None or previous.radius < target.radius or previous.radius > largest * (1 + 1e-6):
            return math.inf
        moved = float(np.abs((target.center - previous.center) @ axes[:, :2]).max())
        return moved / max(previous.radius - target.radius, 1e-3 * target.radius)

    def _fit(self, cascade: int, target: Sphere, light: Camera, box: Box) -> Camera:
        axes, radius = light.transform[:3, :3], target.radius * (1 + _MARGIN)
        # In steps of whole texels, so that an edge falls on the same texels wherever the camera moves.
        texel = 2 * radius / self._settings.cascade_size
        place = target.center @ axes
        place[:2] = np.round(place[:2] / texel) * texel
        # The box contains all casters of the view; light travels along the axes' -Z.
        corners = np.array(np.meshgrid(*np.transpose(box))).reshape(3, -1).T @ axes
        depth = max(float(np.ptp(corners[:, 2])), 1e-6)
        place[2] = corners[:, 2].max() + 0.01 * depth
        transform = light.transform.copy()
        transform[:3, 3] = axes @ place
        self._drawn[cascade] = Sphere(target.center, radius)
        return replace(light, transform=transform, orthographic_height=2 * radius, near=0.0, far=1.02 * depth)
