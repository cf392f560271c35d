"""Fit linearly transformed cosines to pica's GGX mirror lobe: src/pica/effects/lighting/ltc_ggx.npy.

    python tools/fit_ltc.py [--size 64] [--output PATH]

Heitz, Dupuy, Hill and Neubelt 2016, "Real-Time Polygonal-Light Shading with Linearly Transformed Cosines": the lobe of
each roughness and view is a clamped cosine whose directions go through a 3x3 matrix M, found by minimizing the L3 error
(section 3.3). Needs NumPy and SciPy, and a few minutes.

The table, (size, size, 6) float16. First index: roughness from 0 to 1; second: sqrt(1 - cosine of the view), likewise.
Channels 0 to 3 are the matrix that leads from the frame of the mirrored view to that of the cosine,

    a 0 b
    0 1 0        z: the mirrored view, y: normal x view
    c 0 d

which for smooth surfaces is diag(1, 1, alpha): the frame itself needs no table, and neither rounding nor interpolation
moves a sharp highlight. Channels 4 and 5 are the lobe's albedo under Schlick's Fresnel term, F0 * A + F90 * B, over the
part of the transformed cosine that lies above the horizon: what reaches below is cut off when the table is used.
"""

import argparse
from pathlib import Path

import numpy as np
from fit_ggx_energy import integrate
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]
OUTPUT = Path(__file__).parents[1] / "src" / "pica" / "effects" / "lighting" / "ltc_ggx.npy"
SMALLEST_ALPHA = 1e-3  # shaders/brdf.slang
SMALLEST_COSINE = 1e-3
SAMPLES = 24
"""Of each of two strategies and each of two dimensions."""


class Lobe:
    """The mirror lobe of one view in the plane y = 0, without Fresnel: BRDF times cosine, and how to sample it."""

    def __init__(self, alpha: float, cosine: float) -> None:
        self.alpha = alpha
        self.view = np.array([np.sqrt(1 - cosine * cosine), 0.0, cosine])
        self.directions, weight = self._sample()
        self.value, self.density = self.evaluate(self.directions)
        self.albedo = weight.mean()
        mean = (self.directions * weight).sum(1)
        mean[1] = 0  # by symmetry
        self.mean = mean / np.linalg.norm(mean)

    def evaluate(self, light: Array) -> tuple[Array, Array]:
        """Lobe and density of its samples for (3, n) directions; tests/shaders hold shaders/brdf.slang to the same."""
        alpha, view = self.alpha, self.view
        above = light[2] > 0
        z = np.where(above, light[2], 1.0)
        half = view[:, None] + light
        half = half / np.linalg.norm(half, axis=0)
        aside = half[0] ** 2 + half[1] ** 2 + alpha**2 * half[2] ** 2
        distribution = alpha**2 / (np.pi * aside**2)
        view_length = np.sqrt(alpha**2 * view[0] ** 2 + view[2] ** 2)
        light_length = np.sqrt(alpha**2 * (light[0] ** 2 + light[1] ** 2) + z * z)
        density = np.where(half[2] > 0, distribution * 0.5 / (view[2] + view_length), 0)
        value = distribution * 0.5 * z / (z * view_length + view[2] * light_length)
        return np.where(above, value, 0), density

    def _sample(self) -> tuple[Array, Array]:
        """Visible normals by spherical caps (Dupuy and Benyoub 2023, listing 3)."""
        alpha, view = self.alpha, self.view
        phi, share = (grid.ravel() for grid in np.meshgrid(2 * np.pi * midpoints(), midpoints(), indexing="ij"))
        stretched = view * [alpha, 1, 1]
        stretched = stretched / np.linalg.norm(stretched)
        z = (1 - share) * (1 + stretched[2]) - stretched[2]
        sine = np.sqrt(np.maximum(0, 1 - z * z))
        cap = np.stack([sine * np.cos(phi), sine * np.sin(phi), z]) + stretched[:, None]
        half = cap * np.array([alpha, alpha, 1])[:, None]
        half /= np.linalg.norm(half, axis=0)
        light = 2 * (view @ half) * half - view[:, None]
        value, density = self.evaluate(light)
        return light, value / np.maximum(density, 1e-300)


def midpoints() -> Array:
    """The middles of equal parts of 0 to 1."""
    return (np.arange(SAMPLES) + 0.5) / SAMPLES


