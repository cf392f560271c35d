"""Fit the closed forms in src/pica/shaders/lobe_cosines.slang and print their constants as Slang.

    PYTHONPATH=. python tools/fit_lobe_cosines.py

View and visible microfacet normals, weighted by what a GGX mirror reflects, enclose angles whose cosines are
distributed in some way. Cut into three parts of equal weight, each has a mean; the mean of a function over the lobe is
about that of its values there. The shader stores, for each of the three,

    mu + roughness * Q(x, roughness)        Q of degree 3 in x and in roughness

where x = mu / (mu + 1.5 alpha). Needs NumPy.
"""

import numpy as np
from numpy.typing import NDArray

from tools.fit_ggx_energy import visible_normals

Array = NDArray[np.float64]
PARTS = 3
STRETCH = 1.5
DEGREE = 3


def part_means(mu: float, alpha: float) -> Array:
    """(PARTS,) mean cosines of the parts of equal weight, the smallest first."""
    cosines, weights = (values.ravel() for values in visible_normals(mu, alpha, 120))
    order = np.argsort(cosines)
    cosines, weights = cosines[order], weights[order] / weights.sum()
    part = np.minimum((np.cumsum(weights) * PARTS).astype(int), PARTS - 1)
    return np.array([np.average(cosines[part == k], weights=weights[part == k]) for k in range(PARTS)])


def main() -> None:
    """Integrate, fit, print."""
    roughness_grid = np.linspace(np.sqrt(1e-3), 1, 20)
    mu_grid = np.concatenate([[0.002, 0.01], np.linspace(0.15, 1, 26) ** 2])
    roughness, mu = (grid.ravel() for grid in np.meshgrid(roughness_grid, mu_grid, indexing="ij"))
    means = np.array([part_means(m, r * r) for r, m in zip(roughness, mu, strict=True)])
    x = mu / (mu + STRETCH * roughness**2)
    powers = range(DEGREE + 1)
    features = roughness[:, None] * np.stack([x**i * roughness**j for j in powers for i in powers], axis=1)
    for part in range(PARTS):
        coefficients = np.linalg.lstsq(features, means[:, part] - mu, rcond=None)[0]
        error = features @ coefficients - means[:, part] + mu
        print(f"// part {part}: max error {np.abs(error).max():.4f}, rms {np.sqrt((error**2).mean()):.4f}")
        for power, row in enumerate(coefficients.reshape(DEGREE + 1, -1)):
            print(f"static const float4 part{part}{power} = float4({', '.join(f'{value:.9g}' for value in row)});")


if __name__ == "__main__":
    main()
