"""What a thin film reflects, exactly: Airy's sum for both polarizations at every wavelength, as linear Rec. 709."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
WAVELENGTHS = np.arange(360.0, 831.0)


def _peak(center: float, below: float, above: float) -> Array:
    width = np.where(center > WAVELENGTHS, below, above)
    return np.exp(-0.5 * ((WAVELENGTHS - center) * width) ** 2)


def sensitivities() -> Array:
    """(3, wavelengths) of linear Rec. 709, each of sum 1: even light is white.

    CIE 1931 after Wyman, Sloan and Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color Matching
    Functions", table 1; the matrix is IEC 61966-2-1's.
    """
    x = (
        1.056 * _peak(599.8, 0.0264, 0.0323)
        + 0.362 * _peak(442.0, 0.0624, 0.0374)
        - 0.065 * _peak(501.1, 0.049, 0.0382)
    )
    y = 0.821 * _peak(568.8, 0.0213, 0.0247) + 0.286 * _peak(530.9, 0.0613, 0.0322)
    z = 1.217 * _peak(437.0, 0.0845, 0.0278) + 0.681 * _peak(459.0, 0.0385, 0.0725)
    to_rgb = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    rgb = np.array(to_rgb) @ [x / x.sum(), y / y.sum(), z / z.sum()]
    return rgb / rgb.sum(axis=1, keepdims=True)


def reflectance(cosines: Array, film: float, base: complex, nanometres: float) -> Array:
    """(cosines, 3) of unpolarized light from air, by indices of refraction (a metal's is complex)."""
    cosine = np.asarray(cosines, float)[:, None]

    def refracted(index: complex) -> Array:
        return np.sqrt(1 - (1 - cosine**2) / index**2 + 0j)

    def amplitudes(above: complex, below: complex) -> tuple[Array, Array]:
        a, b = refracted(above), refracted(below)
        return (above * a - below * b) / (above * a + below * b), (below * a - above * b) / (below * a + above * b)

    detour = np.exp(4j * np.pi * film * nanometres * refracted(film) / WAVELENGTHS)
    spectrum = 0.0
    for upper, lower in zip(amplitudes(1.0, film), amplitudes(film, base), strict=True):
        spectrum = spectrum + 0.5 * np.abs((upper + lower * detour) / (1 + upper * lower * detour)) ** 2
    return spectrum @ sensitivities().T
