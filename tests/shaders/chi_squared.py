"""Does a sampler draw what its density says? Pearson's chi-squared test over the unit square."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

Array = NDArray[np.floating]
SIGNIFICANCE = 0.01


def integrate(density: Callable[[Array], Array], bins: tuple[int, int], order: int = 6) -> Array:
    """(bins) integrals of a density over the cells of the unit square, by Gauss-Legendre; it takes (points, 2)."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    axes = [((np.arange(count)[:, None] + (nodes + 1) / 2) / count).ravel() for count in bins]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    values = density(points).reshape(bins[0], order, bins[1], order)
    return np.einsum("aibj,i,j->ab", values, weights, weights) / (4 * bins[0] * bins[1])


def p_value(samples: Array, total: int, expected: Array) -> float:
    """Chance of a misfit as large as that of `samples`, (n, 2) in the unit square out of `total` drawn.

    `expected` holds the cells' integrals; the draws that failed count as one more cell, as do the cells too empty
    for the test.
    """
    counts = np.histogram2d(*samples.T, bins=expected.shape, range=((0, 1), (0, 1)))[0].ravel()
    wanted = expected.ravel() * total
    counts, wanted = np.append(counts, total - len(samples)), np.append(wanted, max(total - wanted.sum(), 0))
    rare = wanted < 8
    pooled_counts = np.append(counts[~rare], counts[rare].sum())
    pooled = np.append(wanted[~rare], wanted[rare].sum())
    if pooled[-1] < 8:  # too few even together: they may not hold many more than that
        assert pooled_counts[-1] < 30, f"{pooled_counts[-1]} samples where {pooled[-1]:.2f} were expected"
        pooled_counts, pooled = pooled_counts[:-1], pooled[:-1]
    statistic = ((pooled_counts - pooled) ** 2 / pooled).sum()
    return float(chi2.sf(statistic, len(pooled) - 1))


def assert_fits(samples: Array, total: int, density: Callable[[Array], Array], tests: int, **options: object) -> None:
    """Fail when the fit is worse than chance allows, one of `tests` (Sidak 1967 keeps the chance of all at 1 %)."""
    expected = integrate(density, **({"bins": (16, 32)} | options))  # type: ignore[arg-type]
    assert expected.sum() <= 1.002, f"the density integrates to {expected.sum():.4f}"
    value = p_value(samples, total, expected)
    assert value > 1 - (1 - SIGNIFICANCE) ** (1 / tests), f"p-value {value:.2g}"
