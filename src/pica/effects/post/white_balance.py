"""White balance: which colour of light becomes white."""

import numpy as np
from numpy.typing import NDArray

NEUTRAL = 6500.0
"""Kelvin of the light that is white without adaptation."""
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""XYZ to cone responses (Lam 1985; ICC.1:2022, annex E)."""
_TO_XYZ = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)
"""Linear Rec. 709 to XYZ (IEC 61966-2-1)."""


def planckian(kelvin: float) -> tuple[float, float]:
    """CIE 1931 chromaticity x, y of a black body, 1667 to 25000 K.

    Kim et al. 2002, "Design of Advanced Color Temperature Control System for HDTV Applications".
    """
    inverse = 1e3 / kelvin
    if kelvin < 4000:
        x = ((-0.2661239 * inverse - 0.2343589) * inverse + 0.8776956) * inverse + 0.179910
    else:
        x = ((-3.0258469 * inverse + 2.1070379) * inverse + 0.2226347) * inverse + 0.240390
    if kelvin < 2222:
        y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
    elif kelvin < 4000:
        y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
    else:
        y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483
    return x, y


def adaptation(source: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) XYZ under the white XYZ `source` to XYZ under `target`, by Bradford's transform."""
    gain = (_BRADFORD @ target) / (_BRADFORD @ source)
    return np.linalg.inv(_BRADFORD) @ np.diag(gain) @ _BRADFORD


def balance(kelvin: float) -> NDArray[np.float64]:
    """(3, 3) linear Rec. 709 to the same: light of a black body of `kelvin` becomes that of one of 6500 K."""
    moved = adaptation(_white(kelvin), _white(NEUTRAL))
    return np.linalg.inv(_TO_XYZ) @ moved @ _TO_XYZ


def _white(kelvin: float) -> NDArray[np.float64]:
    x, y = planckian(kelvin)
    return np.array([x / y, 1, (1 - x - y) / y])
