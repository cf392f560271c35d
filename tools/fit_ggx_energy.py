"""Fit the closed forms in src/pica/shaders/ggx_energy.slang and print their constants as Slang.

    python tools/fit_ggx_energy.py

The single-scattering albedo of a GGX mirror under Schlick's Fresnel term splits into F0 * A + F90 * B
(Karis 2013, "Real Shading in Unreal Engine 4"). With E = A + B the albedo of a mirror that reflects everything,
the shader stores

    1 - E = x (1 - x)^2 * P(x, alpha)                       P of degree 4 in x, 3 in alpha
    B / E = (1 - mu + roughness * Q(x, roughness))^5        Q of degree 3 in x, 4 in roughness

where x = mu / (mu + 0.7 alpha) stretches the layer near the horizon, whose width is alpha. Needs NumPy and SciPy.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]
STRETCH = 0.7
LOSS_DEGREES = (4, 3)
FRESNEL_DEGREES = (3, 4)
AVERAGE_DEGREE = 7


def visible_normals(mu: float, alpha: float, resolution: int) -> tuple[Array, Array]:
    """(resolution, resolution) cosines of view and visible normals of equal chance, and the share of each that leaves.

    Spherical caps: Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps", listing 3.
    Height-correlated masking: Heitz 2014, "Understanding the Masking-Shadowing Function", equation 99.
    """
    midpoints = (np.arange(resolution) + 0.5) / resolution
    phi, share = np.pi * midpoints[:, None], midpoints[None, :]  # the other half of phi is its mirror image
    sine = np.sqrt(max(0.0, 1 - mu * mu))
    length = np.hypot(sine * alpha, mu)
    view_x, view_z = sine * alpha / length, mu / length
    cap_z = (1 - share) * (1 + view_z) - view_z
    cap_sine = np.sqrt(np.maximum(0, 1 - cap_z * cap_z))
    half = np.stack(
        [(cap_sine * np.cos(phi) + view_x) * alpha, cap_sine * np.sin(phi) * alpha, cap_z + view_z + 0 * phi]
    )
    half /= np.linalg.norm(half, axis=0)
    cosine = sine * half[0] + mu * half[2]
    light_z = 2 * cosine * half[2] - mu
    above = np.maximum(light_z, 1e-12)
    view_lambda = 0.5 * (np.sqrt(1 + (alpha * sine / mu) ** 2) - 1)
    light_lambda = 0.5 * (np.sqrt(1 + alpha**2 * (1 / above**2 - 1)) - 1)
    return cosine, np.where(light_z > 0, (1 + view_lambda) / (1 + view_lambda + light_lambda), 0)


def integrate(mu: float, alpha: float, resolution: int = 256) -> tuple[float, float]:
    """(A, B) at one cosine and one alpha, by the midpoint rule over visible normals."""
    cosine, weight = visible_normals(mu, alpha, resolution)
    fresnel = np.clip(1 - cosine, 0, 1) ** 5
    return float((weight * (1 - fresnel)).mean()), float((weight * fresnel).mean())


def products(x: Array, y: Array, degrees: tuple[int, int]) -> Array:
    """(points, (degrees[0] + 1) * (degrees[1] + 1)) all x**i * y**j, j varying fastest."""
    return np.stack([x**i * y**j for i in range(degrees[0] + 1) for j in range(degrees[1] + 1)], axis=1)


def fit_loss(features: Array, target: Array) -> Array:
    """Coefficients that keep the largest error small: least squares, again and again, the worst points weighted up."""
    weight = np.ones(len(target))
    best, best_error = np.zeros(features.shape[1]), np.inf
    for _ in range(100):
        coefficients = np.linalg.lstsq(features * weight[:, None], target * weight, rcond=None)[0]
        error = np.abs(features @ coefficients - target)
        if error.max() < best_error:
            best, best_error = coefficients, error.max()
        weight *= 1 + 0.5 * error / error.max()
        weight /= weight.mean()
    return best


def fit_fresnel(features: Array, base: Array, albedo: Array, target: Array) -> Array:
    """As fit_loss, for albedo * (base + features @ coefficients)**5."""
    root = (target / albedo) ** 0.2
    slope = 5 * root**4 + 0.05
    coefficients = np.linalg.lstsq(features * slope[:, None], (root - base) * slope, rcond=None)[0]
    weight = np.ones(len(target))
    best, best_error = coefficients, np.inf
    for _ in range(40):

        def residual(c: Array, weight: Array = weight) -> Array:
            return weight * (albedo * np.maximum(features @ c + base, 0) ** 5 - target)

        coefficients = least_squares(residual, coefficients, max_nfev=10).x
        error = np.abs(residual(coefficients, np.ones_like(weight)))
        if error.max() < best_error:
            best, best_error = coefficients, error.max()
        weight = weight * (1 + error / error.max()) ** 0.7
        weight /= weight.mean()
    return best


def report(name: str, error: Array) -> None:
    """Print the largest and the root mean square error of one fit."""
    print(f"// {name}: max error {np.abs(error).max():.4f}, rms {np.sqrt((error**2).mean()):.4f}")


def print_rows(name: str, rows: Array) -> None:
    """Print (powers of y, powers of x) as one Slang constant per power of y; x up to 3 in a float4, 4 on its own."""
    for power, row in enumerate(rows):
        print(f"static const float4 {name}{power} = float4({', '.join(f'{value:.9g}' for value in row[:4])});")
    if rows.shape[1] > 4:
        print(f"static const float4 {name}Quartic = float4({', '.join(f'{value:.9g}' for value in rows[:, 4])});")


def main() -> None:
    """Integrate, fit, print."""
    roughness_grid = np.linspace(np.sqrt(1e-3), 1, 33)
    mu_grid = np.concatenate([[1e-4, 0.002, 0.005], np.linspace(0.1, 1, 37) ** 2])
    table = np.array([[integrate(mu, roughness**2) for mu in mu_grid] for roughness in roughness_grid])
    roughness, mu = (grid.ravel() for grid in np.meshgrid(roughness_grid, mu_grid, indexing="ij"))
    albedo, fresnel_part = table.sum(-1).ravel(), table[..., 1].ravel()

    def loss_features(mu: Array, roughness: Array) -> Array:
        x = mu / (mu + STRETCH * roughness**2)
        return (x * (1 - x) ** 2)[:, None] * products(x, roughness**2, LOSS_DEGREES)

    def fresnel_features(mu: Array, roughness: Array) -> Array:
        x = mu / (mu + STRETCH * roughness**2)
        return roughness[:, None] * products(x, roughness, FRESNEL_DEGREES)

    loss = fit_loss(loss_features(mu, roughness), 1 - albedo)
    fitted_albedo = 1 - np.maximum(loss_features(mu, roughness) @ loss, 0)
    fresnel = fit_fresnel(fresnel_features(mu, roughness), 1 - mu, fitted_albedo, fresnel_part)

    def fitted(mu: Array, roughness: Array) -> tuple[Array, Array]:
        lost = np.maximum(loss_features(mu, roughness) @ loss, 0)
        return lost, (1 - lost) * np.clip(1 - mu + fresnel_features(mu, roughness) @ fresnel, 0, 1) ** 5

    lost, part = fitted(mu, roughness)
    report("1 - E", lost - (1 - albedo))
    report("B", part - fresnel_part)
    print_rows("loss", loss.reshape(LOSS_DEGREES[0] + 1, -1).T)
    print_rows("fresnel", fresnel.reshape(FRESNEL_DEGREES[0] + 1, -1).T)

    # Hemispherical averages 2 * integral of mu * f(mu), of the fits themselves so that energy adds up.
    nodes, node_weights = np.polynomial.legendre.leggauss(400)
    points = ((nodes + 1) / 2) ** 2  # denser near the horizon
    measure = node_weights / 2 * 2 * np.sqrt(points) * 2 * points
    averages = np.array(
        [[(value * measure).sum() for value in fitted(points, np.full_like(points, r))] for r in roughness_grid]
    )
    powers = roughness_grid[:, None] ** np.arange(AVERAGE_DEGREE + 1)
    lost_average = averages[:, 0]
    scale = roughness_grid**3
    relative = 1 / (lost_average + 1e-3)
    lost_fit = np.linalg.lstsq(powers * (scale * relative)[:, None], lost_average * relative, rcond=None)[0]
    report("average of 1 - E", scale * (powers @ lost_fit) - lost_average)
    report("average of 1 - E, relative", (scale * (powers @ lost_fit) - lost_average) * relative)
    part_fit = np.linalg.lstsq(powers, averages[:, 1], rcond=None)[0]
    report("average of B", powers @ part_fit - averages[:, 1])
    for name, values in (("averageLoss", lost_fit), ("averageFresnel", part_fit)):
        print_rows(name, values.reshape(2, 4))


if __name__ == "__main__":
    main()
