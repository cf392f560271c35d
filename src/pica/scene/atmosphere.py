"""Sky and sun of a clear day: scattering in the Earth's atmosphere, integrated numerically.

Sebastien Hillaire, "A Scalable and Production Ready Sky and Atmosphere Rendering Technique", EGSR 2020: coefficients of
table 1, and its approximation of multiple scattering (section 5.5). The table of transmittance is mapped as in Bruneton
and Neyret, "Precomputed Atmospheric Scattering", EGSR 2008. Lengths in kilometres.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SUN_DIAMETER = math.radians(0.53)
_SUN_LUX = 127_500.0
"""Illuminance above the atmosphere (IES, Recommended Practice for the Calculation of Daylight Availability, 1984)."""
_GROUND, _TOP, _EYE = 6360.0, 6460.0, 0.002
_RAYLEIGH = np.array([5.802e-3, 13.558e-3, 33.1e-3])
_OZONE = np.array([0.650e-3, 1.881e-3, 0.085e-3])
_RAYLEIGH_HEIGHT, _MIE_HEIGHT, _MIE_ALBEDO, _MIE_G = 8.0, 1.2, 0.9, 0.8
_SHAPE = (32, 128)
"""Heights and directions in the table of transmittance."""


class Atmosphere:
    """Air of a turbidity (1: no haze; optical depth relative to that of clean air, at green) above a diffuse ground."""

    def __init__(self, turbidity: float, albedo: float) -> None:
        self._albedo = albedo
        self._mie = (turbidity - 1) * _RAYLEIGH[1] * _RAYLEIGH_HEIGHT / _MIE_HEIGHT
        self._transmittance = self._transmittance_table()
        self._multiple = self._multiple_table()

    def sun_illuminance(self, elevation: float) -> Array:
        """(3,) lux on a surface that faces the sun, at the ground."""
        return _SUN_LUX * self._to_sun(np.array(_GROUND + _EYE), np.array(math.sin(elevation)))

    def radiance(self, up: Array, around: Array, elevation: float) -> Array:
        """(*shape, 3) nits of the sky without the sun; `up`: sine of the elevation, above 0; `around`: radians of
        azimuth from the sun; both (*shape)."""
        across = np.sqrt(1 - up**2) * np.cos(around)
        toward = across * math.cos(elevation) + up * math.sin(elevation)
        return _SUN_LUX * self._march(np.array(_GROUND + _EYE), up, toward, math.sin(elevation), 40)[0]

    def _extinction(self, height: Array) -> tuple[Array, Array, Array]:
        """(*shape, 3) scattering by molecules and by haze, and extinction, per km."""
        rayleigh = _RAYLEIGH * np.exp(-height / _RAYLEIGH_HEIGHT)[..., None]
        haze = self._mie * np.exp(-height / _MIE_HEIGHT)[..., None]
        ozone = _OZONE * np.maximum(0, 1 - np.abs(height - 25) / 15)[..., None]
        return rayleigh, haze * _MIE_ALBEDO, rayleigh + haze + ozone

    def _transmittance_table(self) -> Array:
        far = math.sqrt(_TOP**2 - _GROUND**2)
        rho = far * np.linspace(0, 1, _SHAPE[0])[:, None]
        radius = np.sqrt(rho**2 + _GROUND**2)
        near = _TOP - radius
        length = near + np.linspace(0, 1, _SHAPE[1]) * (rho + far - near)
        mu = (far**2 - rho**2 - length**2) / np.maximum(2 * radius * length, 1e-9)
        t, dt = _steps(length, 40)
        height = np.sqrt(radius[..., None] ** 2 + t**2 + 2 * radius[..., None] * mu[..., None] * t) - _GROUND
        return np.exp(-(self._extinction(height)[2] * dt[..., None]).sum(-2))

    def _to_sun(self, radius: Array, mu: Array) -> Array:
        """(*shape, 3) part of the sun's light that arrives; the disk sets behind the ground over its diameter."""
        far = math.sqrt(_TOP**2 - _GROUND**2)
        rho = np.sqrt(np.maximum(radius**2 - _GROUND**2, 0))
        horizon = -rho / radius
        above = np.maximum(mu, horizon)
        length = -radius * above + np.sqrt(np.maximum(radius**2 * (above**2 - 1) + _TOP**2, 0))
        near = _TOP - radius
        part = (length - near) / np.maximum(rho + far - near, 1e-9)
        seen = np.clip(0.5 + (mu - horizon) / SUN_DIAMETER, 0, 1)
        return _bilinear(self._transmittance, rho / far, part) * (seen * seen * (3 - 2 * seen))[..., None]

    def _multiple_table(self) -> Array:
        """(heights, directions, 3) radiance of all orders of scattering after the first, per lux above."""
        radius = (_GROUND + 0.01 + (_TOP - _GROUND - 0.02) * np.linspace(0, 1, 16) ** 2)[:, None, None]
        sun = _sun_axis(24)[:, None]
        points = np.arange(32) + 0.5
        up, around = 1 - points / 16, points * math.pi * (3 - math.sqrt(5))  # Directions of a Fibonacci spiral.
        toward = up * sun + np.sqrt(1 - up**2) * np.cos(around) * np.sqrt(1 - sun**2)
        radius, up, toward, sun = np.broadcast_arrays(radius, up, toward, sun)
        second, again = self._march(radius, up, toward, sun, 16, isotropic=True)
        return second.mean(-2) / (1 - again.mean(-2))

    def _march(
        self, radius: Array, up: Array, toward: Array, sun: "Array | float", steps: int, isotropic: bool = False
    ) -> tuple[Array, Array]:
        """(*shape, 3) radiance per lux above along rays, and the part of light that is scattered once more.

        `up`, `toward` and `sun`: cosines of ray and zenith, of ray and sun, and of sun and zenith.
        """
        to_ground = radius**2 * (up**2 - 1) + _GROUND**2
        hits = (up < 0) & (to_ground > 0)
        length = np.where(
            hits,
            -radius * up - np.sqrt(np.maximum(to_ground, 0)),
            -radius * up + np.sqrt(radius**2 * (up**2 - 1) + _TOP**2),
        )
        t, dt = _steps(length, steps)
        at = np.sqrt((radius**2)[..., None] + t**2 + 2 * (radius * up)[..., None] * t)
        mu = np.clip(((radius * sun)[..., None] + t * toward[..., None]) / at, -1, 1)
        rayleigh, haze, extinction = self._extinction(at - _GROUND)
        depth = extinction * dt[..., None]
        through = np.exp(-depth)
        before = np.exp(depth - np.cumsum(depth, -2))
        weight = before * (1 - through) / np.maximum(extinction, 1e-12)
        light = self._to_sun(at, mu)
        if isotropic:
            source = (rayleigh + haze) * light / (4 * math.pi)
        else:
            cosine = toward[..., None, None]
            phases = rayleigh * 3 / (16 * math.pi) * (1 + cosine**2) + haze * _cornette_shanks(cosine)
            height = np.sqrt(np.clip((at - _GROUND) / (_TOP - _GROUND), 0, 1))
            turned = 0.5 + 0.5 * np.sign(mu) * np.sqrt(np.abs(mu))
            source = phases * light + (rayleigh + haze) * _bilinear(self._multiple, height, turned)
        radiance = (weight * source).sum(-2)
        end = before[..., -1, :] * through[..., -1, :]
        ground = np.maximum(mu[..., -1], 0)[..., None] * light[..., -1, :] * self._albedo / math.pi
        return radiance + np.where(hits[..., None], end * ground, 0), (weight * (rayleigh + haze)).sum(-2)


