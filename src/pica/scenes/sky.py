"""Environments made in code: smooth gradients with soft windows of light."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.scene.environment import Environment
from pica.scene.light import Color


@dataclass(frozen=True)
class Window:
    """A rounded rectangle of light in the sky that fades at its edges."""

    azimuth: float
    """Degrees from +X towards +Z."""
    elevation: float
    """Degrees above the horizon."""
    width: float
    """Degrees from side to side."""
    height: float
    radiance: Color
    """Nits in the middle."""


def gradient_sky(
    zenith: Color, horizon: Color, nadir: Color, windows: Sequence[Window] = (), height: int = 128, name: str = "sky"
) -> Environment:
    """A sky that fades from `nadir` over `horizon` to `zenith`, in nits, (height, 2 height, 3) pixels."""
    v, u = (np.arange(height) + 0.5) / height, (np.arange(2 * height) + 0.5) / (2 * height)
    azimuth, elevation = np.meshgrid((u - 0.5) * 360.0, 90.0 - v * 180.0)
    rise = np.sin(np.radians(elevation))[..., None]
    radiance = np.where(
        rise > 0,
        _blend(np.asarray(horizon), np.asarray(zenith), _smooth(np.maximum(rise, 0) ** 0.7)),
        _blend(np.asarray(horizon), np.asarray(nadir), _smooth(np.maximum(-rise, 0) ** 0.5)),
    )
    for window in windows:
        # Azimuth shrinks towards the poles; its cosine keeps the window's shape.
        across = ((azimuth - window.azimuth + 180) % 360 - 180) * np.cos(np.radians(window.elevation))
        outside = np.hypot(
            np.maximum(np.abs(across) / (window.width / 2) - 0.6, 0),
            np.maximum(np.abs(elevation - window.elevation) / (window.height / 2) - 0.6, 0),
        )
        light = _smooth(np.clip(1 - outside / 0.4, 0, 1))[..., None]
        radiance = _blend(radiance, np.maximum(radiance, window.radiance), light)
    return Environment(radiance.astype(np.float32), name=name)


def _blend(start: NDArray[np.float64], end: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
    return start + (end - start) * share


def _smooth(share: NDArray[np.float64]) -> NDArray[np.float64]:
    return share * share * (3 - 2 * share)
