"""Hills in code: heights of fractal noise."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def fractal_heights(samples: int, hill: float, height: float, seed: int = 0, octaves: int = 6) -> Floats:
    """(samples, samples) heights of about -`height` to `height` metres; `hill`: samples from one big hill to the next.

    Sums of gradient noise, each of half the size and height of the one before (Perlin 2002, "Improving Noise";
    Musgrave, Kolb and Mace 1989, "The Synthesis and Rendering of Eroded Fractal Terrains").
    """
    rng = np.random.default_rng(seed)
    total = np.zeros((samples, samples))
    for octave in range(octaves):
        total += _gradient_noise(samples, hill / 2**octave, rng) / 2**octave
    return total * height


def _gradient_noise(samples: int, cell: float, rng: np.random.Generator) -> Floats:
    """(samples, samples) noise of about -1 to 1 over a lattice `cell` samples wide."""
    place = np.arange(samples) / cell
    lattice = int(place[-1]) + 2
    angles = rng.uniform(0, 2 * np.pi, (lattice, lattice))
    whole = place.astype(np.intp)
    x, y = np.meshgrid(place - whole, place - whole)
    column, row = np.meshgrid(whole, whole)
    corners = []
    for down in (0, 1):
        for right in (0, 1):
            angle = angles[row + down, column + right]
            corners.append(np.cos(angle) * (x - right) + np.sin(angle) * (y - down))
    smooth_x, smooth_y = (t**3 * (t * (6 * t - 15) + 10) for t in (x, y))
    upper = corners[0] * (1 - smooth_x) + corners[1] * smooth_x
    lower = corners[2] * (1 - smooth_x) + corners[3] * smooth_x
    return np.sqrt(2) * (upper * (1 - smooth_y) + lower * smooth_y)