def cosine_directions() -> Array:
    """(3, n) directions about +Z, by their cosine."""
    phi, share = (grid.ravel() for grid in np.meshgrid(2 * np.pi * midpoints(), midpoints(), indexing="ij"))
    radius = np.sqrt(share)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - share)])


COSINE_DIRECTIONS = cosine_directions()


def cosine_density(inverse: Array, directions: Array) -> Array:
    """The transformed cosine, per steradian (Heitz et al. 2016, equations 1 to 4)."""
    original = inverse @ directions
    length = np.linalg.norm(original, axis=0)
    return np.maximum(original[2], 0) / length**4 * abs(np.linalg.det(inverse)) / np.pi


def matrix(parameters: Array, mean: Array) -> Array:
    """M from the logarithms of its widths and its skew, about the lobe's mean direction (section 3.3)."""
    wide, across, skew = np.exp(parameters[0]), np.exp(parameters[1]), parameters[2]
    frame = np.stack([[mean[2], 0, -mean[0]], [0, 1, 0], mean], axis=1)
    return frame @ np.array([[wide, 0, skew], [0, across, 0], [0, 0, 1]])


def share_above(m: Array) -> float:
    """Part of the transformed cosine above the surface's horizon, a half sphere in the cosine's own frame too."""
    return float(1 + m[2, 2] / np.linalg.norm(m[2])) / 2


def error(parameters: Array, lobe: Lobe) -> float:
    """L3 error by both kinds of samples with the balance heuristic (Heitz et al. 2016, section 3.3)."""
    m = matrix(parameters, lobe.mean)
    inverse = np.linalg.inv(m)
    own = m @ COSINE_DIRECTIONS
    own /= np.linalg.norm(own, axis=0)
    directions = np.concatenate([own, lobe.directions], axis=1)
    value, density = lobe.evaluate(own)
    value, density = np.concatenate([value, lobe.value]), np.concatenate([density, lobe.density])
    fitted = cosine_density(inverse, directions)
    above = directions[2] > 0
    difference = np.abs(value - lobe.albedo / share_above(m) * fitted) ** 3
    return float((difference[above] / np.maximum(density + fitted, 1e-300)[above]).sum())


def table_matrix(parameters: Array, lobe: Lobe) -> Array:
    """(a, b, c, d) of the module's text."""
    view = lobe.view
    mirrored = np.stack([[view[2], 0, view[0]], [0, 1, 0], [-view[0], 0, view[2]]], axis=1)
    inverse = np.linalg.inv(matrix(parameters, lobe.mean)) @ mirrored
    inverse /= inverse[1, 1]
    return inverse[[0, 0, 2, 2], [0, 2, 0, 2]]


def fit_roughness(roughness: float, size: int) -> Array:
    """(size, 6): one roughness under all views, each starting from the one before."""
    alpha = max(roughness**2, SMALLEST_ALPHA)
    parameters = np.array([np.log(alpha), np.log(alpha), 0.0])
    rows = np.zeros((size, 6))
    for column in range(size):
        cosine = max(1 - (column / (size - 1)) ** 2, SMALLEST_COSINE)
        lobe = Lobe(alpha, cosine)
        step = 0.05 if column else 0.5
        simplex = parameters + np.concatenate([np.zeros((1, 3)), np.diag([step, step, step * np.exp(parameters[0])])])
        options = {"initial_simplex": simplex, "xatol": 1e-5, "fatol": 0, "maxfev": 400}
        # The error's own scale, the lobe's density cubed, would hide it from absolute tolerances.
        options["fatol"] = 1e-6 * error(parameters, lobe)
        parameters = minimize(error, parameters, args=(lobe,), method="Nelder-Mead", options=options).x
        albedo = np.array(integrate(cosine, alpha)) / share_above(matrix(parameters, lobe.mean))
        rows[column] = [*table_matrix(parameters, lobe), *albedo]
    return rows


def main() -> None:
    """Fit and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    arguments = parser.parse_args()
    size = arguments.size
    rows = []
    for row in range(size):
        rows.append(fit_roughness(row / (size - 1), size))
        print(f"{row + 1}/{size}", flush=True)
    np.save(arguments.output, np.array(rows).astype(np.float16))


if __name__ == "__main__":
    main()