@lru_cache(maxsize=4)
def atmosphere(turbidity: float, albedo: float) -> Atmosphere:
    """The tables of an atmosphere, kept: the sky and the sun need the same ones."""
    return Atmosphere(turbidity, albedo)


def sky_picture(elevation: float, azimuth: float, turbidity: float, albedo: float, height: int = 128) -> Array:
    """(height, 2 height, 3) nits, laid out as Environment.radiance, without the sun's disk.

    The lower half is the ground under sky and sun. Angles in radians; `azimuth`: from north (-Z) towards east (+X).
    """
    air = atmosphere(turbidity, albedo)
    rows = math.pi / 2 - (np.arange(height // 2) + 0.5) / height * math.pi
    around = np.linspace(0, math.pi, height // 2 + 1)
    up, aside = np.broadcast_arrays(np.sin(rows)[:, None], around)
    half = air.radiance(up, aside, elevation)
    columns = ((np.arange(2 * height) + 0.5) / (2 * height) - 0.5) * 2 * math.pi
    away = np.abs((columns - (azimuth - math.pi / 2) + math.pi) % (2 * math.pi) - math.pi)
    place = away / math.pi * (height // 2)
    left = np.minimum(place.astype(int), height // 2 - 1)
    part = (place - left)[:, None]
    sky = half[:, left] * (1 - part) + half[:, left + 1] * part
    solid = (np.sin(rows) * np.cos(rows))[:, None, None] * (math.pi / height) ** 2
    lux = (sky * solid).sum((0, 1)) + air.sun_illuminance(elevation) * max(math.sin(elevation), 0)
    return np.concatenate([sky, np.broadcast_to(albedo / math.pi * lux, sky.shape)])


def _steps(length: Array, count: int) -> tuple[Array, Array]:
    """(*shape, count) middles and lengths of steps, finer near the start, where the air is dense."""
    edges = np.linspace(0, 1, count + 1) ** 2
    return length[..., None] * (edges[1:] + edges[:-1]) / 2, length[..., None] * np.diff(edges)


def _sun_axis(count: int) -> Array:
    """(count,) cosines of sun and zenith in the table of multiple scattering, finer near the horizon."""
    axis = np.linspace(-1, 1, count)
    return np.sign(axis) * axis**2


def _cornette_shanks(cosine: Array) -> Array:
    g = _MIE_G
    return (
        3 / (8 * math.pi) * (1 - g * g) * (1 + cosine**2) / ((2 + g * g) * (1 + g * g - 2 * g * cosine) ** 1.5)
    )  # fmt: skip


def _bilinear(table: Array, row: Array, column: Array) -> Array:
    """(*shape, 3) of a table (rows, columns, 3) at places from 0 to 1."""
    y = np.clip(row, 0, 1) * (table.shape[0] - 1)
    x = np.clip(column, 0, 1) * (table.shape[1] - 1)
    y0, x0 = np.minimum(y.astype(int), table.shape[0] - 2), np.minimum(x.astype(int), table.shape[1] - 2)
    fy, fx = (y - y0)[..., None], (x - x0)[..., None]
    upper = table[y0, x0] * (1 - fx) + table[y0, x0 + 1] * fx
    lower = table[y0 + 1, x0] * (1 - fx) + table[y0 + 1, x0 + 1] * fx
    return np.asarray(upper * (1 - fy) + lower * fy)
