"""Fit the closed forms in src/pica/shaders/anisotropic_energy.slang and print their constants as Slang.

    PYTHONPATH=. python tools/fit_anisotropic_energy.py

As fit_ggx_energy.py, for microfacets of two widths. Seen from one direction, those are a width along the view, one
across, and what ties both: the parts of the matrix of squared widths in a frame turned to the view. The shader stores

    1 - E = P(x, along, across, tie) - MARGIN                              P of degree 3
    B / E = (1 - mu + Q(x, sqrt(along), sqrt(across), sqrt(tie)))^5        Q of degree 3

where x = mu / (mu + 0.7 along), and polynomials of degree 4 for the averages over the hemisphere: of 1 - E the cube
root, for a small average divides others. Needs NumPy.
"""

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STRETCH = 0.7
DEGREE = 3
SAMPLES = 4000


def integrate(mu: float, azimuth: float, widths: tuple[float, float], resolution: int = 96) -> tuple[float, float]:
    """(E, B) towards a view of this cosine and azimuth from the first width's axis; sources as in fit_ggx_energy.py."""
    midpoints = (np.arange(resolution) + 0.5) / resolution
    phi, share = 2 * np.pi * midpoints[:, None], midpoints[None, :]
    scale = np.array([*widths, 1.0])
    sine = np.sqrt(max(0.0, 1 - mu * mu))
    view = np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), mu])
    length = np.linalg.norm(view * scale)
    stretched = view * scale / length
    z = (1 - share) * (1 + stretched[2]) - stretched[2]
    ring = np.sqrt(np.maximum(0, 1 - z * z))
    half = np.stack([ring * np.cos(phi), ring * np.sin(phi), z + 0 * phi], -1) + stretched
    half *= scale
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    cosine = half @ view
    light = 2 * cosine[..., None] * half - view
    above = np.maximum(light[..., 2], 1e-9)
    view_lambda = 0.5 * (length / mu - 1)
    light_lambda = 0.5 * (
        np.sqrt((light[..., 0] * widths[0]) ** 2 + (light[..., 1] * widths[1]) ** 2 + above**2) / above - 1
    )
    weight = np.where(light[..., 2] > 0, (1 + view_lambda) / (1 + view_lambda + light_lambda), 0)
    return float(weight.mean()), float((weight * np.clip(1 - cosine, 0, 1) ** 5).mean())


def seen_from(mu: Array, azimuth: Array, first: Array, second: Array) -> Array:
    """(points, 4): x, along, across, tie."""
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    along, across = np.hypot(first * cosine, second * sine), np.hypot(first * sine, second * cosine)
    tie = np.abs((first**2 - second**2) * cosine * sine) / np.maximum(along, 1e-6)
    return np.stack([mu / (mu + STRETCH * along), along, across, tie], -1)


def products(values: Array) -> Array:
    """(points, 35) of all products up to DEGREE, in the order in which the shader's loops find them."""
    found = [np.ones(len(values))]
    for i in range(4):
        found.append(values[:, i])
        for j in range(i + 1):
            found.append(values[:, i] * values[:, j])
            found.extend(values[:, i] * values[:, j] * values[:, k] for k in range(j + 1))
    return np.stack(found, -1)


def with_roots(values: Array) -> Array:
    """The same with the roots of widths."""
    return np.concatenate([values[:, :1], np.sqrt(values[:, 1:])], -1)


def evened(features: Array, target: Array, weight: Array, error_of: Callable[[Array], Array]) -> Array:
    """Coefficients that keep the largest error small, as fit_ggx_energy.fit_loss."""
    best, least, uneven = np.zeros(features.shape[1]), np.inf, np.ones(len(target))
    for _ in range(60):
        scale = (weight * uneven)[:, None]
        coefficients = np.linalg.lstsq(features * scale, target * scale[:, 0], rcond=None)[0]
        error = np.abs(error_of(coefficients))
        if error.max() < least:
            best, least = coefficients, error.max()
        uneven *= (1 + error / error.max()) ** 0.7
        uneven /= uneven.mean()
    return best


def show(name: str, values: Array) -> None:
    """As a Slang constant."""
    rows = [", ".join(f"{value:.7g}" for value in values[i : i + 7]) for i in range(0, len(values), 7)]
    print(f"static const float {name}[{len(values)}] = {{\n    " + ",\n    ".join(rows) + ",\n};")


def main() -> None:
    """Integrate, fit, print."""
    random = np.random.default_rng(1)
    smallest = np.sqrt(1e-3)
    roughness = smallest + (1 - smallest) * random.beta(0.8, 0.8, (2, SAMPLES))
    mu = np.maximum(random.uniform(0.03, 1, SAMPLES) ** 2, 0.002)
    azimuth = random.uniform(0, np.pi / 2, SAMPLES)
    azimuth[: SAMPLES // 3] = np.repeat([0, np.pi / 2], (SAMPLES // 3 + 1) // 2)[: SAMPLES // 3]
    first, second = roughness**2
    table = np.array([integrate(m, a, (f, s)) for m, a, f, s in zip(mu, azimuth, first, second, strict=True)])
    albedo, part = table.T
    seen = seen_from(mu, azimuth, first, second)
    plain, rooted = products(seen), products(with_roots(seen))

    loss = evened(plain, 1 - albedo, np.ones(SAMPLES), lambda c: plain @ c - (1 - albedo))
    root = (part / albedo) ** 0.2
    slope = (5 * root**4 + 0.05) * albedo

    def part_error(coefficients: Array) -> Array:
        return np.asarray(albedo * np.clip(1 - mu + rooted @ coefficients, 0, 1) ** 5 - part)

    fresnel = evened(rooted, root - 1 + mu, slope, part_error)
    errors = plain @ loss - (1 - albedo)
    margin = np.abs(errors).max()
    print(f"// 1 - E: max error {margin:.4f}, rms {errors.std():.4f}; B: {np.abs(part_error(fresnel)).max():.4f}")
    loss[0] -= margin
    show("loss", loss)
    show("fresnel", fresnel)

    # Averages over the hemisphere of the fits themselves, by the roughness along both axes.
    grid = np.linspace(smallest, 1, 14)
    nodes, weights = np.polynomial.legendre.leggauss(48)
    cosines, azimuths = (nodes + 1) / 2, (np.arange(16) + 0.5) / 16 * np.pi / 2
    rows, lost, grazing = [], [], []
    for one, two in itertools.product(grid, grid):
        m, a = (v.ravel() for v in np.meshgrid(cosines, azimuths, indexing="ij"))
        measure = np.repeat(weights * cosines, len(azimuths)) / len(azimuths)
        here = seen_from(m, a, np.full_like(m, one**2), np.full_like(m, two**2))
        missing = np.clip(products(here) @ loss, 0, 1)
        schlick = (1 - missing) * np.clip(1 - m + products(with_roots(here)) @ fresnel, 0, 1) ** 5
        rows.append((one + two, one * two))
        lost.append((missing * measure).sum())
        grazing.append((schlick * measure).sum())
    total, product = np.array(rows).T
    features = np.stack([total**i * product**j for i in range(5) for j in range(5 - i)], -1)
    for name, values, power in (("averageLoss", lost, 3), ("averageFresnel", grazing, 1)):
        coefficients = np.linalg.lstsq(features, np.array(values) ** (1 / power), rcond=None)[0]
        errors = (features @ coefficients) ** power - values
        relative = errors / (np.array(values) + 0.005)
        print(f"// {name}: max error {np.abs(errors).max():.4f}, relative {relative.min():.3f}")
        show(name, coefficients)


if __name__ == "__main__":
    main()
