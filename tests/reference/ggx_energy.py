"""The GGX lobe and how much light it reflects, by numerical integration: a comparison also checks pica's fits."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.reference.variant import dr, mi

MINIMUM_ALPHA = 1e-3


def ggx(cosine: Any, alpha: Any) -> Any:
    """Density of facet normals (B. Walter et al., "Microfacet Models for Refraction", EGSR 2007, equation 33)."""
    return alpha**2 / (np.pi * ((alpha**2 - 1) * cosine**2 + 1) ** 2)


def smith_over_cosines(view: Any, light: Any, alpha: Any) -> Any:
    """Height-correlated masking-shadowing over 4 times both cosines (E. Heitz, "Understanding the
    Masking-Shadowing Function", JCGT 3(2), 2014, equation 99)."""
    ahead = view * (alpha**2 + (1 - alpha**2) * light**2) ** 0.5
    back = light * (alpha**2 + (1 - alpha**2) * view**2) ** 0.5
    return 0.5 / (ahead + back)


class EnergyTables:
    """Shares of light that the single-bounce GGX lobe reflects, over cosine and roughness."""

    def __init__(self, size: int = 48, samples: int = 96) -> None:
        nodes = np.linspace(0, 1, size)
        constant, edge = _integrated(np.maximum(nodes, 1e-4), nodes, samples)
        self._constant, self._edge = _texture(constant.T[..., None]), _texture(edge.T[..., None])
        # The average over the hemisphere weighs by the cosine.
        fine = (np.arange(4096) + 0.5) / 4096
        averages = [
            [2 * np.mean(np.interp(fine, nodes, table[:, column]) * fine) for table in (constant, edge)]
            for column in range(size)
        ]
        self._averages = _line(np.array(averages))
        self._size = size

    def _node(self, share: mi.Float) -> mi.Float:
        """Texture coordinate of a number from 0 to 1: the outermost texel centres are the ends."""
        return (share * (self._size - 1) + 0.5) / self._size

    def constant(self, cosine: mi.Float, roughness: mi.Float) -> mi.Float:
        """The part that F0 multiplies."""
        return self._constant.eval(mi.Point2f(self._node(cosine), self._node(roughness)))[0]

    def edge(self, cosine: mi.Float, roughness: mi.Float) -> mi.Float:
        """The part that F90 multiplies."""
        return self._edge.eval(mi.Point2f(self._node(cosine), self._node(roughness)))[0]

    def white(self, cosine: mi.Float, roughness: mi.Float) -> mi.Float:
        """All of it, for facets that absorb nothing."""
        return self.constant(cosine, roughness) + self.edge(cosine, roughness)

    def average_constant(self, roughness: mi.Float) -> mi.Float:
        """Average of `constant` over the hemisphere."""
        return self._averages.eval(mi.Point1f(self._node(roughness)))[0]

    def average_edge(self, roughness: mi.Float) -> mi.Float:
        """Average of `edge` over the hemisphere."""
        return self._averages.eval(mi.Point1f(self._node(roughness)))[1]

    def average(self, roughness: mi.Float) -> mi.Float:
        """Average of `white` over the hemisphere."""
        return self.average_constant(roughness) + self.average_edge(roughness)


@lru_cache(maxsize=1)
def energy_tables() -> EnergyTables:
    """The tables, integrated at the first call."""
    return EnergyTables()


def _texture(values: NDArray[np.float64]) -> mi.Texture2f:
    return mi.Texture2f(mi.TensorXf(np.ascontiguousarray(values, np.float32)), wrap_mode=dr.WrapMode.Clamp)


def _line(values: NDArray[np.float64]) -> mi.Texture1f:
    return mi.Texture1f(mi.TensorXf(np.ascontiguousarray(values, np.float32)), wrap_mode=dr.WrapMode.Clamp)


def _integrated(
    cosines: NDArray[np.float64], roughnesses: NDArray[np.float64], samples: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Reflected shares (cosines, roughnesses) that multiply F0 and F90, by stratified visible normals."""
    u, v = np.meshgrid((np.arange(samples) + 0.5) / samples, (np.arange(samples) + 0.5) / samples)
    radius, angle = np.sqrt(u.ravel()), 2 * np.pi * v.ravel()
    constant, edge = np.zeros((len(cosines), len(roughnesses))), np.zeros((len(cosines), len(roughnesses)))
    for row, cosine in enumerate(cosines):
        for column, roughness in enumerate(roughnesses):
            alpha = max(roughness**2, MINIMUM_ALPHA)
            view = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
            # Heitz 2018, listing 1, with the view in the XZ plane.
            stretched = view * (alpha, alpha, 1)
            stretched /= np.linalg.norm(stretched)
            first = np.array([0.0, 1.0, 0.0])
            second = np.cross(stretched, first)
            x, y = radius * np.cos(angle), radius * np.sin(angle)
            share = 0.5 * (1 + stretched[2])
            y = (1 - share) * np.sqrt(1 - x**2) + share * y
            z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
            normal = x[:, None] * first + y[:, None] * second + z[:, None] * stretched
            normal = normal * (alpha, alpha, 1)
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            meets = normal @ view
            light = 2 * meets * normal[:, 2] - cosine
            seen = np.maximum(light, 1e-9)
            # G2 / G1: what is lit of what is visible.
            root = np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2)
            masking = 2 * cosine / (cosine + root)
            weight = np.where(light > 0, 4 * cosine * seen * smith_over_cosines(cosine, seen, alpha) / masking, 0)
            schlick = (1 - np.clip(meets, 0, 1)) ** 5
            constant[row, column], edge[row, column] = (weight * (1 - schlick)).mean(), (weight * schlick).mean()
    return constant, edge
