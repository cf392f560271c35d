"""Fit the closed form in src/pica/shaders/sheen.slang and print its constants as Slang.

    python tools/fit_sheen_energy.py

Directional albedo of the Charlie sheen (Estevez and Kulla 2017), which has no closed form. With
x = sqrt(mu / (mu + 0.1 roughness)), the shader has

    E = exp(P(x, sqrt(roughness)) + slope * mu / roughness)     P of degree 2 in x, 4 in sqrt(roughness)

Above 1 the error is relative: the shader divides there by E. Needs NumPy.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEAST_ROUGHNESS = 0.07
STRETCH = 0.1
DEGREES = (2, 4)


def shadowing(cosine: Array, alpha: float) -> Array:
    """Lambda of Estevez and Kulla 2017, section 3: their fit, between the constants of both ends."""
    share = (1 - alpha) ** 2
    ends = ((25.3245, 21.5473), (3.32435, 3.82987), (0.16801, 0.19823), (-1.27393, -1.97760), (-4.85967, -4.32054))
    a, b, c, d, e = (share * smooth + (1 - share) * rough for smooth, rough in ends)

    def exponent(x: Array) -> Array:
        return a / (1 + b * x**c) + d * x + e

    near = exponent(np.minimum(cosine, 1 - cosine))
    return np.exp(np.where(cosine < 0.5, near, 2 * exponent(np.array(0.5)) - near))


def albedo(mu: float, roughness: float, resolution: int = 160) -> float:
    """Share of even light that is reflected to one cosine, by Gauss and Legendre's rule, denser at the horizon."""
    alpha = roughness**2
    nodes, weights = np.polynomial.legendre.leggauss(resolution)
    z = ((nodes[:, None] + 1) / 2) ** 3
    phi = (np.arange(2 * resolution) + 0.5) / (2 * resolution) * 2 * np.pi
    sine = np.sqrt(1 - z * z)
    along, up = sine * np.cos(phi) + np.sqrt(1 - mu * mu), z + mu
    length_squared = along**2 + (sine * np.sin(phi)) ** 2 + up**2
    squared_sine = np.clip(1 - up**2 / length_squared, 0, 1)
    density = (2 + 1 / alpha) * squared_sine ** (0.5 / alpha) / (2 * np.pi)
    masked = 4 * mu * (1 + shadowing(np.array(mu), alpha) + shadowing(z, alpha))
    measure = weights[:, None] / 2 * 3 * ((nodes[:, None] + 1) / 2) ** 2 * 2 * np.pi / len(phi)
    return float((density / masked * measure).sum())


def features(mu: Array, roughness: Array) -> Array:
    """(points, 16) what the exponent is a sum of."""
    x, y = np.sqrt(mu / (mu + STRETCH * roughness)), np.sqrt(roughness)
    powers = [x**i * y**j for i in range(DEGREES[0] + 1) for j in range(DEGREES[1] + 1)]
    return np.stack([*powers, mu / roughness], 1)


def fit(terms: Array, target: Array) -> Array:
    """Coefficients that keep the largest error small: Gauss and Newton's method, the worst points weighted up."""
    scale, weight = np.maximum(target, 1), np.ones(len(target))
    start = target + 1e-3
    coefficients = np.linalg.lstsq(terms * start[:, None], np.log(target + 1e-9) * start, rcond=1e-12)[0]
    best, least = coefficients, np.inf
    for step in range(100):
        found = np.exp(np.clip(terms @ coefficients, -30, 3))
        error = np.abs(found - target) / scale
        if error.max() < least:
            best, least = coefficients, error.max()
        if step > 8:
            weight *= 1 + 0.5 * error / error.max()
            weight /= weight.mean()
        slope = weight * found / scale + 1e-4
        change = np.linalg.lstsq(terms * slope[:, None], weight * (target - found) / scale, rcond=1e-12)[0]
        coefficients = coefficients + 0.7 * change
    return best


def main() -> None:
    """Integrate, fit, print."""
    roughness_grid = np.linspace(LEAST_ROUGHNESS, 1, 25)
    mu_grid = np.concatenate([[0.002, 0.005], np.linspace(0.1, 1, 31) ** 2])
    target = np.array([albedo(mu, roughness) for roughness in roughness_grid for mu in mu_grid])
    roughness, mu = (grid.ravel() for grid in np.meshgrid(roughness_grid, mu_grid, indexing="ij"))
    terms = features(mu, roughness)
    coefficients = fit(terms, target)
    error = (np.exp(terms @ coefficients) - target) / np.maximum(target, 1)
    print(f"// E: max error {np.abs(error).max():.4f}, rms {np.sqrt((error**2).mean()):.4f}")
    rows = coefficients[:-1].reshape(DEGREES[0] + 1, -1).T
    for power, row in enumerate(rows):
        print(f"static const float3 energy{power} = float3({', '.join(f'{value:.9g}' for value in row)});")
    print(f"static const float energySlope = {coefficients[-1]:.9g};")


if __name__ == "__main__":
    main()
